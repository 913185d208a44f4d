#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "tfdude/description/urdf.hpp"

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/replica.hpp"
#include "support/sampling.hpp"

namespace {

using tfdude::FrameSpec;
using tfdude::Transform;
using tfdude::UrdfPart;
using tfdude::testing::Random;

constexpr double kPi = 3.14159265358979323846;

// A row of a table of Denavit-Hartenberg parameters: Rz(q) Tz(d) Tx(a) Rx(alpha).
struct DhRow {
  double a, d, alpha;
};
const std::vector<DhRow> kUr5e = {{0, 0.1625, kPi / 2}, {-0.425, 0, 0},        {-0.3922, 0, 0},
                                  {0, 0.1333, kPi / 2}, {0, 0.0997, -kPi / 2}, {0, 0.0996, 0}};
const std::vector<DhRow> kLwr = {{0, 0.3105, kPi / 2}, {0, 0, -kPi / 2},   {0, 0.4, -kPi / 2},
                                 {0, 0, kPi / 2},      {0, 0.39, kPi / 2}, {0, 0, -kPi / 2},
                                 {0, 0.078, 0}};
const std::vector<std::string> kUr5eJoints = {"shoulder_pan_joint", "shoulder_lift_joint",
                                              "elbow_joint",        "wrist_1_joint",
                                              "wrist_2_joint",      "wrist_3_joint"};

using Positions = std::map<std::string, double>;

Eigen::Isometry3d chain(const std::vector<DhRow>& rows, const std::vector<double>& q) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    X = X * Eigen::AngleAxisd(q[i], Eigen::Vector3d::UnitZ()) *
        Eigen::Translation3d(rows[i].a, 0, rows[i].d) *
        Eigen::AngleAxisd(rows[i].alpha, Eigen::Vector3d::UnitX());
  }
  return X;
}

std::vector<FrameSpec> load(const std::string& name, const std::vector<std::string>& links = {}) {
  UrdfPart part{TFDUDE_EXAMPLES "/robots/" + name};
  part.links = links;
  const auto frames = tfdude::load_urdf(part);
  INFO((frames ? "" : frames.error().message));
  REQUIRE(frames.has_value());
  return *frames;
}

const FrameSpec& frame(const std::vector<FrameSpec>& frames, const std::string& id) {
  for (const auto& one : frames) {
    if (one.id == id) return one;
  }
  FAIL("no frame " << id);
  throw 0;
}

// The edge where its joint, if it has one, is at its place of these; a joint that mimics where the
// other says.
Transform edge(const FrameSpec& spec, const Positions& q, double variance) {
  if (!spec.joint) return spec.X_PC;
  const auto& mimic = spec.joint->mimic;
  const double position =
      mimic ? mimic->multiplier * q.at(mimic->joint) + mimic->offset : q.at(spec.joint->name);
  return tfdude::value_at(*spec.joint, position, variance);
}

// X_AB, A being above B.
Transform path(const std::vector<FrameSpec>& frames, const std::string& a, const std::string& b,
               const Positions& q, double variance = 0) {
  std::vector<const FrameSpec*> way;
  for (std::string at = b; at != a; at = way.back()->parent) way.push_back(&frame(frames, at));
  Transform X;
  for (auto one = way.rbegin(); one != way.rend(); ++one) {
    X = tfdude::compose(X, edge(**one, q, variance));
  }
  return X;
}

Positions random_positions(const std::vector<FrameSpec>& frames, Random& random) {
  Positions q;
  for (const auto& one : frames) {
    if (!one.joint || one.joint->mimic) continue;
    const auto& limits = one.joint->limits;
    q[one.joint->name] =
        limits ? random.uniform(limits->lower, limits->upper) : random.uniform(-9, 9);
  }
  return q;
}

// "parent>child joint type lower upper" of each frame.
std::string described(const std::vector<FrameSpec>& frames) {
  std::ostringstream out;
  out.precision(4);
  for (const auto& one : frames) {
    out << one.parent << ">" << one.id;
    if (one.joint) {
      out << " " << one.joint->name << " " << to_string(one.joint->type);
      if (one.joint->limits) {
        out << " " << one.joint->limits->lower << " " << one.joint->limits->upper;
      }
      if (one.joint->mimic) out << " = " << one.joint->mimic->joint;
    }
    out << "\n";
  }
  return out.str();
}

