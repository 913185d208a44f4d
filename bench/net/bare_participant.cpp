// A DDS participant with the readers and writers of an owner or of a client, which sends nothing of
// its own: what idling costs without tf-dude.
//
//   bare_participant DOMAIN PROFILE owner|client    ends with the end of its standard input

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "transport/fastdds/discovery_gate.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

constexpr int kLongLease = 30;  // [s], as that of our participants

class Bare {
 public:
  Bare(std::uint32_t domain, const std::string& profile, bool owner)
      : profiles_(*Profiles::load(profile)) {
    auto qos = profiles_.participant();
    qos.wire_protocol().builtin.discovery_config.leaseDuration = {kLongLease, 0};
    DiscoveryGate discovery_gate(gate_, std::make_shared<LifeSigns>());
    discovery_gate.prepare(qos, domain, !owner);
    participant_ = edds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    if (participant_ == nullptr) throw std::runtime_error("no participant");
    discovery_gate.open();
    read<wire::Presence, PresenceType>(kPresenceTopic, "presence_reader");
    read<wire::Page, PageType>(kDirectoryTopic, "directory_reader");
    read<wire::Reply, ReplyType>(kReplyTopic, "call_reader");
    if (!owner) return;
    read<wire::Request, RequestType>(kRequestTopic, "call_reader");
    read<wire::Request, RequestType>(kChangeTopic, "call_reader");
    read<wire::Update, UpdateType>(kUpdateTopic, "update_reader");
    read<wire::Joints, JointsType>(kJointTopic, "update_reader");
    write<PresenceType>(kPresenceTopic, "presence_writer");
    write<PageType>(kDirectoryTopic, "directory_writer");
  }

 private:
  template <class Type>
  edds::Topic& topic(const char* name) {
    edds::TypeSupport type(new Type);
    type.register_type(participant_);
    if (auto* known = participant_->lookup_topicdescription(name)) {
      return static_cast<edds::Topic&>(*known);
    }
    return *participant_->create_topic(name, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  }
  template <class Sample, class Type>
  void read(const char* name, const char* profile) {
    readers_.push_back(std::make_shared<Reader<Sample>>(
        context(), topic<Type>(name), "", profile,
        typename Reader<Sample>::Calls{[](const Sample&, const ertps::GUID_t&) {}, nullptr}));
  }
  template <class Type>
  void write(const char* name, const char* profile) {
    writers_.push_back(std::make_unique<Writer>(context(), topic<Type>(name), "", profile));
  }
  Context context() { return {*participant_, profiles_, *gate_, counters_, announced_}; }

  const Profiles profiles_;
  const std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  Announced announced_;
  FastDdsCounters counters_;
  edds::DomainParticipant* participant_ = nullptr;
  std::vector<std::shared_ptr<void>> readers_;
  std::vector<std::unique_ptr<Writer>> writers_;
};

}  // namespace
}  // namespace tfdude::fastdds

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const tfdude::fastdds::Bare bare(static_cast<std::uint32_t>(std::stoul(argv[1])), argv[2],
                                   std::string(argv[3]) == "owner");
  std::cout << "ready" << std::endl;
  std::string line;
  while (std::getline(std::cin, line)) {
  }
  std::_Exit(0);  // its entities need no tidy end
}
