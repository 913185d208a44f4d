#include <cmath>
#include <string>
#include <vector>

#include "tfdude/description/urdf.hpp"

#include "support/catch.hpp"
#include "support/urdf_text.hpp"

namespace {

using tfdude::FrameSpec;
using tfdude::UrdfPart;
using tfdude::testing::Approx;
using tfdude::testing::frames_of;
using tfdude::testing::hand;
using tfdude::testing::ids_of;
using tfdude::testing::joint;
using tfdude::testing::limits;
using tfdude::testing::link;
using tfdude::testing::refused;
using tfdude::testing::robot;
using tfdude::testing::tree;
using tfdude::testing::with_joint;
using tfdude::testing::with_links;

const FrameSpec& named(const std::vector<FrameSpec>& frames, const std::string& id) {
  for (const auto& frame : frames) {
    if (frame.id == id) return frame;
  }
  FAIL("no frame " << id);
  throw 0;
}

}  // namespace

TEST_CASE("urdf: a chain of mimic joints is resolved to its first joint") {
  UrdfPart part = with_joint("f1", {0.25, 0.1, {}});
  part.joints["f4"].stddev = 0.1;
  part.prefix = "p_";
  const auto frames = frames_of(hand(), part);
  const auto& first = *named(frames, "p_l1").joint;
  CHECK_FALSE(first.mimic.has_value());
  CHECK(first.coupled);
  CHECK_FALSE(named(frames, "p_l4").joint->coupled);
  const auto& second = *named(frames, "p_l2").joint;
  CHECK(second.mimic->joint == "p_f1");
  CHECK(second.mimic->multiplier == -2);
  CHECK(second.position == Approx(0.0).margin(1e-15));
  CHECK(*second.variance == Approx(4 * 0.01));
  const auto& third = *named(frames, "p_l3").joint;
  CHECK(third.coupled);
  CHECK(third.name == "p_f3");
  CHECK(third.mimic->joint == "p_f1");
  CHECK(third.mimic->multiplier == -6);
  CHECK(third.mimic->offset == Approx(3 * 0.5 + 0.25));
  CHECK(third.position == Approx(-6 * 0.25 + 1.75));
  CHECK(*third.variance == Approx(36 * 0.01));
  // The errors of coupled joints are common errors, and no part of the edges' own covariance.
  CHECK(named(frames, "p_l3").X_PC.covariance.of_specified().upper() ==
        tfdude::Covariance().upper());
  CHECK(named(frames, "p_l4").X_PC.covariance.of_specified().upper()[0] > 0);
  CHECK(named(frames, "p_l3").correlation.empty());

  // Also where the other one is outside the part.
  part.links = {"l3"};
  const auto alone = frames_of(hand(), part);
  REQUIRE(alone.size() == 1);
  CHECK(alone[0].joint->mimic->joint == "p_f1");
  CHECK(alone[0].joint->position == third.position);
  CHECK(frames_of(hand(), with_links({"l1"}))[0].joint->coupled);
}

TEST_CASE("urdf: a joint that mimics a continuous one goes the shorter way as it does") {
  const std::string text =
      robot(link("a") + link("b") + link("c") + link("d") + link("e") +
            joint("j", "continuous", "a", "b") +
            joint("k", "prismatic", "b", "c",
                  "<mimic joint=\"j\" multiplier=\"-0.5\"/><limit lower=\"-9\" upper=\"9\"/>") +
            joint("l", "continuous", "c", "d", "<mimic joint=\"k\" multiplier=\"3\"/>") +
            joint("m", "continuous", "d", "e", "<mimic joint=\"n\"/>") + link("f") +
            joint("n", "revolute", "e", "f", "<limit lower=\"-9\" upper=\"9\"/>"));
  const auto period = [&](const char* frame) {
    return period_of(*frames_of(text, with_links({frame}))[0].joint);
  };
  const double turn = 2 * std::acos(-1.0);
  CHECK(period("b..b") == Approx(turn));
  CHECK(period("c..c") == Approx(0.5 * turn));
  CHECK(period("d..d") == Approx(1.5 * turn));
  CHECK(period("e..e") == 0);
  CHECK(period("f") == 0);
}

TEST_CASE("urdf: an invalid mimic joint is rejected") {
  const auto mimic = [](const std::string& type, const std::string& other,
                        const std::string& more = "") {
    return robot(
        link("a") + link("b") + link("c") + link("d") +
        joint("j", "continuous", "a", "b", "<mimic joint=\"" + other + "\"" + more + "/>") +
        joint("k", type, "b", "c", "<mimic joint=\"l\"/>") +
        joint("l", "continuous", "c", "d", "<mimic joint=\"k\"/>"));
  };
  refused(mimic("fixed", "x"), "r.urdf:6: joint 'j': mimics 'x', which does not exist");
  refused(mimic("fixed", "j"), "r.urdf:6: joint 'j': mimics itself");
  refused(mimic("fixed", "k"),
          "r.urdf:6: joint 'j': mimics 'k', which does not move by one number");
  refused(mimic("continuous", "k"), "r.urdf:6: joint 'j': mimics in a circle");
  refused(mimic("continuous", "l"), "r.urdf:6: joint 'j': mimics in a circle");
  const std::string large =
      robot(link("a") + link("b") + link("c") + joint("j", "continuous", "a", "b") +
            joint("k", "continuous", "b", "c", "<mimic joint=\"j\" multiplier=\"1e10\"/>"));
  refused(large, "r.urdf:6: joint 'k': mimic: its multiplier or offset is beyond 1e9");
}

