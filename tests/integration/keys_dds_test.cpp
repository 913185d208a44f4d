// Participants of Fast DDS with generated keys: what it enforces. They are not participants of
// tf-dude.

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "tfdude/client/node.hpp"

#include "keys/certificates.hpp"
#include "keys/permissions.hpp"
#include "support/catch.hpp"
#include "support/dds_participant.hpp"
#include "support/domain_lease.hpp"
#include "support/key_store.hpp"
#include "support/process.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

namespace fs = std::filesystem;

using testing::content_of;
using testing::daemon_of;
using testing::readers_of;
using testing::writers_of;
using Participant = testing::DdsParticipant;
using testing::eventually;
using testing::looking;
using testing::moving;
using testing::TestKeys;

Time now() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

bool arrives(edds::DataWriter& writer, edds::DataReader& reader) {
  return eventually([&] {
    wire::Presence sent;
    sent.partition("arm");
    wire::Presence received;
    edds::SampleInfo info;
    return write(writer, &sent) && ok(reader.take_next_sample(&received, &info)) &&
           received.partition() == "arm";
  });
}

// Participants that match have matched by then, so one that has not is rejected, not late.
void wait_longer() { std::this_thread::sleep_for(std::chrono::seconds(3)); }

}  // namespace

TEST_CASE("keys in DDS: only identities of one authority match") {
  for (const bool encrypt : {true, false}) {
    const testing::DomainLease domain;
    const TestKeys keys(now(), {encrypt, {0, 232}});
    const KeyFiles arm = keys.add("arm", daemon_of("arm"));
    const KeyFiles eye = keys.add("eye", looking());
    const TestKeys elsewhere(now());
    const KeyFiles stranger = elsewhere.add("eye", looking());
    Participant owner(domain.number(), &arm);
    Participant other(domain.number(), &stranger);
    Participant open(domain.number());
    Participant client(domain.number(), &eye);
    REQUIRE((owner.good() && other.good() && open.good() && client.good()));
    auto* writer = owner.write(kPresenceTopic, "arm");
    REQUIRE(writer != nullptr);
    auto* others = other.read(kPresenceTopic, "*");
    auto* opens = open.read(kPresenceTopic, "*");
    auto* clients = client.read(kPresenceTopic, "*");
    REQUIRE((others != nullptr && opens != nullptr && clients != nullptr));
    CHECK(eventually([&] { return writers_of(clients) == 1 && readers_of(writer) == 1; }));
    CHECK(arrives(*writer, *clients));
    wait_longer();
    CHECK(readers_of(writer) == 1);
    CHECK(writers_of(others) == 0);
    CHECK(writers_of(opens) == 0);
  }
}

TEST_CASE("keys in DDS: an endpoint without permission cannot be created") {
  const testing::DomainLease domain;
  const TestKeys keys(now());
  const KeyFiles arm = keys.add("arm", daemon_of("arm"));
  const KeyFiles planner = keys.add("planner", moving("arm"));
  Participant owner(domain.number(), &arm);
  Participant client(domain.number(), &planner);
  REQUIRE((owner.good() && client.good()));
  CHECK(owner.write(kPresenceTopic, "arm") != nullptr);
  CHECK(owner.write(kReplyTopic, "arm/0123") != nullptr);
  CHECK(owner.read(kReplyTopic, "*/4567") != nullptr);
  CHECK(owner.read(kChangeTopic, "arm") != nullptr);
  CHECK(owner.write(kPresenceTopic, "base") == nullptr);
  CHECK(owner.write(kReplyTopic, "base/0123") == nullptr);
  CHECK(owner.write(kChangeTopic, "base") == nullptr);
  CHECK(owner.read(kRequestTopic, "*") == nullptr);
  CHECK(client.write(kChangeTopic, "arm") != nullptr);
  CHECK(client.write(kUpdateTopic, "arm") != nullptr);
  CHECK(client.write(kRequestTopic, "base") != nullptr);
  CHECK(client.write(kChangeTopic, "base") == nullptr);
  CHECK(client.write(kChangeTopic, "*") == nullptr);
  CHECK(client.write(kJointTopic, "base") == nullptr);
  CHECK(client.write(kPresenceTopic, "arm") == nullptr);
  CHECK(client.write("another/topic", "arm") == nullptr);
}