double difference(const Transform& X, const Eigen::Isometry3d& Y) {
  return (X.pose.matrix() - Y.matrix()).cwiseAbs().maxCoeff();
}

Eigen::Isometry3d turn_z(double angle) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
}
Eigen::Isometry3d shift(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

}  // namespace

TEST_CASE("robots: the six-axis arm has all its joints") {
  CHECK(described(load("ur5e.urdf")) ==
        ">base_link\n"
        "base_link>shoulder_link shoulder_pan_joint revolute -6.283 6.283\n"
        "shoulder_link>upper_arm_link shoulder_lift_joint revolute -6.283 6.283\n"
        "upper_arm_link>forearm_link elbow_joint revolute -3.142 3.142\n"
        "forearm_link>wrist_1_link wrist_1_joint revolute -6.283 6.283\n"
        "wrist_1_link>wrist_2_link wrist_2_joint revolute -6.283 6.283\n"
        "wrist_2_link>wrist_3_link wrist_3_joint revolute -6.283 6.283\n"
        "wrist_3_link>tool0\n");
}

TEST_CASE("robots: the two-armed robot has all its joints") {
  std::string expected =
      ">base_link\n"
      "base_link>torso_lift_link torso_lift_joint prismatic 0 0.4\n"
      "torso_lift_link>torso_link torso_turn_joint continuous\n"
      "torso_link>head_pan_link head_pan_joint revolute -2.8 2.8\n"
      "head_pan_link>head_tilt_link head_tilt_joint revolute -0.6 1.3\n"
      "head_tilt_link>camera\n";
  for (const std::string side : {"left", "right"}) {
    const std::string arm = side + "_arm_";
    expected += "torso_link>" + arm + "0_link\n";
    for (int i = 1; i <= 7; ++i) {
      const std::string limit = i % 2 == 1 ? "2.967" : "2.094";
      const std::string n = std::to_string(i);
      expected += arm + std::to_string(i - 1) + "_link>" + arm + n + "_link " + arm + n +
                  "_joint revolute -" + limit + " " + limit + "\n";
    }
    const std::string finger = side + "_finger_";
    expected += arm + "7_link>" + side + "_hand\n";
    expected += side + "_hand>" + finger + "1 " + finger + "1_joint prismatic 0 0.05\n";
    expected += side + "_hand>" + finger + "2 " + finger + "2_joint prismatic -0.05 0 = " + finger +
                "1_joint\n";
  }
  CHECK(described(load("two_arms.urdf")) == expected);
}

TEST_CASE("robots: the six-axis arm has the poses of its table of parameters") {
  Random random(4711);
  INFO("seed " << random.seed());
  const auto arm = load("ur5e.urdf");
  const auto mobile = load("mobile_arm.urdf");
  const Eigen::Isometry3d X_BM = shift(0.1, 0, 0.42);
  for (int run = 0; run < 200; ++run) {
    const Positions q = random_positions(arm, random);
    std::vector<double> angles;
    for (const auto& name : kUr5eJoints) angles.push_back(q.at(name));
    const Eigen::Isometry3d X = chain(kUr5e, angles);
    REQUIRE(difference(path(arm, "base_link", "tool0", q), X) < 1e-14);
    REQUIRE(difference(path(mobile, "base_link", "tool0", q), X_BM * X) < 1e-14);
  }
}

TEST_CASE("robots: hands of the two-armed robot have the poses of lift and turn and table") {
  Random random(4712);
  INFO("seed " << random.seed());
  const auto robot = load("two_arms.urdf");
  for (int run = 0; run < 200; ++run) {
    const Positions q = random_positions(robot, random);
    const Eigen::Isometry3d X_BT =
        shift(-0.1, 0, 0.6 + q.at("torso_lift_joint")) * turn_z(q.at("torso_turn_joint"));
    for (const std::string side : {"left", "right"}) {
      const double sign = side == "left" ? 1 : -1;
      std::vector<double> angles;
      for (int i = 1; i <= 7; ++i) {
        angles.push_back(q.at(side + "_arm_" + std::to_string(i) + "_joint"));
      }
      const Eigen::Isometry3d X_BH = X_BT * shift(0.1, 0.15 * sign, 0.35) *
                                     Eigen::AngleAxisd(-sign * kPi / 4, Eigen::Vector3d::UnitX()) *
                                     chain(kLwr, angles);
      REQUIRE(difference(path(robot, "base_link", side + "_hand", q), X_BH) < 1e-13);
      const double opened = q.at(side + "_finger_1_joint");
      REQUIRE(difference(path(robot, side + "_hand", side + "_finger_1", q),
                         shift(0, 0.01 + opened, 0.12)) < 1e-15);
      REQUIRE(difference(path(robot, side + "_hand", side + "_finger_2", q),
                         shift(0, -0.01 - opened, 0.12)) < 1e-15);
    }
  }
}

