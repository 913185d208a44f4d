#include "tfdude/description/urdf.hpp"

#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include <console_bridge/console.h>

#include "support/catch.hpp"
#include "support/urdf_text.hpp"

namespace {

using tfdude::Errc;
using tfdude::JointType;
using tfdude::UrdfPart;
using tfdude::testing::Approx;
using tfdude::testing::frames_of;
using tfdude::testing::hand;
using tfdude::testing::ids_of;
using tfdude::testing::joint;
using tfdude::testing::limits;
using tfdude::testing::link;
using tfdude::testing::pair;
using tfdude::testing::refused;
using tfdude::testing::robot;
using tfdude::testing::tree;
using tfdude::testing::with_joint;

}  // namespace

TEST_CASE("urdf: links become frames and joints move them") {
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

// TinyXML compares each attribute with all before it.
TEST_CASE("urdf: an element with attributes without end is rejected at once") {
  std::string many = "<robot name=\"r\"><!-- a=b --><link";
  for (int i = 0; i < 300'000; ++i) many += " a" + std::to_string(i) + "='>'";
  const auto start = std::chrono::steady_clock::now();
  refused(many + " name=\"x\"/></robot>", "r.urdf:1: an element has more than 256 attributes",
          Errc::kTooMuch);
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(2));
  std::string comment = "<robot name=\"r\"><!-- ";
  for (int i = 0; i < 1000; ++i) comment += "a=b ";
  CHECK(ids_of(frames_of(comment + "--><link name=\"x\"/></robot>")) == "x");
}

// TinyXML ends a declaration at its end, whatever quotes are in it, and a comment not at its begin.
TEST_CASE("urdf: nothing before an element hides its attributes") {
  std::string many = "<robot name=\"r\"";
  for (int i = 0; i < 300; ++i) many += " a" + std::to_string(i) + "=\"\"";
  for (const std::string before : {"<!'>", "<?xml version=\"1.0\" '?>", "<!--'-->", "<!--> -->"}) {
    INFO(before);
    refused(before + many + "/>", "r.urdf:1: an element has more than 256 attributes",
            Errc::kTooMuch);
    CHECK(ids_of(frames_of(before + "<robot name=\"r\"><link name=\"x\"/></robot>")) == "x");
  }
}

TEST_CASE("urdf: tags without end are rejected at once") {
  std::string many = "<robot name=\"r\">\n";
  for (int i = 0; i < 2'000'000; ++i) many += "<a/>";
  const auto frames = tfdude::parse_urdf(many, {"r.urdf"});
  REQUIRE_FALSE(frames);
  CHECK(frames.error().message == "r.urdf:2: has more than 2000000 tags");
}

TEST_CASE("urdf: elements that do not concern frames are ignored") {
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
  // Limits of a continuous joint are ignored, and everything but the origin of a fixed one.
  CHECK(frames_of(pair("continuous", "<limit effort=\"1\"/>"))[1].joint->limits == std::nullopt);
  CHECK(frames_of(pair("fixed", "<axis xyz=\"x\"/><limit lower=\"x\"/><mimic/>")).size() == 2);
}

TEST_CASE("urdf: an axis is normalized") {
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

TEST_CASE("urdf: text that is not a URDF is rejected") {
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
      "r.urdf:3: <xacro:wheel> is a xacro element: run xacro first, and load its output");
  // What else of xacro is left, where it would become a name or a number.
  const std::string run = " is an expression of xacro: run xacro first, and load its output";
  for (const std::string word : {"${side}_wheel", "$(arg side)"}) {
    bad("<robot>\n<link name=\"" + word + "\"/></robot>", "r.urdf:2: '" + word + "'" + run);
    const std::string joint =
        "<link name=\"a\"/><link name=\"b\"/>\n<joint name=\"j\" type=\"fixed\">";
    bad("<robot>" + joint + "<parent link=\"" + word + "\"/><child link=\"b\"/></joint></robot>",
        "r.urdf:2: '" + word + "'" + run);
    bad("<robot>" + joint + "<origin rpy=\"0 0 " + word +
            "\"/><parent link=\"a\"/><child link=\"b\"/></joint></robot>",
        "r.urdf:2: '0 0 " + word + "'" + run);
  }
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
  bad_number(limits("0", "infinite"), "upper value (infinite) is not a");
  bad_number(limits("0", "1e999"), "upper value (1e999) is not a");
  bad_number(limits("0", "1") + "<origin xyz=\"0 nan 0\"/>", "Unable to parse component [nan]");
  bad_number(limits("0", "1") + "<origin rpy=\"0 0 inf\"/>", "Unable to parse component [inf]");
  bad_number(limits("0", "1") + "<origin xyz=\"0 0\"/>", "Parser found 2 elements but 3 expected");
  bad_number(limits("0", "1") + "<axis xyz=\"0 nan 0\"/>", "Malformed axis element");
  bad_number(limits("0", "1") + "<mimic joint=\"j\" offset=\"x\"/>", "offset value (x) is not a");
}

TEST_CASE("urdf: no text is used as a printf format") {
  const std::string format = "%n%s%1.5f";
  const auto number = [&](const std::string& name, const std::string& element) {
    refused(pair("revolute", element),
            "r.urdf:4: joint 'j': " + name + " is '" + format + "', which is no number");
  };
  number("rpy", "<origin rpy=\"" + format + "\"/>");
  number("xyz", "<origin xyz=\"" + format + "\"/>");
  number("xyz", "<axis xyz=\"" + format + "\"/>");
  number("lower", "<limit lower=\"" + format + "\"/>");
  number("multiplier", "<mimic joint=\"j\" multiplier=\"" + format + "\"/>");
  refused(pair(format), "r.urdf:4: joint 'j': Joint [j] has no known type [" + format + "]",
          Errc::kConfig);
  refused(pair("continuous", "<mimic joint=\"" + format + "\"/>"),
          "r.urdf:4: joint 'j': mimics '" + format + "', which does not exist");
  const std::string named = robot(link(format) + link("b") +
                                  joint(format, "continuous", format, "b", "<axis xyz=\"x\"/>"));
  CHECK_THAT(tfdude::parse_urdf(named, {"r.urdf"}).error().message,
             tfdude::testing::ContainsSubstring("Malformed axis element for joint [" + format));
}

TEST_CASE("urdf: links and joints that form no tree are rejected") {
  refused(robot(""), "r.urdf:1: has no links");
  refused(robot("<link/>\n"), "r.urdf:2: a link has no name");
  refused(robot(link("a") + "<joint type=\"fixed\"/>\n"), "r.urdf:3: a joint has no name");
  refused(robot(link("a") + "<joint name=\"j\" type=\"fixed\"><child link=\"a\"/></joint>\n"),
          "r.urdf:3: joint 'j': has no <parent link=\"...\">");
  refused(robot(link("a") + "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/></joint>\n"),
          "r.urdf:3: joint 'j': has no <child link=\"...\">");
  refused(robot(link("a") + joint("j", "fixed", "x", "a")),
          "r.urdf:3: joint 'j': parent link 'x' does not exist");
  refused(robot(link("a") + joint("j", "fixed", "a", "x")),
          "r.urdf:3: joint 'j': child link 'x' does not exist");
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
}

TEST_CASE("urdf: the rotation of an origin may be a quaternion") {
  const auto origin = [](const std::string& attributes) {
    return frames_of(pair("revolute", "<origin " + attributes + "/>" + limits("-1", "1")))[1].X_PC;
  };
  const auto turned = origin("xyz=\"1 2 3\" quat_xyzw=\" 0.5 -0.5 0.5\t0.5 \"").pose;
  CHECK(turned.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(turned.rotation().coeffs() == Eigen::Vector4d(0.5, -0.5, 0.5, 0.5));
  const auto same = origin("rpy=\"0 0 0.3\"").pose;
  const auto quaternion = origin("quat_xyzw=\"0 0 0.149438 0.988771\"").pose;
  CHECK(log(origin("xyz=\"+1 2 3\" quat_xyzw=\"+0.5 -0.5 +0.5 0.5\"").pose.inverse() * turned)
            .norm() < 1e-12);
  CHECK(same.rotation().angularDistance(quaternion.rotation()) < 1e-6);
  const auto fixed = frames_of(pair("fixed", "<origin quat_xyzw=\"1 0 0 0\"/>"))[1].X_PC.pose;
  CHECK(fixed.rotation().coeffs() == Eigen::Vector4d(1, 0, 0, 0));
  const std::string place = "r.urdf:4: joint 'j': ";
  refused(pair("fixed", "<origin rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\"/>"),
          place + "rpy and quat_xyzw are both given, one is enough");
  for (const std::string bad : {"", "0 0 1", "0 0 0 1 0", "0 0 0 one", "0 0 0 1%s", "nan 0 0 1"}) {
    refused(pair("fixed", "<origin quat_xyzw=\"" + bad + "\"/>"),
            place + "quat_xyzw is '" + bad + "', which is not four numbers");
  }
  refused(pair("fixed", "<origin quat_xyzw=\"0 0 0 2\"/>"),
          place + "origin: rotation has the norm 2, not that of a unit quaternion");
}

TEST_CASE("urdf: invalid values of joints are rejected") {
  refused(pair("fixed", "<origin xyz=\"0 2e9 0\"/>"),
          "r.urdf:4: joint 'j': origin: translation.y is beyond 1e9 m");
  refused(pair("revolute", limits("1", "-1")),
          "r.urdf:4: joint 'j': limits 1 and -1: the lower limit is above the upper one");
  refused(pair("prismatic", limits("2e9", "3e9")),
          "r.urdf:4: joint 'j': limits 2e+09 and 3e+09 are beyond 1e9");
  const std::string revolute = pair("revolute", limits("-1", "2"));
  refused(revolute, with_joint("j", {2.5, {}, {}}),
          "r.urdf:4: joint 'j': position 2.5 is outside its limits -1 and 2");
  refused(revolute, with_joint("j", {std::nan(""), {}, {}}),
          "r.urdf:4: joint 'j': position nan is beyond 1e9");
  refused(revolute, with_joint("j", {{}, -0.1, {}}),
          "r.urdf:4: joint 'j': stddev -0.1 is not within 0 and 1e9");
  refused(revolute, with_joint("b", {}), "r.urdf: joint 'b' does not exist");
  refused(pair("fixed"), with_joint("j", {0.0, {}, {}}),
          "r.urdf:4: joint 'j': has no position: it does not move by one number");
  refused(hand(), with_joint("f2", {{}, 0.1, {}}),
          "r.urdf:6: joint 'f2': has no position of its own: it mimics 'f1'");
  refused(pair("prismatic", "<origin xyz=\"9e8 0 0\"/>" + limits("0", "9e8")),
          with_joint("j", {9e8, {}, {}}), "r.urdf:4: joint 'j': translation.x is beyond 1e9 m");
}

TEST_CASE("urdf: a limit that no position can reach is ignored") {
  const auto joint = [](const std::string& lower, const std::string& upper) {
    return *frames_of(pair("revolute", limits(lower, upper)), {"r.urdf"}).back().joint;
  };
  const auto rotor = joint("-1e16", "1e16");
  CHECK_FALSE(rotor.limits.has_value());
  CHECK(rotor.position == 0);
  CHECK_FALSE(rotor.variance);
  const auto half = joint("0.5", "1e16");
  REQUIRE(half.limits.has_value());
  CHECK(half.limits->lower == 0.5);
  CHECK(half.limits->contain(1e9));
  CHECK(half.position == 0.5);
  CHECK_FALSE(half.variance);
}

TEST_CASE("urdf: an infinite limit is none") {
  const std::string type = GENERATE("revolute", "prismatic");
  CAPTURE(type);
  const auto joint = [&](const std::string& limit) {
    return *frames_of(pair(type, limit)).back().joint;
  };
  for (const std::string word : {"inf", "INF", "Infinity", " inf "}) {
    CAPTURE(word);
    CHECK_FALSE(joint(limits("-" + word.substr(word.find_first_not_of(' ')), word)).limits);
    CHECK(joint(limits("0.5", word)).limits->lower == 0.5);
    CHECK(joint(limits("0.5", word)).limits->contain(1e9));
  }
  CHECK_FALSE(joint(limits("-inf", "+inf")).variance);
  CHECK(joint(limits("-inf", "2")).limits->upper == 2);
  CHECK(joint(limits("-inf", "2")).limits->contain(-1e9));
  const std::string place = "r.urdf:4: joint 'j': ";
  refused(pair(type, limits("inf", "inf")),
          place + "lower is 'inf': no position is within the limits");
  refused(pair(type, limits("-inf", "-Inf")),
          place + "upper is '-Inf': no position is within the limits");
}

TEST_CASE("urdf: limits of effort and velocity alone leave the position free") {
  const std::string type = GENERATE("revolute", "prismatic");
  CAPTURE(type);
  const auto joint = [&](const std::string& limit) {
    return *frames_of(pair(type, limit), with_joint("j", {0.7, {}, {}})).back().joint;
  };
  CHECK_FALSE(joint("<limit effort=\"10\" velocity=\"1\"/>").limits);
  CHECK_FALSE(joint("<limit/>").limits);
  CHECK(joint("<limit effort=\"inf\"/>").position == 0.7);
  // URDF: a limit that is not given is zero.
  const auto one = joint("<limit upper=\"2\"/>");
  REQUIRE(one.limits);
  CHECK(one.limits->lower == 0);
  CHECK(one.limits->upper == 2);
}

TEST_CASE("urdf: a joint has its given or default position before its first sample") {
  const auto at = [](const UrdfPart& part) {
    return *frames_of(pair("revolute", limits("1", "3")), part)[1].joint;
  };
  CHECK(at({"r.urdf"}).position == 1);
  // Nobody has measured it, so nothing is claimed of its error.
  CHECK_FALSE(at({"r.urdf"}).variance);
  CHECK_FALSE(at({"r.urdf"}).strict);
  const auto said = at(with_joint("j", {2.5, 0.1, {}}));
  CHECK(said.position == 2.5);
  CHECK(*said.variance == Approx(0.01));
  UrdfPart strict{"r.urdf"};
  strict.strict_limits = true;
  CHECK(at(strict).strict);

  tfdude::UrdfJoint with_origin{2.0, 0.0, *tfdude::Covariance::from_stddev({1, 2, 3, 4, 5, 6})};
  const auto frame =
      frames_of(pair("revolute", limits("1", "3")), with_joint("j", with_origin)).at(1);
  CHECK(frame.joint->joint.X_PJ.covariance.of_specified().stddev()[1] == Approx(2));
  const auto X_PC = tfdude::value_at(*frame.joint, 2.0, 0.0);
  CHECK(frame.X_PC.covariance.of_specified().upper() == X_PC.covariance.of_specified().upper());
  CHECK(frame.X_PC.pose.matrix() == X_PC.pose.matrix());
  with_origin.position.reset();
  with_origin.stddev.reset();
  CHECK(frames_of(pair("fixed"), with_joint("j", with_origin))[1]
            .X_PC.covariance.of_specified()
            .stddev()[5] == Approx(6));
}

TEST_CASE(
    "urdf: an edge is unspecified until its joint has a sample, unless the position has a stddev") {
  const std::string type = GENERATE("revolute", "continuous", "prismatic");
  CAPTURE(type);
  const std::string one = pair(type, type == "continuous" ? "" : limits("1", "3"));
  UrdfPart exact{"r.urdf"};
  exact.fixed = tfdude::StatedCovariance::exact();
  CHECK_FALSE(frames_of(one, exact)[1].X_PC.covariance.complete());
  CHECK(frames_of(one, with_joint("j", {1.0, 0.1, {}}))[1].X_PC.covariance.complete());
  // So are those that mimic it.
  const auto fingers = frames_of(hand());
  for (std::size_t i = 1; i < 5; ++i) CHECK_FALSE(fingers[i].X_PC.covariance.complete());
}

TEST_CASE("urdf: files that cannot be read are rejected") {
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

TEST_CASE("urdf: a chain of many links causes no deep recursion") {
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

TEST_CASE("urdf: the output handler of console_bridge is restored") {
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
