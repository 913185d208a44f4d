// Names that were probably meant.

#include "tfdude/base/similar.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude {
namespace {

using Names = std::vector<std::string>;

}  // namespace

TEST_CASE("similar: insertions, deletions, replacements and swaps of neighbours count one each") {
  CHECK(edit_distance("", "") == 0);
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("kitten", "sitting") == 3);
  CHECK(edit_distance("gripper", "griper") == 1);
  CHECK(edit_distance("hand", "hnad") == 1);
  CHECK(edit_distance("ca", "abc") == 3);  // optimal string alignment
  CHECK(edit_distance("Hand", "hand") == 0);
}

TEST_CASE("similar: the nearest names come first, and none that is far") {
  const Names known = {"gripper_link", "gripper_left", "camera", "base_link", "arm/tool0"};
  CHECK(similar_names("griper_link", known).front() == "gripper_link");
  CHECK(similar_names("gripper", known) == Names{"gripper_left", "gripper_link"});
  CHECK(similar_names("tool0", known) == Names{"arm/tool0"});
  CHECK(similar_names("robot/camera", known) == Names{"camera"});
  CHECK(similar_names("BASE_LINK", known) == Names{"base_link"});
  CHECK(similar_names("wheel", known).empty());
  CHECK(similar_names("camera", {"camera"}).empty());
  CHECK(similar_names("ab1", {"ab2", "ab3", "ab4", "ab5"}).size() == 3);
}

}  // namespace tfdude