TEST_CASE("robots: three revolute joints in a plane") {
  const auto robot = load("three_hinges.urdf");
  Random random(4713);
  INFO("seed " << random.seed());
  const Positions q = random_positions(robot, random);
  const double a = q.at("hinge_1");
  const double b = a + q.at("hinge_2");
  const double c = b + q.at("hinge_3");
  const Eigen::Vector3d tip = path(robot, "base", "tip", q).pose.translation();
  CHECK(tip.x() == tfdude::testing::Approx(1.8 * cos(a) + 1.5 * cos(b) + 1.2 * cos(c)));
  CHECK(tip.y() == tfdude::testing::Approx(1.8 * sin(a) + 1.5 * sin(b) + 1.2 * sin(c)));
  CHECK(tip.z() == 0);
}

TEST_CASE("robots: one degree in each joint moves the tip as in the figure") {
  const auto robot = load("three_hinges.urdf");
  const Positions q{{"hinge_1", -kPi / 2}, {"hinge_2", -kPi / 3}, {"hinge_3", -kPi / 4}};
  Positions off = q;
  for (auto& [name, position] : off) position += kPi / 180;
  const Eigen::Vector3d moved = path(robot, "base", "tip", off).pose.translation() -
                                path(robot, "base", "tip", q).pose.translation();
  CHECK(moved.x() == tfdude::testing::Approx(0.0437).margin(5e-5));
  CHECK(moved.y() == tfdude::testing::Approx(-0.1057).margin(5e-5));
}

// By way of an owner, whose fingers share the error of the joint that both follow.
TEST_CASE("robots: the covariance between coupled fingers is that of samples") {
  Random random(4715);
  INFO("seed " << random.seed());
  const auto robot = load("two_arms.urdf");
  tfdude::testing::Replica replica("robot");
  tfdude::Partition owner("robot", 1, replica.forest, replica.directory);
  REQUIRE(owner.load(robot, {}));
  constexpr double kSigma = 1e-3;
  constexpr int kSamples = 20000;
  const Positions q = random_positions(robot, random);
  tfdude::JointUpdate update;
  for (const auto& [name, position] : q) {
    update.joints.push_back({name, position, kSigma * kSigma});
  }
  REQUIRE(owner.apply(update));
  // Both fingers move by one number, away from each other.
  const auto X_12 = replica.forest.lookup("left_finger_1", "left_finger_2");
  REQUIRE(X_12.has_value());
  CHECK(X_12->covariance.of_specified().stddev()[1] == tfdude::testing::Approx(2 * kSigma));
  for (const auto& [a, b] :
       {std::pair("left_finger_1", "right_finger_2"), std::pair("right_finger_2", "left_hand")}) {
    CAPTURE(a, b);
    const auto X_AB = replica.forest.lookup(a, b);
    REQUIRE(X_AB.has_value());
    const std::string from = a;
    const std::string to = b;
    const auto pose = [&](const Positions& at) {
      return path(robot, "base_link", from, at).pose.inverse() *
             path(robot, "base_link", to, at).pose;
    };
    CHECK(tfdude::testing::pose_diff(X_AB->pose, pose(q), 1e-12) == "");
    const auto sample = [&] {
      Positions at = q;
      for (auto& [name, position] : at) position += kSigma * random.normal();
      return tfdude::log(X_AB->pose.inverse() * pose(at));
    };
    const auto sampled = tfdude::testing::second_moment(kSamples, sample);
    CHECK(tfdude::testing::moment_diff(sampled, X_AB->covariance.of_specified().matrix(), kSamples,
                                       1e-3) == "");
  }
}

