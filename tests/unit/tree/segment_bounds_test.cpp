#include <chrono>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude {

using testing::along_x;
using testing::outcome;

// Once, one request of 4096 segments over 10,000 edges held an owner for a second.
TEST_CASE("segments: the edges of many segments are bounded") {
  constexpr int kDeep = 10'000;
  Forest forest;
  REQUIRE(forest.add("f0", "", along_x(0)));
  for (int i = 1; i <= kDeep; ++i) {
    REQUIRE(forest.add("f" + std::to_string(i), "f" + std::to_string(i - 1), along_x(1)));
  }
  const std::string top = "f0";
  const std::string deep = "f" + std::to_string(kDeep);
  const auto start = std::chrono::steady_clock::now();
  CHECK(outcome(forest.lookup_segments(std::vector<PathEnds>(4096, {top, deep}), {}, {}, false)) ==
        "too_much");
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::milliseconds(200));
  // As many segments as a path of that length can have.
  std::vector<PathEnds> parts;
  for (int i = 2; i < 2 * 4096; i += 2) {
    parts.push_back({"f" + std::to_string(i - 2), "f" + std::to_string(i)});
  }
  CHECK(outcome(forest.lookup_segments(parts, {}, {}, false)) == "ok");
  CHECK(outcome(forest.lookup_segments({{top, deep}}, {}, {}, false)) == "ok");
}

}  // namespace tfdude
