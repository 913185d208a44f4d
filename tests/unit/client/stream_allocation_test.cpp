// Sending from a real-time thread allocates nothing, down to the transport.

#include <memory>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/allocation_guard.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/relay.hpp"
#include "transport/port.hpp"

namespace tfdude {
namespace {

using testing::AllocationGuard;
using testing::along_x;
using testing::moved_by;
using testing::Relay;
using testing::revolute_named;

// Counts messages in place of the transport.
struct Port {
  int sent = 0;
  bool takes = true;
};

template <class Message>
class PortChannel final : public Channel<Message> {
 public:
  explicit PortChannel(Port& port) : port_(port) {}
  std::optional<Errc> try_send(const Message&) override {
    port_.sent += port_.takes ? 1 : 0;
    return port_.takes ? std::nullopt : std::optional<Errc>(Errc::kTimeout);
  }

 private:
  Port& port_;
};

class PortTransport final : public Relay {
 public:
  PortTransport(TransportPtr real, Port& port) : Relay(std::move(real)), port_(port) {}
  std::unique_ptr<Channel<Update>> update_channel(const std::string&) override {
    return std::make_unique<PortChannel<Update>>(port_);
  }
  std::unique_ptr<Channel<JointUpdate>> joint_channel(const std::string&) override {
    return std::make_unique<PortChannel<JointUpdate>>(port_);
  }

 private:
  Port& port_;
};

// Longer than what a std::string stores without allocation.
std::string long_name(const std::string& kind, int i) {
  return "the " + kind + " with quite a long name, number " + std::to_string(i);
}

std::vector<FrameSpec> frames_of(const std::string& partition) {
  const std::string root = long_name(partition + " root", 0);
  std::vector<FrameSpec> frames{{root, "", {}}};
  for (int i = 0; i < 6; ++i) {
    frames.push_back({long_name(partition + " frame", i), root, {}});
    frames.push_back(moved_by(long_name(partition + " link", i), root,
                              revolute_named(long_name(partition + " joint", i))));
  }
  return frames;
}

}  // namespace

TEST_CASE("try_publish does not allocate before the transport whatever its result") {
  LoopbackNetwork network;
  Port port;
  Node far = *Node::open(network.join(), "far", frames_of("far"));
  Node near =
      *Node::open(std::make_unique<PortTransport>(network.join(), port), "near", frames_of("near"));
  const bool own = GENERATE(false, true);
  const bool takes = GENERATE(true, false);
  const bool known = GENERATE(true, false);
  port.takes = takes;
  INFO("own " << own << ", takes " << takes << ", all known " << known);
  std::vector<std::string> edges;
  std::vector<std::string> joints;
  for (int i = 0; i < 6; ++i) {
    edges.push_back(long_name("far frame", i));
    joints.push_back(long_name("far joint", i));
    if (!own) continue;
    edges.push_back(long_name("near frame", i));
    joints.push_back(long_name("near joint", i));
  }
  if (!known) {
    edges.push_back(long_name("nobody's frame", 0));
    joints.push_back(long_name("nobody's joint", 0));
  }
  auto edge_stream = *near.stream(edges);
  auto joint_stream = *near.stream_joints(joints);
  const std::vector<Transform> values(edges.size(), along_x(1));
  const std::vector<double> positions(joints.size(), 0.5);
  const std::vector<double> variances(joints.size(), 1e-6);
  const std::size_t missing = (takes ? 0U : 6U) + (known ? 0U : 1U);
  std::size_t wrong = 0;
  const auto send = [&] {
    if (edge_stream.try_publish(values).size() != missing) ++wrong;
    if (joint_stream.try_publish(positions, variances).size() != missing) ++wrong;
  };
  const auto allocations_of_batch = [&] {
    const AllocationGuard guard;
    for (int i = 0; i < 500; ++i) send();
    return guard.allocations();
  };
  allocations_of_batch();  // makes what the next ones reuse
  const int before = port.sent;
  int batches = 1;
  auto allocations = allocations_of_batch();
  // A forest gets more memory if a reader, such as a thread of the library, is interrupted for
  // longer than ever before while it reads. So one batch of own edges must be free of it.
  for (; own && allocations != 0 && batches < 10; ++batches) allocations = allocations_of_batch();
  CHECK(allocations == 0);
  CHECK(wrong == 0);
  CHECK(port.sent - before == (takes ? 1000 * batches : 0));
}

TEST_CASE("try_publish does not allocate for an invalid value or after its client has ended") {
  LoopbackNetwork network;
  Node far = *Node::open(network.join(), "far", frames_of("far"));
  auto client = std::make_unique<Client>(*Client::open(network.join()));
  auto stream = *client->stream_joints({long_name("far joint", 0)});
  const auto refused = [&](double variance, Errc why) {
    const std::vector<double> positions{0};
    const std::vector<double> variances{variance};
    const AllocationGuard guard;
    const auto& not_sent = stream.try_publish(positions, variances);
    const auto allocations = guard.allocations();
    CHECK(allocations == 0);
    REQUIRE(not_sent.size() == 1);
    CHECK(not_sent.front().why == why);
  };
  refused(-1, Errc::kInvalidInput);
  client.reset();
  refused(0, Errc::kTransport);
}

}  // namespace tfdude
