#include "tfdude/client/urdf.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <console_bridge/console.h>

#include "support/catch.hpp"

namespace {

using tfdude::Errc;
using tfdude::FrameSpec;
using tfdude::JointType;
using tfdude::UrdfPart;
using tfdude::testing::Approx;

// A robot whose elements begin in line 2.
std::string robot(const std::string& elements) {
  return "<robot name=\"r\">\n" + elements + "</robot>\n";
}

std::string link(const std::string& name) { return "<link name=\"" + name + "\"/>\n"; }

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& more = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/>" + more + "</joint>\n";
}

// Links a and b, the second moved by joint j, which is in line 4.
std::string pair(const std::string& type, const std::string& more = "") {
  return robot(link("a") + link("b") + joint("j", type, "a", "b", more));
}

std::string limits(const std::string& lower, const std::string& upper) {
  return "<limit lower=\"" + lower + "\" upper=\"" + upper + "\"/>";
}

// Three fingers of a hand: f2 mimics f1, f3 mimics f2; and one alone.
std::string hand() {
  const auto finger = [](int i, const std::string& more) {
    const std::string n = std::to_string(i);
    return link("l" + n) + joint("f" + n, "prismatic", "hand", "l" + n, limits("-1", "3") + more);
  };
  return robot(link("hand") + finger(1, "") +
               finger(2, "<mimic joint=\"f1\" multiplier=\"-2\" offset=\"0.5\"/>") +
               finger(3, "<mimic joint=\"f2\" multiplier=\"3\" offset=\"0.25\"/>") + finger(4, ""));
}

// base - turn - lift - tool, with a camera at lift.
std::string tree() {
  return robot(link("base") + link("turn") + link("lift") + link("tool") + link("camera") +
               joint("j1", "continuous", "base", "turn") +
               joint("j2", "prismatic", "turn", "lift", limits("0", "1")) +
               joint("j3", "fixed", "lift", "tool") + joint("j4", "floating", "lift", "camera"));
}

std::vector<FrameSpec> frames_of(const std::string& text, const UrdfPart& part = {"r.urdf"}) {
  const auto frames = tfdude::parse_urdf(text, part);
  INFO((frames ? "" : frames.error().message));
  REQUIRE(frames.has_value());
  return *frames;
}

std::string ids_of(const std::vector<FrameSpec>& frames) {
  std::string ids;
  for (const auto& frame : frames) ids += (ids.empty() ? "" : " ") + frame.id;
  return ids;
}

const FrameSpec& named(const std::vector<FrameSpec>& frames, const std::string& id) {
  for (const auto& frame : frames) {
    if (frame.id == id) return frame;
  }
  FAIL("no frame " << id);
  throw 0;
}

void refused(const std::string& text, const UrdfPart& part, const std::string& message,
             Errc code = Errc::kInvalidInput) {
  CAPTURE(text);
  const auto frames = tfdude::parse_urdf(text, part);
  REQUIRE_FALSE(frames.has_value());
  CHECK(frames.error().message == message);
  CHECK(to_string(frames.error().code) == to_string(code));
}

void refused(const std::string& text, const std::string& message, Errc code = Errc::kInvalidInput) {
  refused(text, {"r.urdf"}, message, code);
}

UrdfPart with_joint(const std::string& name, const tfdude::UrdfJoint& said) {
  UrdfPart part{"r.urdf"};
  part.joints[name] = said;
  return part;
}

UrdfPart with_links(const std::vector<std::string>& links) {
  UrdfPart part{"r.urdf"};
  part.links = links;
  return part;
}

}  // namespace

