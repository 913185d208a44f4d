#include "transport/fastdds/profiles.hpp"

#include <fstream>
#include <functional>
#include <mutex>
#include <set>
#include <string_view>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/builtin_profiles.hpp"

namespace tfdude::fastdds {
namespace {

constexpr const char* kPrefix = "tfdude_";
constexpr const char* kBuiltinPrefix = "tfdude_builtin_";

edds::DomainParticipantFactory& factory() {
  return *edds::DomainParticipantFactory::get_instance();
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

// Fast DDS keeps profiles by name for the whole process and refuses a name twice, so the built-in ones
// get names of their own, and each file is loaded once.
std::string renamed_builtin() {
  std::string xml = kBuiltinProfiles;
  replace_all(xml, kPrefix, kBuiltinPrefix);
  for (const auto& [from, to] : kRenamedElements) replace_all(xml, from, to);
  return xml;
}

// Samples are of very different sizes. Fast DDS 2.9 takes one that is larger than was preallocated under this
// policy and the dynamic one only, whatever it calls the others.
constexpr auto kMemoryPolicy = ertps::DYNAMIC_REUSABLE_MEMORY_MODE;

void fill(const std::string& name, const std::function<ReturnCode(const std::string&)>& read) {
  if (!ok(read(kPrefix + name))) (void)read(kBuiltinPrefix + name);
}

}  // namespace

Result<void> load_profiles(const std::string& file) {
  static std::mutex mutex;
  static std::set<std::string> loaded;
  const std::lock_guard lock(mutex);
  if (loaded.insert("").second) {
    const std::string xml = renamed_builtin();
    if (!ok(factory().load_XML_profiles_string(xml.data(), xml.size()))) {
      loaded.erase("");
      return fail(Errc::kConfig, "the built-in DDS profiles could not be read");
    }
  }
  if (file.empty() || loaded.count(file) != 0) return {};
  if (!std::ifstream(file).good()) {
    return fail(Errc::kConfig, "profile file " + quote(file) + " cannot be opened");
  }
  if (!ok(factory().load_XML_profiles_file(file))) {
    return fail(Errc::kConfig,
                "profile file " + quote(file) +
                    " is not a valid Fast DDS profile file (or repeats the names of one "
                    "loaded before)");
  }
  loaded.insert(file);
  return {};
}

edds::DomainParticipantQos participant_qos() {
  edds::DomainParticipantQos qos;
  fill("participant", [&](const std::string& name) {
    return factory().get_participant_qos_from_profile(name, qos);
  });
  return qos;
}

edds::DataWriterQos writer_qos(edds::Publisher& publisher, const std::string& name) {
  edds::DataWriterQos qos;
  fill(name, [&](const std::string& profile) {
    return publisher.get_datawriter_qos_from_profile(profile, qos);
  });
  // What is written often, or to many, is acknowledged with each periodic heartbeat, not with each sample: that halved
  // what 1 kHz of 100 edges takes of the owner's processor (11 to 7 % of a core), and 32 daemons that start at
  // once send a quarter of the packets.
  if (name == "update_writer" || name == "presence_writer" || name == "directory_writer")
    qos.reliable_writer_qos().disable_heartbeat_piggyback = true;
  // Writers evaluate no filters: in Fast DDS 2.9 and 3.1 the map of filters is changed without a lock
  // while a write goes through it, and crashes as readers come and go.
  qos.writer_resource_limits().reader_filters_allocation.initial = 0;
  qos.writer_resource_limits().reader_filters_allocation.maximum = 0;
  qos.endpoint().history_memory_policy = kMemoryPolicy;
  return qos;
}

edds::DataReaderQos reader_qos(edds::Subscriber& subscriber, const std::string& name) {
  edds::DataReaderQos qos;
  fill(name, [&](const std::string& profile) {
    return subscriber.get_datareader_qos_from_profile(profile, qos);
  });
  qos.endpoint().history_memory_policy = kMemoryPolicy;
  // A socket of its own, that other traffic does not fill: else the living would seem dead.
  if (name == "presence_reader") {
    qos.properties().properties().emplace_back("fastdds.unique_network_flows", "");
  }
  return qos;
}

}  // namespace tfdude::fastdds
