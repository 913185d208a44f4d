// A DDS participant with the readers and writers of an owner or of a client, which sends nothing of
// its own: what idling costs without tf-dude, and how long one question takes.
//
//   bare_participant DOMAIN PROFILE owner|client    ends with the end of its standard input
//   bare_participant DOMAIN PROFILE server          an owner that answers
//   bare_participant DOMAIN PROFILE asker           asks the server once, and leaves

#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "transport/fastdds/discovery_gate.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

constexpr int kLongLease = 30;  // [s], as that of our participants

constexpr const char* kServer = "server";  // the DDS partition of its requests
constexpr std::chrono::seconds kPatience{20};
constexpr std::chrono::milliseconds kRepeatEvery{2};

class Bare {
 public:
  Bare(std::uint32_t domain, const std::string& profile, const std::string& role)
      : profiles_(*Profiles::load(profile)) {
    const bool owner = role == "owner" || role == kServer;
    auto qos = profiles_.participant();
    qos.wire_protocol().builtin.discovery_config.leaseDuration = {kLongLease, 0};
    DiscoveryGate discovery_gate(gate_, std::make_shared<LifeSigns>());
    discovery_gate.prepare(qos, domain, !owner);
    participant_ = edds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    if (participant_ == nullptr) throw std::runtime_error("no participant");
    discovery_gate.open();
    read<wire::Presence, PresenceType>(kPresenceTopic, "presence_reader");
    read<wire::Reply, ReplyType>(kReplyTopic, "call_reader", "",
                                 [this](const wire::Reply&) { answered_ = true; });
    // As a command that asks for its frames: it has no reader of pages.
    if (role == "asker") {
      request_ = write<RequestType>(kRequestTopic, "call_writer", kServer);
      write<RequestType>(kChangeTopic, "call_writer", kServer);
      return;
    }
    read<wire::Page, PageType>(kDirectoryTopic, "directory_reader");
    if (!owner) return;
    if (role == kServer) reply_ = write<ReplyType>(kReplyTopic, "call_writer");
    read<wire::Request, RequestType>(kRequestTopic, "call_reader", role,
                                     [this](const wire::Request&) { answer(); });
    read<wire::Request, RequestType>(kChangeTopic, "call_reader", role);
    read<wire::Update, UpdateType>(kUpdateTopic, "update_reader");
    read<wire::Joints, JointsType>(kJointTopic, "update_reader");
    write<PresenceType>(kPresenceTopic, "presence_writer");
    write<PageType>(kDirectoryTopic, "directory_writer");
  }

  /// Asks until the answer is there. @return whether it came
  [[nodiscard]] bool ask() {
    const auto deadline = Deadline::clock::now() + kPatience;
    if (!request_->wait_until_matched(deadline)) return false;
    wire::Request request;
    request.body().probe(0);
    while (!answered_ && Deadline::clock::now() < deadline) {
      request_->write(&request);
      const auto next = Deadline::clock::now() + kRepeatEvery;
      while (!answered_ && Deadline::clock::now() < next) {
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
    }
    return answered_;
  }

  void leave() {
    gate_->close();
    readers_.clear();
    writers_.clear();
    participant_->delete_contained_entities();
    edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

 private:
  void answer() {
    if (reply_ == nullptr) return;
    wire::Reply reply;
    reply.body().alive(0);
    reply_->write(&reply);
  }

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
  void read(
      const char* name, const char* profile, const std::string& partition = "",
      std::function<void(const Sample&)> on_sample = [](const Sample&) {}) {
    readers_.push_back(std::make_shared<Reader<Sample>>(
        context(), topic<Type>(name), partition, profile,
        typename Reader<Sample>::Calls{
            [on_sample](const Sample& sample, const edds::SampleInfo&) { on_sample(sample); },
            nullptr}));
  }
  template <class Type>
  Writer* write(const char* name, const char* profile, const std::string& partition = "") {
    return writers_
        .emplace_back(std::make_unique<Writer>(context(), topic<Type>(name), partition, profile))
        .get();
  }
  Context context() { return {*participant_, profiles_, *gate_, counters_, announced_}; }

  const Profiles profiles_;
  const std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  Announced announced_;
  FastDdsCounters counters_;
  edds::DomainParticipant* participant_ = nullptr;
  std::vector<std::shared_ptr<void>> readers_;
  std::vector<std::unique_ptr<Writer>> writers_;
  Writer* request_ = nullptr;
  Writer* reply_ = nullptr;
  std::atomic<bool> answered_{false};
};

}  // namespace
}  // namespace tfdude::fastdds

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const std::string role = argv[3];
  tfdude::fastdds::Bare bare(static_cast<std::uint32_t>(std::stoul(argv[1])), argv[2], role);
  if (role == "asker") {
    const bool answered = bare.ask();
    bare.leave();
    std::_Exit(answered ? 0 : 1);
  }
  std::cout << "ready" << std::endl;
  std::string line;
  while (std::getline(std::cin, line)) {
  }
  std::_Exit(0);  // its entities need no tidy end
}
