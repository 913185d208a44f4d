// DDS writers of other programs: some stream valid updates, others send malformed samples.

#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "support/catch.hpp"
#include "support/domain_lease.hpp"
#include "support/foreign_writer.hpp"
#include "support/joint_frames.hpp"
#include "support/memory_of.hpp"
#include "support/process.hpp"
#include "support/random.hpp"
#include "support/recorder.hpp"
#include "support/test_domain.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/port.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;

using testing::Bytes;
using testing::eventually;
using testing::ForeignWriter;
using testing::moved_by;
using testing::RawType;
using testing::revolute_named;

struct Counted {
  Counted(std::uint32_t domain, const std::string& partition, const std::string& frame)
      : node(Node::open(
                 *make_fastdds_transport({domain, TFDUDE_LOOPBACK_PROFILE, partition, counters}),
                 partition,
                 {{frame, "", {}},
                  {frame + "_tip", frame, {}},
                  testing::moved_by(frame + "_wrist", frame,
                                    testing::revolute_named(frame + "_joint"))})
                 .value()) {}

  std::shared_ptr<FastDdsCounters> counters = std::make_shared<FastDdsCounters>();
  Node node;
};

// Another program's update of one frame: one metre along x, a standard deviation of a millimetre in
// each direction.
wire::Update stranger_update(const std::string& id) {
  wire::Edge edge;
  edge.id(id);
  edge.x_pc().resize(28);
  edge.x_pc()[3] = 1.0;  // w of the quaternion
  edge.x_pc()[4] = 1.0;  // x
  for (const std::size_t diagonal : {7U, 13U, 18U}) edge.x_pc()[diagonal] = 1e-6;
  wire::Update update;
  update.edges({edge});
  update.stamp(-1);
  return update;
}

// The loopback profile with another reliability of streamed values.
std::string with_best_effort_updates() {
  std::ifstream file(TFDUDE_LOOPBACK_PROFILE);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string writer =
      "<data_writer "
      "profile_name=\"tfdude_update_writer\"><qos><reliability><kind>BEST_EFFORT</kind>"
      "</reliability><data_sharing><kind>OFF</kind></data_sharing></qos></data_writer>";
  return text.insert(text.find("</profiles>"), writer);
}

bool moved(Node& node, const std::string& frame) {
  const auto X = node.lookup(frame, frame + "_tip");
  return X && X->pose.translation().x() == 1.0;
}

}  // namespace

TEST_CASE("an update of a plain DDS writer to all partitions passes only the owner's filter") {
  const testing::DomainLease domain;
  Counted owner(domain.number(), "owner", "a");
  Counted other(domain.number(), "other", "b");
  ForeignWriter writer(domain.number(), "tfdude/update",
                       fastdds::edds::TypeSupport(new wire::UpdatePubSubType), "*");
  writer.await_readers(2);
  wire::Update update = stranger_update("a_tip");
  writer.write(&update);
  CHECK(eventually([&] { return moved(owner.node, "a"); }));
  CHECK(eventually([&] { return other.counters->updates_arrived == 1; }));
  CHECK(other.counters->updates_passed == 0);
  CHECK(owner.counters->updates_passed == 1);
  CHECK_FALSE(moved(other.node, "b"));
}

// They are no requests, so nothing of them is kept. Two writers at once need more than one needs.
TEST_CASE("the memory of large samples goes back to the system once they were read") {
  const testing::TestDomain domain;
  const testing::TemporaryDirectory files;
  const auto robot =
      domain.serve(files.write("robot.yaml", "partition: robot\nframes:\n  - {id: base}\n"));
  const long before = testing::memory_of(robot);
  Bytes sample(10U << 20U, 'a');
  sample[0] = 0;
  sample[1] = 1;
  sample[2] = sample[3] = 0;
  const auto send = [&] {
    ForeignWriter writer(domain.number(), "tfdude/request",
                         fastdds::edds::TypeSupport(new RawType("tfdude::wire::Request", false)),
                         "robot");
    writer.await_readers(1);
    Bytes own = sample;
    for (int i = 0; i < 20; ++i) writer.write(&own);
  };
  std::thread other(send);
  send();
  other.join();
  long after = 0;
  CHECK(eventually([&] { return (after = testing::memory_of(robot)) < before + 100; }));
  INFO("before: " << before << " MiB, then " << after);
  CHECK(domain.cli({"exists", "base"}).status == 0);
}

