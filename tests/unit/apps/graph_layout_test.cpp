// Which frames the picture of a forest shows, and how they are put together.

#include "tfdude/drawing/graph_layout.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

using Ids = std::vector<std::string>;

struct Forest {
  void add(const std::string& id, const std::string& parent = "") {
    frames.push_back({id, parent, "p", !parent.empty()});
  }
  /// Frames "ID_0", "ID_1"... each below the one before. @return the last one's id
  std::string chain(const std::string& id, std::string parent, int length) {
    for (int i = 0; i < length; ++i) {
      const std::string next = id + "_" + std::to_string(i);
      add(next, parent);
      parent = next;
    }
    return parent;
  }
  std::vector<Frame> frames;
};

GraphMeasures measures() {
  return {12, [](const Frame& frame) { return 5.0 * static_cast<double>(frame.id.size()); }, 8, 24};
}

std::vector<GraphBox> boxes(const Forest& forest, const GraphScope& scope = {}) {
  return boxes_of(forest.frames, scope, measures());
}

Ids ids(const GraphBox& box) {
  Ids ids;
  for (const GraphRow& row : box.rows) {
    ids.push_back((row.place == GraphRow::Place::kLeaf ? "*" : "") + row.frame->id);
  }
  return ids;
}

std::size_t shown(const std::vector<GraphBox>& boxes) {
  std::size_t count = 0;
  for (const GraphBox& box : boxes) count += box.rows.size();
  return count;
}

std::size_t folded(const std::vector<GraphBox>& boxes) {
  std::size_t count = 0;
  for (const GraphBox& box : boxes) count += box.folded;
  return count;
}

}  // namespace

TEST_CASE("graph: a chain is one box, with its leaves") {
  Forest forest;
  forest.add("world");
  forest.add("base", "world");
  forest.add("imu", "base");
  forest.add("lidar", "base");
  forest.add("mast", "base");
  forest.add("camera", "mast");
  forest.add("optical", "camera");
  const auto drawn = boxes(forest);
  REQUIRE(drawn.size() == 1);
  CHECK(ids(drawn[0]) == Ids{"world", "base", "*imu", "*lidar", "mast", "camera", "optical"});
  CHECK(drawn[0].last().id == "optical");
}

TEST_CASE("graph: a box ends where more than one branch begins") {
  Forest forest;
  forest.add("base");
  forest.add("imu", "base");
  const std::string left = forest.chain("left", "base", 2);
  forest.chain("right", "base", 2);
  forest.add("left_a", left);
  forest.add("left_b", left);
  const auto drawn = boxes(forest);
  REQUIRE(drawn.size() == 3);
  CHECK(ids(drawn[0]) == Ids{"base", "*imu"});
  CHECK(drawn[0].last().id == "base");
  CHECK(drawn[0].below == std::vector<std::size_t>{1, 2});
  CHECK(ids(drawn[1]) == Ids{"left_0", "left_1", "*left_a", "*left_b"});
  CHECK(drawn[1].above == std::size_t{0});
  CHECK(drawn[1].level == 1);
  CHECK(ids(drawn[2]) == Ids{"right_0", "right_1"});
}

TEST_CASE("graph: a root and a depth choose what is drawn") {
  Forest forest;
  forest.add("base");
  forest.chain("left", "base", 5);
  forest.chain("right", "base", 5);
  const auto branch = boxes(forest, {"left_1", {}});
  REQUIRE(branch.size() == 1);
  CHECK(ids(branch[0]) == Ids{"left_1", "left_2", "left_3", "left_4"});
  const auto shallow = boxes(forest, {"", 2});
  REQUIRE(shallow.size() == 3);
  CHECK(ids(shallow[1]) == Ids{"left_0", "left_1"});
  CHECK(shallow[1].folded == 3);
  const auto root = boxes(forest, {"", 0});
  REQUIRE(root.size() == 1);
  CHECK(root[0].folded == 10);
}

TEST_CASE("graph: levels are left out until the picture fits a screen") {
  Forest forest;
  forest.add("base");
  for (int i = 0; i < 12; ++i) {
    const std::string arm = forest.chain("arm" + std::to_string(i), "base", 2);
    for (int j = 0; j < 5; ++j) {
      forest.chain("finger" + std::to_string(i) + std::to_string(j), arm, 3);
    }
  }
  const auto drawn = boxes(forest);
  CHECK(drawn.size() == 13);
  CHECK(drawn[1].folded == 15);
  CHECK(shown(drawn) + folded(drawn) == forest.frames.size());
  // All of it on request.
  const auto all = boxes(forest, {"", 100});
  CHECK(shown(all) == forest.frames.size());
  CHECK(folded(all) == 0);
}

TEST_CASE("graph: rows are left out if one box is too high") {
  Forest forest;
  forest.add("base");
  for (int i = 0; i < 1000; ++i) forest.add("f" + std::to_string(i), "base");
  const auto drawn = boxes(forest);
  REQUIRE(drawn.size() == 1);
  CHECK(drawn[0].rows.size() > 50);
  CHECK(static_cast<double>(drawn[0].rows.size()) * 12 < kScreenHeight);
  CHECK(shown(drawn) + folded(drawn) == forest.frames.size());
}

TEST_CASE("graph: an empty forest has no boxes") { CHECK(boxes({}).empty()); }

}  // namespace tfdude::cli
