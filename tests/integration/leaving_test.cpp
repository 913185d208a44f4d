// Endpoints that are deleted while others are matched with them: Fast DDS may then call a listener
// that was removed meanwhile.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/domain_lease.hpp"
#include "support/process.hpp"
#include "transport/fastdds/discovery_gate.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;
using Beats = Reader<wire::Presence>;

// A participant as ours, with one topic.
class Member {
 public:
  explicit Member(std::uint32_t domain) {
    auto qos = profiles_.participant();
    // As of our participants: with a short one Fast DDS 2.9 may wait for itself as it ends.
    qos.wire_protocol().builtin.discovery_config.leaseDuration = {30, 0};
    DiscoveryGate discovery_gate(gate_, std::make_shared<LifeSigns>());
    discovery_gate.prepare(qos, domain, false);
    participant_ = factory().create_participant(domain, qos);
    REQUIRE(participant_ != nullptr);
    discovery_gate.open();
    edds::TypeSupport type(new PresenceType);
    type.register_type(participant_);
    topic_ =
        participant_->create_topic(kPresenceTopic, type.get_type_name(), edds::TOPIC_QOS_DEFAULT);
    REQUIRE(topic_ != nullptr);
  }
  ~Member() {
    gate_->close();
    participant_->delete_contained_entities();
    factory().delete_participant(participant_);
  }
  Member(const Member&) = delete;
  Member& operator=(const Member&) = delete;

  void tidy() { announced_.writers.tidy(); }

  [[nodiscard]] std::unique_ptr<Beats> read(
      std::atomic<int>& matches, std::function<void()> on_sample = [] {},
      const std::string& profile = "presence_reader") {
    return std::make_unique<Beats>(
        Context{*participant_, profiles_, *gate_, counters_, announced_}, *topic_, "", profile,
        Beats::Calls{[on_sample](const wire::Presence&, const edds::SampleInfo&) { on_sample(); },
                     [&matches](const ertps::GUID_t&, int) { ++matches; }});
  }
  [[nodiscard]] std::unique_ptr<Writer> write(const std::string& profile = "presence_writer") {
    return std::make_unique<Writer>(
        Context{*participant_, profiles_, *gate_, counters_, announced_}, *topic_, "", profile);
  }

 private:
  static edds::DomainParticipantFactory& factory() {
    return *edds::DomainParticipantFactory::get_instance();
  }

  Announced announced_;
  FastDdsCounters counters_;
  const Profiles profiles_ = Profiles::load(TFDUDE_LOOPBACK_PROFILE).value();
  const std::shared_ptr<Gate> gate_ = std::make_shared<Gate>();
  edds::DomainParticipant* participant_ = nullptr;
  edds::Topic* topic_ = nullptr;
};

}  // namespace

TEST_CASE("leaving: deleting an endpoint waits for the callback that runs") {
  const testing::DomainLease lease;
  Member leaver(lease.number());
  Member other(lease.number());
  std::promise<void> inside;
  std::promise<void> go_on;
  std::atomic<int> matches{0};
  std::atomic<int> samples{0};
  const auto busy = leaver.read(matches, [&] {
    if (samples++ > 0) return;
    inside.set_value();
    go_on.get_future().wait();
  });
  auto idle = leaver.read(matches);
  const auto writer = other.write();
  REQUIRE(writer->wait_until_matched(std::chrono::steady_clock::now() + std::chrono::seconds(20)));
  wire::Presence sample;
  REQUIRE(writer->write(&sample));
  REQUIRE(inside.get_future().wait_for(std::chrono::seconds(20)) == std::future_status::ready);
  auto deleted = std::async(std::launch::async, [&] { idle.reset(); });
  CHECK(deleted.wait_for(std::chrono::milliseconds(100)) == std::future_status::timeout);
  go_on.set_value();
  CHECK(deleted.wait_for(std::chrono::seconds(20)) == std::future_status::ready);
}

// Best effort: where a reliable writer goes as its first sample is being acknowledged, and the
// participant is to announce itself just then, Fast DDS (2.9 and 3.1) waits for itself for ever.
// Here that would happen within seconds.
TEST_CASE("leaving: 5000 readers are deleted while writers come and go") {
  const testing::DomainLease lease;
  Member leaver(lease.number());
  Member joiner(lease.number());
  std::atomic<bool> over{false};
  std::atomic<int> matches{0};
  {
    // All would be over before they discover each other.
    const auto reader = leaver.read(
        matches, [] {}, "call_reader");
    const auto writer = joiner.write("call_writer");
    REQUIRE(
        writer->wait_until_matched(std::chrono::steady_clock::now() + std::chrono::seconds(20)));
  }
  matches = 0;
  std::thread others([&] {
    while (!over) {
      std::vector<std::unique_ptr<Writer>> writers;
      for (int i = 0; i < 5; ++i) writers.push_back(joiner.write("call_writer"));
    }
  });
  // Several at a time: then one of them goes whenever a writer is matched with them.
  for (int round = 0; round < 1000; ++round) {
    std::vector<std::unique_ptr<Beats>> readers;
    for (int i = 0; i < 5; ++i)
      readers.push_back(leaver.read(
          matches, [] {}, "call_reader"));
  }
  over = true;
  others.join();
  CHECK(matches > 100);
}

TEST_CASE("leaving: who has deleted many endpoints is discovered without a delay") {
  const testing::DomainLease lease;
  Member old(lease.number());
  const auto first = old.write();
  for (int i = 0; i < 700; ++i) (void)old.write();
  const auto last = old.write();
  old.tidy();
  // Without that, a new participant waits for the next heartbeat, which comes once a second. The
  // computer may be busy, so only the fastest counts.
  auto quickest = std::chrono::steady_clock::duration::max();
  for (int i = 0; i < 5 && quickest > 400ms; ++i) {
    Member fresh(lease.number());
    std::atomic<int> matches{0};
    const auto begin = std::chrono::steady_clock::now();
    const auto reader = fresh.read(matches);
    CHECK(testing::eventually([&] { return matches == 2; }));
    quickest = std::min(quickest, std::chrono::steady_clock::now() - begin);
  }
  CHECK(quickest < 400ms);
}

}  // namespace tfdude::fastdds