TEST_CASE("urdf: a URDF's links are frames, and its joints move them") {
  const auto frames = frames_of(tree());
  CHECK(ids_of(frames) == "base turn lift tool camera");
  CHECK(frames[0].parent.empty());
  CHECK_FALSE(frames[0].joint.has_value());
  CHECK(frames[1].parent == "base");
  REQUIRE(frames[1].joint.has_value());
  CHECK(frames[1].joint->name == "j1");
  CHECK(frames[1].joint->type == JointType::kContinuous);
  CHECK_FALSE(frames[1].joint->limits.has_value());
  CHECK(frames[1].joint->joint.S == (tfdude::Twist() << 0, 0, 0, 1, 0, 0).finished());
  CHECK(frames[2].joint->type == JointType::kPrismatic);
  CHECK(frames[2].joint->limits->upper == 1);
  CHECK(frames[2].joint->joint.S == (tfdude::Twist() << 1, 0, 0, 0, 0, 0).finished());
  CHECK_FALSE(frames[3].joint.has_value());
  CHECK(frames[3].parent == "lift");
  CHECK_FALSE(frames[4].joint.has_value());
  const auto plain = frames_of(pair("planar", "<origin xyz=\"1 2 3\"/><axis xyz=\"0 0 0\"/>"));
  CHECK_FALSE(plain[1].joint.has_value());
  CHECK(plain[1].X_PC.pose.translation() == Eigen::Vector3d(1, 2, 3));
}

TEST_CASE("urdf: what does not concern frames may be broken") {
  const std::string junk =
      "<inertial><mass value=\"heavy\"/><inertia ixx=\"\"/></inertial>"
      "<visual><geometry><mesh filename=\"nowhere.dae\" scale=\"big\"/></geometry>"
      "<material name=\"unheard_of\"/></visual><visual/><collision><geometry/></collision>";
  const auto frames = frames_of(
      "<?xml version=\"1.0\"?><!-- a comment --><robot version=\"7.x\" xmlns:xacro=\"x\">"
      "<material/><material name=\"m\"><color rgba=\"red\"/></material>"
      "<gazebo reference=\"a\"><joint name=\"j\"/><plugin/></gazebo><unheard_of of=\"x\"/>"
      "<link name=\"a\" kind=\"x\">" +
      junk + "</link><link name=\"b\">" + junk + "</link>" +
      joint("j", "revolute", "a", "b",
            "<limit lower=\"-1\" upper=\"1\" effort=\"strong\"/><dynamics/>"
            "<safety_controller/><calibration rising=\"x\"/><unheard_of/>") +
      "<transmission name=\"t\"><joint name=\"j\"/></transmission><sensor name=\"s\"/></robot>");
  CHECK(ids_of(frames) == "a b");
  CHECK(frames[1].joint->limits->lower == -1);
  // Of a continuous joint limits say nothing, of one that does not move nothing but its origin does.
  CHECK(frames_of(pair("continuous", "<limit effort=\"1\"/>"))[1].joint->limits == std::nullopt);
  CHECK(frames_of(pair("fixed", "<axis xyz=\"x\"/><limit lower=\"x\"/><mimic/>")).size() == 2);
}

TEST_CASE("urdf: an axis is made of unit length") {
  const auto axis_of = [](const std::string& xyz) {
    const auto frames = frames_of(pair("continuous", "<axis xyz=\"" + xyz + "\"/>"));
    return Eigen::Vector3d(frames[1].joint->joint.S.tail<3>());
  };
  CHECK((axis_of("0 3 4") - Eigen::Vector3d(0, 0.6, 0.8)).norm() < 1e-15);
  CHECK((axis_of("0 0 -1e-200") - Eigen::Vector3d(0, 0, -1)).norm() < 1e-15);
  CHECK((axis_of("1e300 0 1e300").norm() == Approx(1)));
  CHECK((axis_of("0\n\t0\n1") == Eigen::Vector3d(0, 0, 1)));
  refused(pair("continuous", "<axis xyz=\"0 0 0\"/>"),
          "r.urdf:4: joint 'j': axis: has no direction");
  refused(pair("continuous", "<axis/>"), "r.urdf:4: joint 'j': axis: has no direction");
}

