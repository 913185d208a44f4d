#include "tfdude/client/node.hpp"

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude {

TEST_CASE("node: the name of its partition keeps its address as others appear") {
  LoopbackNetwork network;
  const auto node = *Node::open(network.join(), "a_name_that_no_string_holds_in_place");
  const std::string& name = node.partition();
  const char* characters = name.data();
  std::vector<Node> others;
  for (int i = 0; i < 20; ++i) {
    others.push_back(*Node::open(network.join(), "other_" + std::to_string(i)));
  }
  REQUIRE(node.partition() == "a_name_that_no_string_holds_in_place");
  CHECK(&node.partition() == &name);
  CHECK(node.partition().data() == characters);
}

TEST_CASE("node: requests during the start are stored together with the configured frames") {
  const testing::TemporaryDirectory directory;
  NodeOptions options;
  options.state = directory.path();
  options.discovery = Milliseconds(0);
  std::vector<FrameSpec> frames{{"root", "", {}}};
  // Many, so that it takes a while to store them.
  for (int i = 0; i < 500; ++i) frames.push_back({"frame_" + std::to_string(i), "root", {}});
  LoopbackNetwork network;
  auto client = *Client::open(network.join());
  std::atomic<bool> stopping{false};
  std::string refused;
  std::thread asking([&] {
    while (!stopping) {
      const auto updated = client.update("frame_1", {});
      if (!updated && updated.error().code == Errc::kState) refused = updated.error().message;
    }
  });
  std::string failed;
  for (int i = 0; i < 20 && failed.empty(); ++i) {
    const auto node = Node::open(network.join(), "robot", frames, options);
    if (!node) failed = node.error().message;
  }
  stopping = true;
  asking.join();
  CHECK(failed == "");
  CHECK(refused == "");
}

}  // namespace tfdude
