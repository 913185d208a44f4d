#include "transport/fastdds/profiles.hpp"

#include <map>
#include <string_view>

#include "tfdude/base/id.hpp"
#include "tfdude/types/options.hpp"

#include "base/log.hpp"
#include "base/mutex.hpp"
#include "description/file_text.hpp"
#include "transport/fastdds/builtin_profiles.hpp"
#include "transport/fastdds/identity.hpp"
#include "transport/fastdds/profile_text.hpp"

namespace tfdude::fastdds {
namespace {

constexpr const char* kPrefix = "tfdude_";

edds::DomainParticipantFactory& factory() {
  return *edds::DomainParticipantFactory::get_instance();
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

std::string builtin_text(const char* profiles) {
  std::string xml = profiles;
  for (const auto& [from, to] : kRenamedElements) replace_all(xml, from, to);
  return xml;
}

// Fast DDS reads and loads profiles without a lock.
Mutex& loading() {
  static Mutex mutex;
  return mutex;
}

// Loads profiles into the process under unique names. They are identified by their text: the same
// text is loaded once, and an edited file is loaded again.
// @return the ending of their names
Result<std::string> make_known(const std::string& xml) TFDUDE_REQUIRES(loading()) {
  // Endings. Not destroyed: threads may outlive it.
  static auto& known = *new std::map<std::string, std::string>;
  if (const auto before = known.find(xml); before != known.end()) return before->second;
  std::string ending = "@tfdude-" + std::to_string(known.size());
  const auto own = with_own_names(xml, ending);
  if (!own) return own;
  if (!ok(factory().load_XML_profiles_string(own->data(), own->size()))) {
    return fail(Errc::kConfig, "Fast DDS cannot parse it as profiles");
  }
  known.emplace(xml, ending);
  return ending;
}

// DDS samples have very different sizes. Fast DDS 2.9 accepts one that is larger than preallocated
// only with the two dynamic policies, whatever the names of the others say. A reader frees the
// memory of each sample: if it were reused, the largest samples that strangers ever sent stayed.
constexpr auto kMemoryOfWriters = ertps::DYNAMIC_REUSABLE_MEMORY_MODE;
constexpr auto kMemoryOfReaders = ertps::DYNAMIC_RESERVE_MEMORY_MODE;

// A built-in profile is loaded when it is first needed: Fast DDS 2.9 compiles regular expressions
// for each duration in it. All of them took half of the processor time of a short command.
// @return the ending of its name
Result<std::string> make_builtin_known(const std::string& name) TFDUDE_REQUIRES(loading()) {
  // Endings. Not destroyed: threads may outlive it.
  static auto& known = *new std::map<std::string, std::string>;
  if (const auto before = known.find(name); before != known.end()) return before->second;
  auto ending = make_known(only_profile(builtin_text(kBuiltinProfiles), name));
  if (ending) known.emplace(name, *ending);
  return ending;
}

}  // namespace

Result<Profiles> Profiles::load(const std::string& file) {
  const Lock lock(loading());
  if (file.empty()) return Profiles({});
  if (file == kLocalProfile) {
    return make_known(builtin_text(kLocalProfiles)).map([](const std::string& ending) {
      return Profiles(ending);
    });
  }
  const auto text = read_text(file, Readable::kRegularFile);
  if (!text) return fail_at("profile file", text.error());
  auto own = make_known(*text);
  if (!own) {
    return fail(Errc::kConfig, "profile file " + quote(file) +
                                   " is not a valid Fast DDS profile file: " + own.error().message);
  }
  return Profiles(*own);
}

template <class Read>
void Profiles::fill(const std::string& name, Read read) const {
  const std::string profile = kPrefix + name;
  const Lock lock(loading());
  if (!own_.empty() && ok(read(profile + own_))) return;
  if (const auto builtin = make_builtin_known(profile)) {
    (void)read(profile + *builtin);
  } else {
    log().error("the built-in DDS profile {}: {}", profile, builtin.error().message);
  }
}

edds::DomainParticipantQos Profiles::participant() const {
  edds::DomainParticipantQos qos;
  fill("participant", [&](const std::string& profile) {
    return factory().get_participant_qos_from_profile(profile, qos);
  });
  be_a_process_of_its_own(qos);
  return qos;
}

edds::DataWriterQos Profiles::writer(edds::Publisher& publisher, const std::string& name) const {
  edds::DataWriterQos qos;
  fill(name, [&](const std::string& profile) {
    return publisher.get_datawriter_qos_from_profile(profile, qos);
  });
  be_a_writer_of_its_own(qos);
  // Data that is written often, or to many, is acknowledged with each periodic heartbeat, not with
  // each DDS sample. That reduced the owner's processor load at 1 kHz of 100 edges from 11 to 7 %
  // of a core, and 32 daemons that start at once send a quarter of the packets.
  if (name == "update_writer" || name == "directory_writer")
    qos.reliable_writer_qos().disable_heartbeat_piggyback = true;
  // Writers evaluate no filters: Fast DDS 2.9 and 3.1 change the map of filters without a lock
  // while a write iterates over it, and crash when readers come and go.
  qos.writer_resource_limits().reader_filters_allocation.initial = 0;
  qos.writer_resource_limits().reader_filters_allocation.maximum = 0;
  qos.endpoint().history_memory_policy = kMemoryOfWriters;
  return qos;
}

edds::DataReaderQos Profiles::reader(edds::Subscriber& subscriber, const std::string& name) const {
  edds::DataReaderQos qos;
  fill(name, [&](const std::string& profile) {
    return subscriber.get_datareader_qos_from_profile(profile, qos);
  });
  qos.endpoint().history_memory_policy = kMemoryOfReaders;
  return qos;
}

}  // namespace tfdude::fastdds