// A killed process whose clock was ahead has left a page that DDS holds back until an earlier one
// comes.
TEST_CASE("a page that waits for a lost one does not block pages of another process") {
  const testing::DomainLease domain;
  const auto transport =
      *make_fastdds_transport({domain.number(), TFDUDE_LOOPBACK_PROFILE, "", {}});
  testing::Recorder reader;
  REQUIRE(transport->start(reader));
  const auto page = [](std::uint32_t number, std::uint64_t process, const char* frame) {
    wire::PageEntry entry;
    entry.lamport_time(1);
    entry.id(frame);
    wire::Page made;
    made.partition("arm");
    made.number(number);
    made.incarnation(process);
    made.epoch(process);
    made.entries({entry});
    return made;
  };
  const auto type = [] { return fastdds::edds::TypeSupport(new wire::PagePubSubType); };
  ForeignWriter killed(domain.number(), "tfdude/directory", type(), "arm", true);
  ForeignWriter successor(domain.number(), "tfdude/directory", type(), "arm", true);
  killed.await_readers(1);
  successor.await_readers(1);
  const auto hears = [&](std::uint32_t number) {
    return reader.hears([&](const auto& heard) { return heard.page("arm", number, 2); });
  };
  wire::Page lost = page(0, 1, "a_lost_frame");
  wire::Page waiting = page(1, 1, "a_frame");
  killed.mute(true);
  killed.write(&lost, 1h);
  killed.mute(false);
  killed.write(&waiting, 1h);
  killed.mute(true);
  wire::Page next = page(2, 2, "a_frame");
  successor.write(&next);
  REQUIRE(hears(2));  // and so the two before have come, or are lost
  wire::Page same = page(1, 2, "a_frame");
  successor.write(&same);
  CHECK(hears(1));
  CHECK_FALSE(reader.heard().page("arm", 1, 1));
  transport->stop();
}

TEST_CASE("pages of a partition are accepted only from the DDS partition of its name") {
  const std::string partition = GENERATE("leg", "*", "a*");
  const testing::DomainLease domain;
  const auto transport =
      *make_fastdds_transport({domain.number(), TFDUDE_LOOPBACK_PROFILE, "", {}});
  testing::Recorder reader;
  REQUIRE(transport->start(reader));
  const auto type = [] { return fastdds::edds::TypeSupport(new wire::PagePubSubType); };
  ForeignWriter other(domain.number(), "tfdude/directory", type(), partition, true);
  ForeignWriter arm(domain.number(), "tfdude/directory", type(), "arm", true);
  other.await_readers(1);
  arm.await_readers(1);
  wire::Page forged = fastdds::to_wire(Page{"arm", 0, 9, 9, {{"forged", ""}}});
  wire::Page page = fastdds::to_wire(Page{"arm", 1, 9, 9, {{"hand", ""}}});
  other.write(&forged);
  arm.write(&page);
  CHECK(reader.hears([](const auto& heard) { return heard.page("arm", 1, 9); }));
  CHECK_FALSE(reader.heard().page("arm", 0, 9));
  transport->stop();
}