TEST_CASE("keys in DDS: only who may publish the time is heard") {
  const testing::DomainLease domain;
  const TestKeys keys(now());
  (void)keys.add("arm", daemon_of("arm"));
  (void)keys.add("eye", looking());
  Roles timekeeping;
  timekeeping.clock = true;
  (void)keys.add("clock", timekeeping);
  Options options;
  options.domain = domain.number();
  options.profile = TFDUDE_LOOPBACK_PROFILE;
  options.timeout = Milliseconds(100);
  options.clock = ClockKind::kExternal;
  options.keys = keys.path("arm");
  Node arm = Node::open("arm", {}, options).value();
  options.keys = keys.path("eye");
  Client eye = Client::open(options).value();
  const Time now = time_of(7);
  const auto rejected = eye.publish_clock(external_time(now));
  REQUIRE_FALSE(rejected);
  CHECK(rejected.error().code == Errc::kNotPermitted);
  options.keys = keys.path("clock");
  Client publisher = Client::open(options).value();
  CHECK(
      eventually([&] { return publisher.publish_clock(external_time(now)) && arm.now() == now; }));
}

TEST_CASE("keys in DDS: participants that know the list do not match a revoked identity") {
  const testing::DomainLease domain;
  const TestKeys keys(now());
  const KeyFiles arm = keys.add("arm", daemon_of("arm"));
  const KeyFiles eye = keys.add("eye", looking());
  (void)keys.add("thief", looking());
  const testing::TemporaryDirectory copy;
  const std::string stolen = copy.path() + "/thief";
  fs::copy(keys.path("thief"), stolen);
  REQUIRE(revoke_identity(keys.path(), "thief", now()));
  const auto thief = find_keys(stolen, now());  // with the previous list
  REQUIRE(thief);
  Participant owner(domain.number(), &arm);
  Participant revoked(domain.number(), &*thief);
  Participant client(domain.number(), &eye);
  REQUIRE((owner.good() && revoked.good() && client.good()));
  auto* writer = owner.write(kPresenceTopic, "arm");
  auto* stolen_reader = revoked.read(kPresenceTopic, "*");
  auto* reader = client.read(kPresenceTopic, "*");
  REQUIRE((writer != nullptr && stolen_reader != nullptr && reader != nullptr));
  CHECK(eventually([&] { return writers_of(reader) == 1; }));
  wait_longer();
  CHECK(writers_of(stolen_reader) == 0);
  CHECK(readers_of(writer) == 1);
}

TEST_CASE("keys in DDS: an expired or revoked certificate creates no participant") {
  const testing::DomainLease domain;
  const Time before = now() - Days(10);
  const TestKeys keys(before);
  const KeyFiles current = keys.add("current", looking(), Days(20));
  CHECK(Participant(domain.number(), &current).good());
  const KeyFiles expired = keys.add("expired", looking(), Days(5));
  CHECK_FALSE(Participant(domain.number(), &expired).good());
  const testing::TemporaryDirectory copy;
  const std::string revoked = copy.path() + "/revoked";
  (void)keys.add("revoked", looking(), Days(20));
  fs::copy(keys.path("revoked"), revoked);
  REQUIRE(revoke_identity(keys.path(), "revoked", before));
  KeyFiles files = find_keys(revoked, before).value();
  CHECK(Participant(domain.number(), &files).good());
  files.revoked = current.revoked;
  CHECK_FALSE(Participant(domain.number(), &files).good());
}

TEST_CASE("keys in DDS: permissions that a participant signed itself are rejected") {
  const testing::DomainLease domain;
  const TestKeys keys(now());
  const KeyFiles thief = keys.add("thief", looking());
  const auto authority = keys::read_certificate(content_of(thief.authority));
  const keys::Pair own{*keys::read_key(content_of(thief.key)),
                       *keys::read_certificate(content_of(thief.certificate))};
  auto grant =
      keys::read_permissions(*keys::verify_document(*authority, content_of(thief.permissions)));
  REQUIRE(grant);
  grant->roles.observe = true;
  std::ofstream(thief.permissions) << *keys::sign_document(own, keys::permissions_of(*grant));
  CHECK_FALSE(Participant(domain.number(), &thief).good());
}

}  // namespace tfdude::fastdds