TEST_CASE("urdf: what is no URDF is refused") {
  const auto bad = [](const std::string& text, const std::string& message) {
    refused(text, message, Errc::kConfig);
  };
  bad("", "r.urdf: is empty");
  bad(" \n ", "r.urdf: is empty");
  bad("robot", "r.urdf:1: not XML: parsing text");
  bad("<robot>\n<link name=\"a\">\n</robot>", "r.urdf:2: not XML: mismatched element");
  bad("<!-- nothing -->", "r.urdf: has no element <robot>");
  bad("\n<model/>", "r.urdf:2: not a URDF: <model> instead of <robot>");
  bad("<robot/>\n<robot/>", "r.urdf:2: not XML: <robot> after the end of <robot>");
  bad(std::string("<robot>\n\0</robot>", 17), "r.urdf:2: not XML: holds a zero byte");
  bad(robot("<link name=\"a\">\n<xacro:wheel/></link>"),
      "r.urdf:3: <xacro:wheel> is of xacro: run xacro first, and give what it makes of this file");
  bad(pair("rotary"), "r.urdf:4: joint 'j': Joint [j] has no known type [rotary]");
  bad(pair("revolute"),
      "r.urdf:4: joint 'j': Joint [j] is of type REVOLUTE but it does not specify limits");
  const auto bad_number = [&](const std::string& more, const std::string& start) {
    CAPTURE(more);
    const auto frames = tfdude::parse_urdf(pair("revolute", more), {"r.urdf"});
    REQUIRE_FALSE(frames.has_value());
    CHECK(frames.error().message.rfind("r.urdf:4: joint 'j': " + start, 0) == 0);
    CHECK(frames.error().code == Errc::kConfig);
  };
  bad_number(limits("nan", "1"), "lower value (nan) is not a");
  bad_number(limits("0", "inf"), "upper value (inf) is not a");
  bad_number(limits("0", "1e999"), "upper value (1e999) is not a");
  bad_number(limits("0", "1") + "<origin xyz=\"0 nan 0\"/>", "Unable to parse component [nan]");
  bad_number(limits("0", "1") + "<origin rpy=\"0 0 inf\"/>", "Unable to parse component [inf]");
  bad_number(limits("0", "1") + "<origin xyz=\"0 0\"/>", "Parser found 2 elements but 3 expected");
  bad_number(limits("0", "1") + "<axis xyz=\"0 nan 0\"/>", "Malformed axis element");
  bad_number(limits("0", "1") + "<mimic joint=\"j\" offset=\"x\"/>", "offset value (x) is not a");
}

TEST_CASE("urdf: links and joints that make no tree are refused") {
  refused(robot(""), "r.urdf:1: has no links");
  refused(robot("<link/>\n"), "r.urdf:2: a link has no name");
  refused(robot(link("a") + "<joint type=\"fixed\"/>\n"), "r.urdf:3: a joint has no name");
  refused(robot(link("a") + "<joint name=\"j\" type=\"fixed\"><child link=\"a\"/></joint>\n"),
          "r.urdf:3: joint 'j': has no <parent link=\"...\">");
  refused(robot(link("a") + "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/></joint>\n"),
          "r.urdf:3: joint 'j': has no <child link=\"...\">");
  refused(robot(link("a") + joint("j", "fixed", "x", "a")),
          "r.urdf:3: joint 'j': parent link 'x' is not there");
  refused(robot(link("a") + joint("j", "fixed", "a", "x")),
          "r.urdf:3: joint 'j': child link 'x' is not there");
  refused(robot(link("a") + link("a")),
          "r.urdf:3: link 'a': the name is taken by the link in line 2");
  refused(robot(link("a") + link("b") + link("c") + joint("j", "fixed", "a", "b") +
                joint("j", "fixed", "a", "c")),
          "r.urdf:6: joint 'j': the name is taken by the joint in line 5");
  refused(
      robot(link("a") + link("b") + joint("j", "fixed", "a", "b") + joint("k", "fixed", "a", "b")),
      "r.urdf:5: joint 'k': child link 'b' has a parent already, by joint 'j' in line 4");
  refused(robot(link("a") + link("b")),
          "r.urdf:3: link 'b' is a second root link, beside 'a' in line 2");
  refused(robot(link("a") + joint("j", "fixed", "a", "a")),
          "r.urdf:3: joint 'j': parent link 'a' is the child link itself or lies below it");
  refused(robot(link("r") + link("a") + link("b") + joint("j", "fixed", "a", "b") +
                joint("k", "fixed", "b", "a")),
          "r.urdf:6: joint 'k': parent link 'b' is the child link itself or lies below it");
  refused(pair("fixed", "<origin/><origin/>"), "r.urdf:4: joint 'j': <origin> is given twice");
  refused(pair("fixed", "<origin quat_xyzw=\"0 0 0 1\"/>"),
          "r.urdf:4: joint 'j': quat_xyzw is not known; give rpy");
}

