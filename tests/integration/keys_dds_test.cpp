// Participants of Fast DDS with generated keys: what it enforces. They are not participants of
// tf-dude.

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "keys/certificates.hpp"
#include "keys/permissions.hpp"
#include "support/catch.hpp"
#include "support/domain_lease.hpp"
#include "support/key_store.hpp"
#include "support/process.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude::fastdds {
namespace {

namespace fs = std::filesystem;

using testing::content_of;
using testing::daemon_of;
using testing::eventually;
using testing::looking;
using testing::moving;
using testing::TestKeys;

Time now() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

edds::DomainParticipantFactory& factory() {
  return *edds::DomainParticipantFactory::get_instance();
}

/// A participant on this computer. Without keys it has no security.
class Participant {
 public:
  explicit Participant(std::uint32_t domain, const KeyFiles* keys = nullptr) {
    edds::DomainParticipantQos qos;
    factory().load_XML_profiles_file(TFDUDE_LOOPBACK_PROFILE);  // loading it twice is harmless
    factory().get_participant_qos_from_profile("tfdude_participant", qos);
    // The handshake takes longer than the lease of the profile.
    qos.wire_protocol().builtin.discovery_config.leaseDuration = {30, 0};
    if (keys != nullptr) secure(qos, *keys);
    participant_ = factory().create_participant(domain, qos);
    if (participant_ != nullptr) type_.register_type(participant_);
  }
  ~Participant() {
    if (participant_ == nullptr) return;
    participant_->delete_contained_entities();
    factory().delete_participant(participant_);
  }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  [[nodiscard]] bool good() const { return participant_ != nullptr; }

  /// @return null if it is not allowed
  [[nodiscard]] edds::DataWriter* write(const char* topic, const char* partition) {
    edds::PublisherQos qos;
    qos.partition().push_back(partition);
    return participant_->create_publisher(qos)->create_datawriter(topic_of(topic),
                                                                  edds::DATAWRITER_QOS_DEFAULT);
  }
  [[nodiscard]] edds::DataReader* read(const char* topic, const char* partition) {
    edds::SubscriberQos qos;
    qos.partition().push_back(partition);
    return participant_->create_subscriber(qos)->create_datareader(topic_of(topic),
                                                                   edds::DATAREADER_QOS_DEFAULT);
  }

 private:
  static void secure(edds::DomainParticipantQos& qos, const KeyFiles& keys) {
    const auto set = [&](const std::string& name, const std::string& value) {
      qos.properties().properties().emplace_back("dds.sec." + name, value);
    };
    set("auth.plugin", "builtin.PKI-DH");
    set("auth.builtin.PKI-DH.identity_ca", "file://" + keys.authority);
    set("auth.builtin.PKI-DH.identity_certificate", "file://" + keys.certificate);
    set("auth.builtin.PKI-DH.private_key", "file://" + keys.key);
    set("auth.builtin.PKI-DH.identity_crl", "file://" + keys.revoked);
    set("access.plugin", "builtin.Access-Permissions");
    set("access.builtin.Access-Permissions.permissions_ca", "file://" + keys.authority);
    set("access.builtin.Access-Permissions.governance", "file://" + keys.governance);
    set("access.builtin.Access-Permissions.permissions", "file://" + keys.permissions);
    set("crypto.plugin", "builtin.AES-GCM-GMAC");
  }

  edds::Topic* topic_of(const char* name) {
    auto* known = participant_->lookup_topicdescription(name);
    if (known != nullptr) return dynamic_cast<edds::Topic*>(known);
    return participant_->create_topic(name, type_.get_type_name(), edds::TOPIC_QOS_DEFAULT);
  }

  edds::TypeSupport type_{new PresenceType};
  edds::DomainParticipant* participant_ = nullptr;
};

int readers_of(edds::DataWriter* writer) {
  edds::PublicationMatchedStatus status;
  writer->get_publication_matched_status(status);
  return status.current_count;
}

int writers_of(edds::DataReader* reader) {
  edds::SubscriptionMatchedStatus status;
  reader->get_subscription_matched_status(status);
  return status.current_count;
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
  KeyFiles files = *find_keys(revoked, before);
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