TEST_CASE("a change that is sent to the topic of questions is rejected") {
  const testing::DomainLease domain;
  Counted owner(domain.number(), "owner", "a");
  ForeignWriter writer(domain.number(), "tfdude/request",
                       fastdds::edds::TypeSupport(new wire::RequestPubSubType), "owner");
  const auto replies = writer.read_replies();
  writer.await_readers(1);
  const Transform X{*Pose::create(Eigen::Quaterniond::Identity(), {1, 0, 0}), {}};
  wire::Request request =
      fastdds::to_wire(Request{1, "a_tip", UpdateRequest{{{"a_tip", X}}, {}}}, "owner");
  REQUIRE(eventually([&] {
    writer.write(&request);
    return replies->last().has_value();
  }));
  const Reply reply = *replies->last();
  const auto* error = std::get_if<Error>(&reply.body);
  REQUIRE(error != nullptr);
  CHECK(error->code == Errc::kNotPermitted);
  CHECK_FALSE(moved(owner.node, "a"));
}

TEST_CASE("joint positions of a plain DDS writer move the edges of their owner") {
  const testing::DomainLease domain;
  const auto counters = std::make_shared<FastDdsCounters>();
  const auto transport = [&](const char* partition) {
    return *make_fastdds_transport({domain.number(), TFDUDE_LOOPBACK_PROFILE, partition, counters});
  };
  auto arm = Node::open(transport("arm"), "arm",
                        {{"base", "", {}}, moved_by("fore", "base", revolute_named("elbow"))})
                 .value();
  const auto to_all = GENERATE(true, false);
  ForeignWriter writer(domain.number(), "tfdude/joint",
                       fastdds::edds::TypeSupport(new wire::JointsPubSubType),
                       to_all ? "*" : "arm");
  writer.await_readers(1);
  const auto sample = [](const char* name, double position, std::int64_t stamp) {
    wire::JointPosition joint;
    joint.id(name);
    joint.numbers({position, 1e-4});
    wire::Joints joints;
    joints.positions({joint});
    joints.stamp(stamp);
    return joints;
  };
  wire::Joints of_others = sample("knee", 1, -1);
  wire::Joints bad = sample("elbow", std::nan(""), -1);
  wire::Joints good = sample("elbow", 0.5, 1'700'000'000'000'000'000);
  std::uint64_t written = 0;
  for (wire::Joints* joints : {&of_others, &bad, &good}) {
    writer.write(joints);
    // The writer keeps only one sample, so the next one must not be written before this arrives.
    ++written;
    CHECK(eventually([&] { return counters->updates_arrived == written; }));
  }
  CHECK(eventually([&] { return arm.joints("arm").value().at(0).position == 0.5; }));
  const auto X = arm.lookup("base", "fore", Query{});
  REQUIRE(X);
  CHECK(nanoseconds(*X->stamp) == 1'700'000'000'000'000'000);
  CHECK(std::abs(X->covariance.of_specified().stddev()[5] - 0.01) < 1e-12);
  CHECK(counters->updates_passed == 2);
}

TEST_CASE("requests that are sent to all partitions reach only the owner of their frame") {
  const testing::DomainLease domain;
  Counted owner(domain.number(), "owner", "a");
  Counted other(domain.number(), "other", "b");
  ForeignWriter writer(domain.number(), "tfdude/request",
                       fastdds::edds::TypeSupport(new wire::RequestPubSubType), "*");
  writer.await_readers(2);
  constexpr std::uint32_t kRequests = 20;
  wire::Request request = fastdds::to_wire(Request{1, "a_tip", HistoryRequest{}}, "");
  request.addressee(0);  // whoever owns the frame
  for (std::uint32_t i = 1; i <= kRequests; ++i) {
    request.sequence_number(i);
    writer.write(&request);
  }
  CHECK(eventually([&] { return owner.counters->requests_arrived == kRequests; }));
  CHECK(eventually([&] { return other.counters->requests_arrived == kRequests; }));
  CHECK(owner.counters->requests_passed == kRequests);
  CHECK(other.counters->requests_passed == 0);
}