TEST_CASE("robots: an arm's covariance is that of samples of its joints") {
  Random random(4714);
  INFO("seed " << random.seed());
  const auto arm = load("ur5e.urdf");
  constexpr double kSigma = 1e-3;
  constexpr int kSamples = 10000;
  for (int run = 0; run < 3; ++run) {
    const Positions q = random_positions(arm, random);
    const Transform X = path(arm, "base_link", "tool0", q, kSigma * kSigma);
    std::vector<double> at;
    for (const auto& name : kUr5eJoints) at.push_back(q.at(name));
    const Eigen::Isometry3d mean_inverse = chain(kUr5e, at).inverse();
    const auto sample = [&] {
      std::vector<double> angles = at;
      for (double& angle : angles) angle += kSigma * random.normal();
      const Eigen::Isometry3d off = mean_inverse * chain(kUr5e, angles);
      return tfdude::log(
          tfdude::Pose::trusted(Eigen::Quaterniond(off.linear()), off.translation()));
    };
    // Beside the standard errors: terms of second order in angles of up to some sigma.
    const auto sampled = tfdude::testing::second_moment(kSamples, sample);
    CHECK(
        tfdude::testing::moment_diff(sampled, X.covariance.of_specified().matrix(), kSamples, 1e-4)
            .empty());
  }
}

TEST_CASE("robots: the parts of a URDF together are the whole robot") {
  struct Split {
    std::string file;
    std::vector<std::vector<std::string>> parts;
  };
  const std::vector<Split> splits = {
      {"ur5e.urdf", {{"base_link..forearm_link"}, {"wrist_1_link"}}},
      {"mobile_arm.urdf", {{"base_link..arm_mount"}, {"shoulder_link..tool0"}, {"camera"}}},
      {"two_arms.urdf",
       {{"base_link..left_hand..right_arm_3_link"},
        {"right_arm_4_link", "left_finger_1"},
        {"left_finger_2"}}}};
  for (const auto& split : splits) {
    CAPTURE(split.file);
    const auto whole = load(split.file);
    std::size_t count = 0;
    for (const auto& links : split.parts) {
      for (const auto& one : load(split.file, links)) {
        CAPTURE(one.id);
        const auto& same = frame(whole, one.id);
        ++count;
        CHECK(one.parent == same.parent);
        CHECK(one.X_PC.pose.matrix() == same.X_PC.pose.matrix());
        CHECK(one.X_PC.covariance.of_specified().upper() ==
              same.X_PC.covariance.of_specified().upper());
        REQUIRE(one.joint.has_value() == same.joint.has_value());
        if (!one.joint) continue;
        CHECK(one.joint->coupled == same.joint->coupled);
        CHECK(one.joint->position == same.joint->position);
        CHECK(one.joint->variance == same.joint->variance);
        CHECK(one.joint->joint.S == same.joint->joint.S);
        CHECK(one.joint->mimic.has_value() == same.joint->mimic.has_value());
      }
    }
    CHECK(count == whole.size());
  }
}

TEST_CASE("robots: what is left of a part beside what others own can be written as links") {
  Random random(4701);
  INFO("seed " << random.seed());
  int rest_without_root = 0;
  for (int n = 0; n < 300; ++n) {
    const std::string name =
        std::vector<std::string>{"ur5e", "mobile_arm", "two_arms"}[random.index(3)];
    UrdfPart part{TFDUDE_EXAMPLES "/robots/" + name + ".urdf"};
    part.prefix = random.index(2) == 0 ? "" : "r1_";
    part.root = "world";
    // The second time it has links already.
    for (int round = 0; round < 2; ++round) {
      const auto before = tfdude::load_urdf(part).value();
      std::set<std::string> taken{"elsewhere"};
      std::vector<std::string> wanted;
      const std::size_t rate = 1 + random.index(6);
      for (const FrameSpec& one : before) {
        if (random.index(rate) == 0) {
          taken.insert(one.id);
        } else {
          wanted.push_back(one.id);
        }
      }
      const auto rest = tfdude::urdf_without(part, taken).value();
      REQUIRE(rest.has_value() == !wanted.empty());
      if (!rest) break;
      std::string entries;
      for (const std::string& entry : rest->links) entries += entry + " ";
      INFO(name << ", " << taken.size() - 1 << " taken: " << entries);
      std::vector<std::string> left;
      const auto loaded = tfdude::load_urdf(*rest).value();
      for (const FrameSpec& one : loaded) left.push_back(one.id);
      std::sort(left.begin(), left.end());
      std::sort(wanted.begin(), wanted.end());
      CHECK(left == wanted);
      rest_without_root += rest->root.empty() && !part.root.empty() ? 1 : 0;
      part = *rest;
    }
  }
  CHECK(rest_without_root > 20);
}
