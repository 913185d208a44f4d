// The robot description that an owner passes on, over each transport.

#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::Join;
using testing::joined_by;
using testing::outcome;

Node serving(const Join& join, const std::string& description) {
  NodeOptions options;
  options.description = description;
  return Node::open(join("arm"), "arm", {{"base", "", {}}}, options).value();
}

// No two parts of it are equal.
std::string long_text() {
  std::string text = "<robot>";
  for (int i = 0; text.size() < 400'000; ++i) text += "<link name=\"" + std::to_string(i) + "\"/>";
  return text + "</robot>";
}

TEST_CASE("description: others and the owner itself have the whole text") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const std::string text = GENERATE(std::string("<robot/>"), std::string(32768, '<'), long_text());
  Node arm = serving(join, text);
  Client client = Client::open(join("")).value();
  CHECK(client.description("arm").value() == text);
  CHECK(arm.description("arm").value() == text);
  CHECK(outcome(client.description("leg")) == "unknown_partition");
}

TEST_CASE("description: the next process of a partition may have another one, or none") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Client client = Client::open(join("")).value();
  for (const char* text : {"<robot name='a'/>", "", "<robot name='b'/>"}) {
    const Node arm = serving(join, text);
    CHECK(eventually([&] {
      const auto now = client.description("arm");
      return now && *now == text;
    }));
  }
}

}  // namespace
}  // namespace tfdude
