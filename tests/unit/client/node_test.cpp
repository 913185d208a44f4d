#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"

namespace tfdude {

TEST_CASE("node: the name of its partition stays where it is as others appear") {
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

}  // namespace tfdude