TEST_CASE("urdf: invalid mimic joints outside the part are ignored") {
  const std::string text =
      robot(link("a") + link("b") + link("c") + link("d") + joint("j", "continuous", "a", "b") +
            joint("k", "continuous", "b", "c", "<mimic joint=\"nothing\"/>") +
            joint("l", "continuous", "a", "d", "<mimic joint=\"k\"/>"));
  CHECK(ids_of(frames_of(text, with_links({"a..a"}))) == "a");
  CHECK(ids_of(frames_of(text, with_links({"b..b"}))) == "b");
  for (const char* part : {"b", "d"}) {
    const auto refused_part = tfdude::parse_urdf(text, with_links({part}));
    REQUIRE_FALSE(refused_part);
    CHECK_THAT(
        refused_part.error().message,
        tfdude::testing::ContainsSubstring("joint 'k': mimics 'nothing', which does not exist"));
  }
}

TEST_CASE("urdf: the prefix is added to the names of links and joints") {
  UrdfPart part{"r.urdf"};
  part.prefix = "left/";
  const auto frames = frames_of(tree(), part);
  CHECK(ids_of(frames) == "left/base left/turn left/lift left/tool left/camera");
  CHECK(frames[1].parent == "left/base");
  CHECK(frames[1].joint->name == "left/j1");
  part.prefix = std::string(250, 'x');
  const std::string start(40, 'x');
  refused(
      robot(link("abcdef")), part,
      "r.urdf:2: link 'abcdef': name '" + start + "'... has 256 bytes, at most 255 are allowed");
  refused(
      robot(link("a") + link("b") + joint("abcdef", "continuous", "a", "b")), part,
      "r.urdf:4: joint 'abcdef': name '" + start + "'... has 256 bytes, at most 255 are allowed");
  CHECK(frames_of(robot(link("abcde")), part).size() == 1);
}

TEST_CASE("urdf: names of links and joints may have spaces within them only") {
  const auto with_names = [](const std::string& link_name, const std::string& joint_name) {
    return robot(link("a") + link(link_name) +
                 joint(joint_name, "revolute", "a", link_name, limits("-1", "1")));
  };
  CHECK(ids_of(frames_of(with_names("left hand", "left wrist"))) == "a left hand");
  refused(with_names("hand ", "wrist"), "r.urdf:3: link 'hand ': name 'hand ' ends with a space");
  refused(with_names("hand", " wrist"),
          "r.urdf:4: joint ' wrist': name ' wrist' begins with a space");
}

TEST_CASE("urdf: the root link is attached to the given frame") {
  UrdfPart part{"r.urdf"};
  part.root = "world";
  part.prefix = "p_";
  part.X_root = {*tfdude::Pose::create(Eigen::Quaterniond::Identity(), {1, 2, 3}),
                 *tfdude::Covariance::from_stddev({1, 1, 1, 1, 1, 1})};
  const auto frames = frames_of(tree(), part);
  CHECK(frames[0].parent == "world");
  CHECK(frames[0].X_PC.pose.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(frames[0].X_PC.covariance.of_specified().upper()[0] == 1);
  part.links = {"turn"};
  refused(tree(), part,
          "r.urdf: root 'world' is given, but the part is without the root link 'base'");
  part.links = {"base..base"};
  CHECK(frames_of(tree(), part).size() == 1);
  part.root = "p_tool";
  refused(tree(), part, "r.urdf:5: link 'tool': is the root given");
  part.root = "a\nb";
  refused(tree(), part, "r.urdf: root 'a\\x0ab' holds a control character");
}

TEST_CASE("urdf: a part has only the selected links") {
  const auto of = [](const std::vector<std::string>& links) {
    return ids_of(frames_of(tree(), with_links(links)));
  };
  CHECK(of({"lift"}) == "lift tool camera");
  CHECK(of({"base..turn"}) == "base turn");
  CHECK(of({"turn..tool..camera"}) == "turn lift tool camera");
  CHECK(of({"tool", "base..turn"}) == "tool base turn");
  CHECK(frames_of(tree(), with_links({"lift"}))[0].parent == "turn");
  const auto bad = [](const std::vector<std::string>& links, const std::string& why) {
    refused(tree(), with_links(links), "r.urdf: links " + why);
  };
  bad({"x"}, "'x': link 'x' does not exist");
  bad({""}, "'': link '' does not exist");
  bad({"base.."}, "'base..': link '' does not exist");
  bad({"base..x"}, "'base..x': link 'x' does not exist");
  bad({"lift..base"}, "'lift..base': link 'base' is not below 'lift', or below another end");
  bad({"base..lift..tool"},
      "'base..lift..tool': link 'tool' is not below 'base', or below another end");
  bad({"base..lift", "turn"}, "'turn': link 'turn' belongs to 'base..lift', too");
  // A link may be named like anything.
  CHECK(ids_of(frames_of(robot(link("a..b")), with_links({"a..b"}))) == "a..b");
}
