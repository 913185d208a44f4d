// Participants of other versions of the protocol, beside real ones over DDS.

#include <string>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "support/catch.hpp"
#include "support/domain_lease.hpp"
#include "support/foreign_writer.hpp"
#include "support/process.hpp"
#include "support/samples.hpp"
#include "transport/fastdds/topics.hpp"

namespace tfdude {
namespace {

using testing::Bytes;
using testing::eventually;
using testing::ForeignWriter;
using testing::RawType;

constexpr const char* kLater = "tfdude-protocol 2 0 9.8.7";

Options local(std::uint32_t domain) {
  Options options;
  options.domain = domain;
  options.profile = kLocalProfile;
  return options;
}

TransportPtr transport_of(const Options& options, const std::string& partition) {
  return *make_fastdds_transport({options.domain, options.profile, partition, nullptr});
}

}  // namespace

TEST_CASE("versions: a daemon of a later major version is listed but not used") {
  const testing::DomainLease domain;
  const Options options = local(domain.number());
  auto base = Node::open(transport_of(options, "base"), "base",
                         {{"world", "", {}}, {"mount", "world", {}}}, options);
  REQUIRE(base);
  auto client = Client::open(options);
  REQUIRE(client);
  REQUIRE(client->lookup("world", "mount"));
  // No topic of ours is needed, because name and version are announced in DDS's discovery.
  const ForeignWriter later(domain.number(), "tfdude/later",
                            fastdds::edds::TypeSupport(new RawType("later", false)), "", false,
                            {"tfdude serving arm", kLater});

  std::vector<PartitionInfo> partitions;
  REQUIRE(eventually([&] {
    partitions = client->partitions().value_or(std::vector<PartitionInfo>());
    return partitions.size() == 2;
  }));
  const PartitionInfo& arm = partitions[0].name == "arm" ? partitions[0] : partitions[1];
  CHECK(arm.name == "arm");
  CHECK_FALSE(arm.compatible());
  CHECK_FALSE(arm.reachable);
  CHECK(to_string(arm.protocol) == "2.0");
  CHECK(arm.program == "9.8.7");

  const auto looked_up = client->lookup("world", "hand");
  REQUIRE_FALSE(looked_up);
  CHECK(looked_up.error().code == Errc::kIncompatible);
  CAPTURE(looked_up.error().message);
  for (const char* part : {"'hand'", "'arm'", "9.8.7", "2.0", "1.1"}) {
    CHECK(looked_up.error().message.find(part) != std::string::npos);
  }
  // The others go on.
  CHECK(client->lookup("world", "mount"));
  CHECK(base->update("mount", {}));
}

TEST_CASE("versions: messages of a later major version are ignored") {
  const testing::DomainLease domain;
  const Options options = local(domain.number());
  auto base = Node::open(transport_of(options, "base"), "base", {{"world", "", {}}}, options);
  REQUIRE(base);
  // A participant that writes a page that this version could read.
  ForeignWriter later(domain.number(), "tfdude/directory",
                      fastdds::edds::TypeSupport(new wire::PagePubSubType), "arm", true,
                      {"tfdude serving arm", kLater});
  later.await_readers(1);
  wire::Page page = fastdds::to_wire(Page{"arm", 0, 1, 2, {{"hand", "world"}}});
  later.write(&page);
  // A page of the same kind from a program without a version of ours arrives, later than that one.
  ForeignWriter other(domain.number(), "tfdude/directory",
                      fastdds::edds::TypeSupport(new wire::PagePubSubType), "leg", true);
  other.await_readers(1);
  wire::Page marker = fastdds::to_wire(Page{"leg", 0, 1, 2, {{"foot", "world"}}});
  other.write(&marker);
  REQUIRE(eventually([&] { return base->exists("foot"); }));
  CHECK_FALSE(base->exists("hand"));
}

TEST_CASE("versions: a request that only a later minor version knows is rejected by name") {
  const testing::DomainLease domain;
  const Options options = local(domain.number());
  auto base = Node::open(transport_of(options, "base"), "base", {{"world", "", {}}}, options);
  REQUIRE(base);
  ForeignWriter later(domain.number(), kRequestTopic,
                      fastdds::edds::TypeSupport(new RawType("tfdude::wire::Request", false)),
                      "base", false, {"tfdude client", "tfdude-protocol 1 7 0.9.0"});
  const auto replies = later.read_replies();
  later.await_readers(1);
  // Request 77 for the frame 'world', of the kind 200, with a body that nobody here can read.
  Bytes request = testing::Cdr().string("world").ulong(0).ulong(77).ulonglong(0).octet(200).bytes();
  request.insert(request.end(), {1, 2, 3});
  REQUIRE(eventually([&] {
    later.write(&request);  // best effort, as any request is
    return replies->last().has_value();
  }));
  const Reply reply = *replies->last();
  CHECK(reply.sequence == 77);
  REQUIRE(std::holds_alternative<Error>(reply.body));
  CHECK(std::get<Error>(reply.body).code == Errc::kUnsupported);
  CHECK(std::get<Error>(reply.body).message == "this kind of request is not known to protocol 1.1");
}

TEST_CASE("versions: a daemon of a later minor version is accepted") {
  const testing::DomainLease domain;
  const Options options = local(domain.number());
  auto client = Client::open(options);
  REQUIRE(client);
  ForeignWriter later(domain.number(), kPresenceTopic,
                      fastdds::edds::TypeSupport(new RawType("tfdude::wire::Presence", true)),
                      "arm", true, {"tfdude serving arm", "tfdude-protocol 1 7 0.9.0"});
  later.await_readers(1);
  Presence presence{"arm", 5, "tower", 4711, 0, true};
  presence.protocol = {1, 7};
  presence.program = "0.9.0";
  Bytes bytes = testing::serialized<fastdds::PresenceType>(fastdds::to_wire(presence));
  bytes.insert(bytes.end(), 40, 1);  // fields that are not known here
  later.write(&bytes);
  REQUIRE(eventually([&] {
    const auto partitions = client->partitions();
    return partitions && partitions->size() == 1 && partitions->front().program == "0.9.0";
  }));
}

}  // namespace tfdude
