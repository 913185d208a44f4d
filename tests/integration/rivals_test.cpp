// Participants that only say that they serve a partition, beside its real owner, over DDS.

#include <chrono>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "support/catch.hpp"
#include "support/domain_lease.hpp"
#include "support/foreign_writer.hpp"
#include "support/process.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::eventually;
using testing::ForeignWriter;

Options local(std::uint32_t domain) {
  Options options;
  options.domain = domain;
  options.profile = kLocalProfile;
  options.shared_memory = false;  // what comes over the network
  return options;
}

TransportPtr transport_of(const Options& options, const std::string& partition) {
  return *make_fastdds_transport({options.domain, options.profile, partition, nullptr});
}

template <class Type>
ForeignWriter writer_in_arm(std::uint32_t domain, const char* topic) {
  return {domain, topic, fastdds::edds::TypeSupport(new Type), "arm", true};
}

// What a rival can say with one message.
wire::Presence presence(std::uint64_t incarnation, bool stops = false) {
  Presence forged{"arm", incarnation, "tower", 4711, 1, !stops};
  forged.stopped = stops;
  forged.ticket = incarnation;
  return fastdds::to_wire(forged);
}

}  // namespace

// The rival answers nothing. Before, the first of these messages ended the owner.
TEST_CASE("rivals: a presence of an owned partition does not end its owner") {
  const testing::DomainLease domain;
  const Options options = local(domain.number());
  auto arm = Node::open(transport_of(options, "arm"), "arm",
                        {{"world", "", {}}, {"hand", "world", {}}}, options);
  REQUIRE(arm);
  bool taken = false;
  const Subscription conflicts = arm->on_taken([&](const Change&) { taken = true; });
  auto client = Client::open(options);
  REQUIRE(client);
  REQUIRE(client->lookup("world", "hand"));
  ForeignWriter rival = writer_in_arm<fastdds::PresenceType>(domain.number(), "tfdude/presence");
  rival.await_readers(2);
  const auto at = [](int hours) {
    return static_cast<std::uint64_t>(
        (std::chrono::system_clock::now() + std::chrono::hours(hours)).time_since_epoch().count());
  };
  wire::Presence later = presence(at(1));
  rival.write(&later);
  // The owner goes on as a later process than the one that does not answer.
  REQUIRE(eventually([&] {
    const auto all = client->partitions();
    return all && all->size() == 1 && all->front().pid != 4711 && all->front().reachable;
  }));
  CHECK(client->lookup("world", "hand"));
  CHECK(client->add("tool", "hand", {}));
  SECTION("a later one") {
    later = presence(at(2));
    rival.write(&later);
  }
  SECTION("one that stops") {
    later = presence(at(1), true);
    rival.write(&later);
  }
  CHECK(eventually([&] { return client->lookup("world", "tool").has_value(); }));
  CHECK(arm->add("other", "world", {}));
  CHECK_FALSE(taken);
}

// Before, these calls failed for as long as the sender lived.
TEST_CASE("frames that were announced and never come are missing from lists, which name them") {
  const testing::DomainLease domain;
  const Options options = local(domain.number());
  auto arm = Node::open(transport_of(options, "arm"), "arm",
                        {{"world", "", {}}, {"hand", "world", {}}}, options);
  REQUIRE(arm);
  ForeignWriter leg(domain.number(), "tfdude/presence",
                    fastdds::edds::TypeSupport(new fastdds::PresenceType), "leg", true);
  leg.await_readers(1);
  wire::Presence announced = fastdds::to_wire(Presence{"leg", 1, "tower", 4711, 4000, true});
  leg.write(&announced);
  auto client = Client::open(options);
  REQUIRE(client);
  REQUIRE(eventually([&] {
    const auto all = client->partitions();
    return all && all->size() == 2;
  }));
  const auto all = client->partitions();
  REQUIRE(all);
  CHECK((*all)[0].complete);
  CHECK_FALSE((*all)[1].complete);
  const auto frames = client->frames();
  REQUIRE(frames);
  CHECK(frames->size() == 2);
  CHECK(client->children("world").value() == std::vector<std::string>{"hand"});
  CHECK(client->roots().value() == std::vector<std::string>{"world"});
  CHECK(client->remove("hand"));
  CHECK(eventually([&] { return !arm->exists("hand"); }));
}

TEST_CASE("rivals: a page of an owned partition does not end its owner") {
  const testing::DomainLease domain;
  const Options options = local(domain.number());
  auto arm = Node::open(transport_of(options, "arm"), "arm",
                        {{"world", "", {}}, {"hand", "world", {}}}, options);
  REQUIRE(arm);
  auto client = Client::open(options);
  REQUIRE(client);
  REQUIRE(client->lookup("world", "hand"));
  {
    ForeignWriter rival = writer_in_arm<wire::PagePubSubType>(domain.number(), "tfdude/directory");
    rival.await_readers(2);
    const auto later = static_cast<std::uint64_t>(
        (std::chrono::system_clock::now() + 1h).time_since_epoch().count());
    wire::Page page = fastdds::to_wire(Page{"arm", 0, later, later + 1, {{"claw", "world"}}});
    rival.write(&page);
    CHECK(arm->add("tool", "hand", {}));
  }
  // Once its writer has left, the owner goes on as a later process.
  CHECK(eventually([&] { return client->lookup("world", "tool").has_value(); }));
  CHECK(client->add("other", "tool", {}));
}

}  // namespace tfdude