TEST_CASE("urdf: values of joints that break their rules are refused") {
  refused(pair("fixed", "<origin xyz=\"0 2e9 0\"/>"),
          "r.urdf:4: joint 'j': origin: translation.y is beyond 1e9 m");
  refused(pair("revolute", limits("1", "-1")),
          "r.urdf:4: joint 'j': limits 1 and -1 are upside down");
  refused(pair("prismatic", limits("0", "2e9")),
          "r.urdf:4: joint 'j': limits 0 and 2e+09 are beyond 1e9");
  const std::string hinge = pair("revolute", limits("-1", "2"));
  refused(hinge, with_joint("j", {2.5, {}, {}}),
          "r.urdf:4: joint 'j': position 2.5 is outside its limits -1 and 2");
  refused(hinge, with_joint("j", {std::nan(""), {}, {}}),
          "r.urdf:4: joint 'j': position nan is beyond 1e9");
  refused(hinge, with_joint("j", {{}, -0.1, {}}),
          "r.urdf:4: joint 'j': stddev -0.1 is not within 0 and 1e9");
  refused(hinge, with_joint("b", {}), "r.urdf: joint 'b' is not there");
  refused(pair("fixed"), with_joint("j", {0.0, {}, {}}),
          "r.urdf:4: joint 'j': has no position: it does not move by one number");
  refused(hand(), with_joint("f2", {{}, 0.1, {}}),
          "r.urdf:6: joint 'f2': has no position of its own: it mimics 'f1'");
  refused(pair("prismatic", "<origin xyz=\"9e8 0 0\"/>" + limits("0", "9e8")),
          with_joint("j", {9e8, {}, {}}), "r.urdf:4: joint 'j': translation.x is beyond 1e9 m");
}

TEST_CASE("urdf: a joint's position before its first sample") {
  const auto at = [](const UrdfPart& part) {
    return *frames_of(pair("revolute", limits("1", "3")), part)[1].joint;
  };
  CHECK(at({"r.urdf"}).position == 1);
  CHECK(at({"r.urdf"}).variance == Approx(4.0 / 12 + 1));
  CHECK_FALSE(at({"r.urdf"}).strict);
  const auto said = at(with_joint("j", {2.5, 0.1, {}}));
  CHECK(said.position == 2.5);
  CHECK(said.variance == Approx(0.01));
  UrdfPart strict{"r.urdf"};
  strict.strict_limits = true;
  CHECK(at(strict).strict);

  tfdude::UrdfJoint mounted{2.0, 0.0, *tfdude::Covariance::from_stddev({1, 2, 3, 4, 5, 6})};
  const auto frame = frames_of(pair("revolute", limits("1", "3")), with_joint("j", mounted)).at(1);
  CHECK(frame.joint->joint.X_PJ.covariance.stddev()[1] == Approx(2));
  const auto X_PC = tfdude::value_at(*frame.joint, 2.0, 0.0);
  CHECK(frame.X_PC.covariance.upper() == X_PC.covariance.upper());
  CHECK(frame.X_PC.pose.matrix() == X_PC.pose.matrix());
  mounted.position.reset();
  mounted.stddev.reset();
  CHECK(frames_of(pair("fixed"), with_joint("j", mounted))[1].X_PC.covariance.stddev()[5] ==
        Approx(6));
}

TEST_CASE("urdf: joints that mimic follow the last of their chain") {
  UrdfPart part = with_joint("f1", {0.25, 0.1, {}});
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
  CHECK(second.variance == Approx(4 * 0.01));
  const auto& third = *named(frames, "p_l3").joint;
  CHECK(third.coupled);
  CHECK(third.name == "p_f3");
  CHECK(third.mimic->joint == "p_f1");
  CHECK(third.mimic->multiplier == -6);
  CHECK(third.mimic->offset == Approx(3 * 0.5 + 0.25));
  CHECK(third.position == Approx(-6 * 0.25 + 1.75));
  CHECK(third.variance == Approx(36 * 0.01));
  // The errors of coupled joints are shares, and no part of the edges' own covariance.
  CHECK(named(frames, "p_l3").X_PC.covariance.upper() == tfdude::Covariance().upper());
  CHECK(named(frames, "p_l4").X_PC.covariance.upper()[0] > 0);
  CHECK(named(frames, "p_l3").correlation.empty());

  // Also where the other one is outside the part.
  part.links = {"l3"};
  const auto alone = frames_of(hand(), part);
  REQUIRE(alone.size() == 1);
  CHECK(alone[0].joint->mimic->joint == "p_f1");
  CHECK(alone[0].joint->position == third.position);
  CHECK(frames_of(hand(), with_links({"l1"}))[0].joint->coupled);
}

