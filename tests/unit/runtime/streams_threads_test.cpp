// Streams that are sent from one thread while others change their owners: for ThreadSanitizer.

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "runtime/mailbox.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::eventually;
using testing::moved_by;
using testing::revolute_named;

std::vector<FrameSpec> frames_of(const std::string& name) {
  return {{name + "_base", "", {}},
          {name + "_tip", name + "_base", {}},
          moved_by(name + "_link", name + "_base", revolute_named(name + "_joint"))};
}

}  // namespace

TEST_CASE("mailbox: the reader gets the newest item and the writer gets all old ones back") {
  auto alive = std::make_shared<int>();
  {
    Mailbox<std::pair<int, std::shared_ptr<int>>> mailbox;
    CHECK(mailbox.newest() == nullptr);
    constexpr int kLast = 20'000;
    std::thread maker([&] {
      for (int i = 1; i <= kLast; ++i) {
        if (i % 3 == 0) mailbox.collect();
        mailbox.put({i, alive});
      }
    });
    int before = 0;
    bool newer = true;
    while (before < kLast) {
      const auto* letter = mailbox.newest();
      if (letter == nullptr) continue;
      newer = newer && letter->first >= before;
      before = letter->first;
    }
    maker.join();
    CHECK(newer);
    mailbox.collect();
    CHECK(alive.use_count() == 2);
  }
  CHECK(alive.use_count() == 1);
}

TEST_CASE("streams: two streams are sent while owners come and go and the client ends") {
  LoopbackNetwork network;
  Node a = *Node::open(network.join(), "a", frames_of("a"));
  std::optional<Client> client = *Client::open(network.join());
  auto edges = *client->stream({"a_tip", "b_tip", "c_tip"});
  auto joints = *client->stream_joints({"a_joint", "b_joint"});
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> sent{0};
  std::thread edge_loop([&] {
    const std::vector<Transform> values(3, along_x(1));
    while (!stop) sent += 3 - edges.try_publish(values).size();
  });
  std::thread joint_loop([&] {
    while (!stop) sent += 2 - joints.try_publish({0.5, 0.5}, {0, 0}).size();
  });
  for (int round = 0; round < 5; ++round) {
    Node b = *Node::open(network.join(), "b", frames_of("b"));
    CHECK(eventually([&] { return client->add("c_tip", "b_base", {}).has_value(); }));
    CHECK(eventually([&] { return testing::x_of(b.lookup("b_base", "c_tip")) == 1; }));
    CHECK(client->remove("c_tip"));
    CHECK(client->add("c_tip", "a_base", {}));
    CHECK(eventually([&] { return testing::x_of(a.lookup("a_base", "c_tip")) == 1; }));
    CHECK(client->remove("c_tip"));
  }
  client.reset();
  const std::uint64_t at_the_end = sent;
  stop = true;
  edge_loop.join();
  joint_loop.join();
  CHECK(at_the_end > 0);
  CHECK(edges.try_publish(std::vector<Transform>(3)).size() == 3);
}

}  // namespace tfdude