TEST_CASE("an error names the topic and QoS in which the profiles of two participants differ") {
  const testing::DomainLease domain;
  Counted owner(domain.number(), "owner", "a");
  const testing::TemporaryDirectory directory;
  // As the loopback profile, but updates are sent best effort.
  const std::string profile = directory.write("best_effort.xml", with_best_effort_updates());
  auto client = Client::open(*make_fastdds_transport({domain.number(), profile, "", nullptr}));
  REQUIRE(client);
  REQUIRE(eventually([&] { return client->lookup("a", "a_tip").has_value(); }));
  const auto sent = client->publish({{"a_tip", {}}});
  REQUIRE_FALSE(sent);
  CHECK(sent.error().code == Errc::kConfig);
  CHECK(sent.error().message ==
        "partition 'owner': topic tfdude/update, reliability: a writer offers BEST_EFFORT, but a "
        "reader requests RELIABLE. Use the same profile for all participants");
}

namespace {

struct Stranger {
  const char* topic;
  const char* type;
  bool keyed;
};

constexpr Stranger kStrangers[] = {
    {"tfdude/request", "tfdude::wire::Request", false},
    {"tfdude/change", "tfdude::wire::Request", false},
    {"tfdude/update", "tfdude::wire::Update", false},
    {"tfdude/joint", "tfdude::wire::Joints", false},
    {"tfdude/reply", "tfdude::wire::Reply", false},
    {"tfdude/directory", "tfdude::wire::Page", true},
    {"tfdude/presence", "tfdude::wire::Presence", true},
};

// Malformed samples: truncated, with wrong lengths, random bytes with and without a header.
std::vector<Bytes> malformed(testing::Random& random) {
  std::vector<Bytes> all;
  const auto good = testing::bytes_of<wire::UpdatePubSubType>(stranger_update("a_tip"));
  for (const std::size_t size : {1U, 4U, 7U, 8U, 40U, static_cast<unsigned>(good.size()) - 1U}) {
    all.emplace_back(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
  }
  for (const std::size_t length_at : {4U, 8U}) {
    for (const std::uint8_t byte : std::initializer_list<std::uint8_t>{0x7F, 0xFF}) {
      all.push_back(good);
      for (std::size_t i = 0; i < 4; ++i) all.back()[length_at + i] = byte;
    }
  }
  for (int i = 0; i < 50; ++i) {
    Bytes garbage(1 + random.index(600));
    for (auto& byte : garbage) byte = static_cast<std::uint8_t>(random.index(256));
    all.push_back(garbage);
    if (garbage.size() < 4) continue;
    for (const std::size_t zero : {0U, 2U, 3U}) garbage[zero] = 0;
    garbage[1] = 1;  // plain CDR, little endian
    all.push_back(garbage);
  }
  return all;
}

}  // namespace

TEST_CASE("malformed samples are counted and change nothing") {
  testing::Random random(20261121);
  INFO("seed " << random.seed());
  const testing::DomainLease domain;
  Counted owner(domain.number(), "owner", "a");
  Counted other(domain.number(), "other", "b");
  const auto samples = malformed(random);
  for (const Stranger& stranger : kStrangers) {
    INFO("topic " << stranger.topic);
    const bool durable = stranger.keyed;
    ForeignWriter writer(domain.number(), stranger.topic,
                         fastdds::edds::TypeSupport(new RawType(stranger.type, stranger.keyed)),
                         "*", durable);
    writer.await_readers(2);
    for (Bytes sample : samples) writer.write(&sample);
  }
  // Of all readers of each participant all counted something, and each answers as before.
  CHECK(eventually([&] { return owner.counters->malformed > 0 && other.counters->malformed > 0; }));
  CHECK(other.node.lookup("a", "a_tip"));
  REQUIRE(other.node.update("a_tip", {}));
  CHECK_FALSE(moved(owner.node, "a"));
  CHECK(other.node.frames().value().size() == 6);
  CHECK(other.node.partitions().value().size() == 2);
}

}  // namespace tfdude