TEST_CASE("urdf: what cannot be mimicked is refused") {
  const auto mimic = [](const std::string& type, const std::string& other,
                        const std::string& more = "") {
    return robot(
        link("a") + link("b") + link("c") + link("d") +
        joint("j", "continuous", "a", "b", "<mimic joint=\"" + other + "\"" + more + "/>") +
        joint("k", type, "b", "c", "<mimic joint=\"l\"/>") +
        joint("l", "continuous", "c", "d", "<mimic joint=\"k\"/>"));
  };
  refused(mimic("fixed", "x"), "r.urdf:6: joint 'j': mimics 'x', which is not there");
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

TEST_CASE("urdf: a prefix stands before the names of links and joints") {
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

TEST_CASE("urdf: the root link hangs where it is said to hang") {
  UrdfPart part{"r.urdf"};
  part.root = "world";
  part.prefix = "p_";
  part.X_root = {*tfdude::Pose::create(Eigen::Quaterniond::Identity(), {1, 2, 3}),
                 *tfdude::Covariance::from_stddev({1, 1, 1, 1, 1, 1})};
  const auto frames = frames_of(tree(), part);
  CHECK(frames[0].parent == "world");
  CHECK(frames[0].X_PC.pose.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(frames[0].X_PC.covariance.upper()[0] == 1);
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

TEST_CASE("urdf: a part of the links is taken") {
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
  bad({"x"}, "'x': link 'x' is not there");
  bad({""}, "'': link '' is not there");
  bad({"base.."}, "'base..': link '' is not there");
  bad({"base..x"}, "'base..x': link 'x' is not there");
  bad({"lift..base"}, "'lift..base': link 'base' is not below 'lift', or below another end");
  bad({"base..lift..tool"},
      "'base..lift..tool': link 'tool' is not below 'base', or below another end");
  bad({"base..lift", "turn"}, "'turn': link 'turn' belongs to 'base..lift', too");
  // A link may be named like anything.
  CHECK(ids_of(frames_of(robot(link("a..b")), with_links({"a..b"}))) == "a..b");
}

TEST_CASE("urdf: files that cannot be read are refused") {
  const auto message = [](const std::string& path) {
    const auto frames = tfdude::load_urdf({path});
    REQUIRE_FALSE(frames.has_value());
    CHECK(frames.error().code == Errc::kConfig);
    return frames.error().message;
  };
  CHECK(message("/nowhere/r.urdf") ==
        "/nowhere/r.urdf: cannot be opened: No such file or directory");
  CHECK(message("/tmp") == "/tmp: is a directory");
  CHECK(message("/dev/null") == "/dev/null: is empty");
  CHECK(message("/dev/zero") == "/dev/zero: is longer than 64 MiB");
}

TEST_CASE("urdf: a chain of many links is no deep recursion") {
  std::string text;
  constexpr int kLinks = 100000;
  for (int i = 0; i < kLinks; ++i) {
    const std::string n = std::to_string(kLinks + i);
    text += link("l" + n);
    if (i > 0) {
      text += joint("j" + n, "continuous", "l" + std::to_string(kLinks + i - 1), "l" + n,
                    i > 1 ? "<mimic joint=\"j" + std::to_string(kLinks + i - 1) + "\"/>" : "");
    }
  }
  CHECK(frames_of(robot(text)).size() == kLinks);
}

TEST_CASE("urdf: the process's output of console_bridge is given back") {
  class Silent final : public console_bridge::OutputHandler {
   public:
    void log(const std::string&, console_bridge::LogLevel, const char*, int) override {}
  } silent;
  auto* before = console_bridge::getOutputHandler();
  console_bridge::useOutputHandler(&silent);
  CHECK_FALSE(tfdude::parse_urdf(pair("rotary"), {"r.urdf"}).has_value());
  CHECK(console_bridge::getOutputHandler() == &silent);
  console_bridge::useOutputHandler(before);
}
