// A DDS participant with the readers and writers of an owner without joints or of a client, which
// sends nothing of its own: what idling costs without tf-dude, and how long one question takes.
//
//   bare_participant DOMAIN PROFILE owner|client    ends with the end of its standard input
//   bare_participant DOMAIN PROFILE server NAME     an owner that answers in this DDS partition
//   bare_participant DOMAIN PROFILE asker NAME...   asks each of these servers once, and leaves

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "transport/fastdds/discovery_gate.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

constexpr int kLongLease = 30;  // [s], as that of our participants

constexpr std::chrono::seconds kPatience{20};
constexpr std::chrono::milliseconds kRepeatEvery{2};

class Bare {
 public:
  Bare(std::uint32_t domain, const std::string& profile, const std::string& role,
       const std::vector<std::string>& servers)
      : profiles_(*Profiles::load(profile)) {
    const bool owner = role == "owner" || role == "server";
    auto qos = profiles_.participant();
    qos.wire_protocol().builtin.discovery_config.leaseDuration = {kLongLease, 0};
    DiscoveryGate discovery_gate(gate_, std::make_shared<LifeSigns>());
    discovery_gate.prepare(qos, domain, !owner);
    participant_ = edds::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    if (participant_ == nullptr) throw std::runtime_error("no participant");
    discovery_gate.open();
    read<wire::Presence, PresenceType>(kPresenceTopic, "presence_reader");
    read<wire::Reply, ReplyType>(kReplyTopic, "call_reader", "",
                                 [this](const edds::SampleInfo& info) { answered(info); });
    // As a command that asks for its frames: it has no reader of pages.
    if (role == "asker") {
      for (const std::string& server : servers) {
        requests_.push_back(write<RequestType>(kRequestTopic, "call_writer", server));
      }
      return;
    }
    read<wire::Page, PageType>(kDirectoryTopic, "directory_reader");
    if (!owner) return;
    if (role == "server") reply_ = write<ReplyType>(kReplyTopic, "call_writer");
    const std::string own = servers.empty() ? role : servers.front();
    read<wire::Request, RequestType>(kRequestTopic, "call_reader", own,
                                     [this](const edds::SampleInfo&) { answer(); });
    read<wire::Request, RequestType>(kChangeTopic, "call_reader", own);
    read<wire::Update, UpdateType>(kUpdateTopic, "update_reader");
    write<PresenceType>(kPresenceTopic, "presence_writer");
    write<PageType>(kDirectoryTopic, "directory_writer");
  }

  /// Asks all servers until they have answered. @return whether they have
  [[nodiscard]] bool ask() {
    const auto deadline = Deadline::clock::now() + kPatience;
    for (Writer* request : requests_) {
      if (!request->wait_until_matched(deadline)) return false;
    }
    wire::Request request;
    request.body().probe(0);
    Lock lock(mutex_);
    const auto all = [this]()
                         TFDUDE_REQUIRES(mutex_) { return answered_.size() >= requests_.size(); };
    while (!all() && Deadline::clock::now() < deadline) {
      lock.unlock();
      for (Writer* writer : requests_) writer->write(&request);
      lock.lock();
      arrived_.wait_until(lock, Deadline::clock::now() + kRepeatEvery, all);
    }
    return all();
  }

  void leave() {
    gate_->close();
    readers_.clear();
    writers_.clear();
    participant_->delete_contained_entities();
    edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

 private:
  void answered(const edds::SampleInfo& info) {
    {
      const Lock lock(mutex_);
      answered_.insert(writer_of(info));
    }
    arrived_.notify_one();
  }

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
      std::function<void(const edds::SampleInfo&)> on_sample = [](const edds::SampleInfo&) {}) {
    readers_.push_back(std::make_shared<Reader<Sample>>(
        context(), topic<Type>(name), partition, profile,
        typename Reader<Sample>::Calls{
            [on_sample](const Sample&, const edds::SampleInfo& info) { on_sample(info); },
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
  std::vector<Writer*> requests_;
  Writer* reply_ = nullptr;
  Mutex mutex_;
  Condition arrived_;
  std::set<ertps::GUID_t> answered_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace
}  // namespace tfdude::fastdds

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const std::string role = argv[3];
  tfdude::fastdds::Bare bare(static_cast<std::uint32_t>(std::stoul(argv[1])), argv[2], role,
                             {argv + 4, argv + argc});
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
