// States that earlier versions have stored. Nothing of them may be lost.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/description/config.hpp"
#include "tfdude/transport/loopback.hpp"

#include "store/sqlite_store.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::Approx;
using testing::TemporaryDirectory;

const std::string kFixture = TFDUDE_FIXTURES "/format_2";
const std::string kFormat3 = TFDUDE_FIXTURES "/format_3";

// A copy of the state, where a Node of domain 0 looks for it.
std::string copy_into(const TemporaryDirectory& directory, const std::string& fixture = kFixture) {
  const std::string file = state_file(directory.path(), 0, "arms");
  std::filesystem::create_directories(std::filesystem::path(file).parent_path());
  std::filesystem::copy_file(fixture + "/arms.sqlite", file);
  return file;
}

std::vector<double> deviations(const Transform& X) {
  const auto covariance = X.covariance.of_specified().matrix();
  std::vector<double> all;
  for (int i = 0; i < 6; ++i) all.push_back(std::sqrt(covariance(i, i)));
  return all;
}

}  // namespace

TEST_CASE("a stored state of format 2 has all its content") {
  const TemporaryDirectory directory;
  const auto store = open_sqlite_store(copy_into(directory), "arms");
  REQUIRE(store);
  const auto state = (*store)->load();
  REQUIRE(state);
  std::vector<std::string> frames;
  for (const StoredFrame& frame : state->frames) frames.push_back(frame.id + "<" + frame.parent);
  CHECK(frames == std::vector<std::string>{"arm<", "bit<tool", "eye<hand", "finger<hand",
                                           "hand<arm", "r_base<arm", "r_hand<r_lower",
                                           "r_lower<r_upper", "r_tip<r_hand", "r_upper<r_base",
                                           "tool<hand"});
  std::vector<std::string> tombstones;
  for (const Tombstone& tombstone : state->tombstones) tombstones.push_back(tombstone.id);
  CHECK(testing::sorted(tombstones) == std::vector<std::string>{"gone", "lamp", "shade"});
  CHECK(state->configured.size() == 11);
  REQUIRE(state->joints.size() == 1);
  CHECK(state->joints[0].name == "r_hinge_2");
  CHECK(state->joints[0].position == 0.25);
  CHECK_FALSE(state->joints[0].type);
  CHECK(*state->joints[0].variance == Approx(0.003 * 0.003));
  for (const StoredFrame& frame : state->frames) CHECK(frame.X_PC.covariance.complete());
}

TEST_CASE("a node opens a state and a configuration of format 2 repeatedly") {
  const TemporaryDirectory directory;
  copy_into(directory);
  NodeOptions options;
  options.state = directory.path();
  options.discovery = Milliseconds(0);
  std::ifstream file(kFixture + "/arms.yaml");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  // A pose of a root is rejected since.
  const std::string pose = "xyz: [1, 0, 0], ";
  text.erase(text.find(pose), pose.size());
  const auto config = parse_config(text, kFixture + "/arms.yaml");
  REQUIRE(config);
  options.history = config->history;
  for (int round = 0; round < 2; ++round) {
    INFO("round " << round);
    LoopbackNetwork network;
    auto node = Node::open(network.join(), config->partition, config->frames, options);
    INFO((node ? "" : node.error().message));
    REQUIRE(node);
    CHECK(node->own_frames() == 11);
    CHECK(testing::x_of(node->lookup("arm", "hand")) == 20);
    const auto X_hand_tool = node->lookup("hand", "tool");
    REQUIRE(X_hand_tool);
    CHECK(X_hand_tool->pose.translation().z() == 100);
    const std::vector<double> said{0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
    for (std::size_t i = 0; i < said.size(); ++i) {
      CHECK(deviations(*X_hand_tool)[i] == Approx(said[i]));
    }
    CHECK(node->lookup("tool", "bit")->pose.translation().z() == 7);
    CHECK(node->lookup("hand", "eye")->pose.translation().z() == 4);
    CHECK(*node->parent("eye") == "hand");
    for (const char* gone : {"lamp", "shade", "gone"}) CHECK_FALSE(node->exists(gone));
    const auto joints = *node->joints("arms");
    const auto moved = std::find_if(joints.begin(), joints.end(), [](const JointInfo& joint) {
      return joint.name == "r_hinge_2";
    });
    REQUIRE(moved != joints.end());
    CHECK(moved->position == 0.25);
    CHECK(moved->measured);
  }
}

TEST_CASE("zeros of a state of format 3 stay exact until its entry is changed") {
  const TemporaryDirectory directory;
  const std::string file = copy_into(directory, kFormat3);
  NodeOptions options;
  options.state = directory.path();
  options.discovery = Milliseconds(0);
  auto config = load_config(kFormat3 + "/arms.yaml");
  REQUIRE(config);
  const auto check_hand = [&](const StatedCovariance& expected, double x) {
    LoopbackNetwork network;
    auto node = Node::open(network.join(), config->partition, config->frames, options);
    INFO((node ? "" : node.error().message));
    REQUIRE(node);
    const auto X = node->lookup("arm", "hand");
    REQUIRE(X);
    CHECK(X->covariance == expected);
    CHECK(X->pose.translation().x() == x);
    CHECK(deviations(*node->lookup("hand", "tool"))[2] == Approx(0.3));
  };
  for (int round = 0; round < 2; ++round) check_hand(StatedCovariance::exact(), 4);
  REQUIRE(config->frames[1].id == "hand");
  CHECK_FALSE(config->frames[1].X_PC.covariance.complete());  // the file says nothing
  config->frames[1].X_PC.covariance = StatedCovariance::exact();
  for (int round = 0; round < 2; ++round) check_hand(StatedCovariance::exact(), 1);
  config->frames[1].X_PC.covariance = StatedCovariance::unspecified();
  for (int round = 0; round < 2; ++round) check_hand(StatedCovariance::unspecified(), 1);
}

}  // namespace tfdude
