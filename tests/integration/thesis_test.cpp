// The function tests of the thesis with daemons in processes of their own.

#include "support/thesis.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/description/config.hpp"

#include "support/agreement.hpp"
#include "support/catch.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::kArmsFile;
using testing::kRobotFile;
using testing::lookups_diff;
using testing::Oracle;
using testing::Process;
using testing::structure_diff;
using testing::transform_diff;

const Transform kX{exp((Twist() << 0.1, -0.2, 0.3, 0.4, 0.5, -0.6).finished()),
                   *Covariance::from_stddev({1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3})};
const Transform kY{exp((Twist() << -0.4, 0.1, 0.2, -0.7, 0.1, 0.9).finished()),
                   *Covariance::from_stddev({6e-3, 1e-3, 2e-3, 1e-3, 3e-3, 2e-3})};

// Which process calls: the owner of one of the partitions (the other is in a daemon), or a third
// process.
constexpr int kRobotCalls = 0;
constexpr int kArmsCall = 1;
constexpr int kThirdCalls = 2;

struct Robot {
  explicit Robot(int who) {
    if (who != kRobotCalls) robot.emplace(domain.serve(kRobotFile));
    if (who != kArmsCall) arms.emplace(domain.serve(kArmsFile));
    witness.emplace(Client::open(domain.options()).value());
    if (who == kThirdCalls) {
      third.emplace(Client::open(domain.options()).value());
    } else {
      const auto config = load_config(who == kRobotCalls ? kRobotFile : kArmsFile);
      owner.emplace(Node::open(config->partition, config->frames, domain.options()).value());
    }
    for (const std::string& file : {kRobotFile, kArmsFile}) {
      const auto config = load_config(file);
      for (const FrameSpec& frame : config->frames) oracle.add(frame.id, frame.parent, frame.X_PC);
    }
    REQUIRE(eventually([this] { return structure_diff(caller(), oracle).empty(); }));
  }

  Client& caller() { return owner ? *owner : *third; }

  /// The caller sees at once what it did, the other client soon.
  void check_agreement() {
    CHECK(structure_diff(caller(), oracle) == "");
    CHECK(lookups_diff(caller(), oracle) == "");
    CHECK(eventually([this] { return structure_diff(*witness, oracle).empty(); }));
    CHECK(lookups_diff(*witness, oracle) == "");
  }

  testing::TestDomain domain;
  std::optional<Process> robot;
  std::optional<Process> arms;
  std::optional<Client> witness;  // sees what others did
  std::optional<Node> owner;
  std::optional<Client> third;
  Oracle oracle;
};

/// A rejection has its own code, names what it is about, and leaves everything as it was.
void check_refused(Robot& r, const Result<void>& result, Errc code,
                   const std::vector<std::string>& names) {
  REQUIRE_FALSE(result);
  CHECK(result.error().code == code);
  for (const std::string& name : names) {
    CHECK_THAT(result.error().message, testing::ContainsSubstring("'" + name + "'"));
  }
  r.check_agreement();
}

}  // namespace

TEST_CASE("the oracle propagates an uncertain heading over a lever") {
  Oracle oracle;
  oracle.add("world", "", {});
  oracle.add("turret", "world", {Pose(), *Covariance::from_stddev({0, 0, 0, 0, 0, 0.1})});
  oracle.add("muzzle", "turret", {Pose::trusted({1, 0, 0, 0}, {2, 0, 0}), {}});
  const Matrix6d sigma = oracle.between("world", "muzzle").covariance.of_specified().matrix();
  CHECK(sigma(1, 1) == testing::Approx(0.04));  // 2 m times 0.1 rad, sideways
  CHECK(sigma(1, 5) == testing::Approx(0.02));
  CHECK(sigma(5, 5) == testing::Approx(0.01));
  CHECK(sigma(0, 0) == testing::Approx(0.0));
  // Seen from the muzzle, the turret's own place is sure but for the heading.
  CHECK(oracle.between("muzzle", "world").covariance.of_specified().matrix()(5, 5) ==
        testing::Approx(0.01));
  CHECK(oracle.between("muzzle", "world").pose.translation().x() == testing::Approx(-2.0));
}

TEST_CASE("processes: every ordered pair of frames is looked up from each process") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  CHECK(r.oracle.ids().size() == 9);
  r.check_agreement();
  // Both directions of one path, spelt out.
  const auto there = r.caller().lookup("world", "hand_left");
  const auto back = r.caller().lookup("hand_left", "world");
  REQUIRE((there && back));
  CHECK(transform_diff(*back, inverse(*there), 1e-9) == "");
}

TEST_CASE("processes: the command line looks up what the oracle computes") {
  Robot r(kThirdCalls);
  const std::vector<std::pair<std::string, std::string>> pairs = {
      {"world", "hand_left"}, {"hand_left", "camera"}, {"arm_2", "arm_right"}, {"world", "world"}};
  for (const auto& [a, b] : pairs) {
    const auto result = r.domain.cli({"--json", "lookup", a, b});
    REQUIRE(result.status == 0);
    const auto json = nlohmann::json::parse(result.out);
    const auto t = json.at("translation").get<std::vector<double>>();
    const auto q = json.at("rotation").get<std::vector<double>>();
    const auto rows = json.at("covariance").get<std::vector<std::array<double, 6>>>();
    REQUIRE(rows.size() == 6);
    const Eigen::Map<const Matrix6d> sigma(rows[0].data());  // symmetric: rows or columns
    const Transform X_AB{Pose::trusted({q.at(3), q[0], q[1], q[2]}, {t.at(0), t[1], t[2]}),
                         *Covariance::from_matrix(sigma)};
    CHECK(transform_diff(X_AB, r.oracle.between(a, b), 1e-9) == "");
  }
}

TEST_CASE("processes: frames are added from their owner's process and from others") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  REQUIRE(r.caller().add("tool", "camera", kX));
  REQUIRE(r.caller().add("hand", "arm_2", kY));
  r.oracle.add("tool", "camera", kX);
  r.oracle.add("hand", "arm_2", kY);
  r.check_agreement();
  CHECK(r.caller().path("camera", "tool").value().at(0).partition == "robot");
  CHECK(r.caller().path("arm_2", "hand").value().at(0).partition == "arms");
}

TEST_CASE("processes: a frame cannot be added below a parent that does not exist") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  check_refused(r, r.caller().add("tool", "missing", kX), Errc::kUnknownParent,
                {"tool", "missing"});
  check_refused(r, r.caller().add("camera", "arm_2", kX), Errc::kAlreadyExists, {"camera"});
  const auto result = r.domain.cli({"add", "tool", "--parent", "missing"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, testing::ContainsSubstring("'missing'"));
  r.check_agreement();
}

TEST_CASE("processes: a removal removes all frames below") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  REQUIRE(r.caller().remove("robot_2"));
  r.oracle.remove("robot_2");
  CHECK_FALSE(r.caller().exists("camera"));
  r.check_agreement();
  REQUIRE(r.caller().remove("arm_left"));
  r.oracle.remove("arm_left");
  CHECK_FALSE(r.caller().exists("hand_left"));
  r.check_agreement();
  check_refused(r, r.caller().remove("arm_left"), Errc::kUnknownFrame, {"arm_left"});
}

TEST_CASE("processes: a partition that lost all its frames continues and gets new ones") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  REQUIRE(r.caller().remove("robot_1"));
  r.oracle.remove("robot_1");
  CHECK(r.oracle.ids() == std::vector<std::string>{"world"});
  r.check_agreement();
  if (r.arms) CHECK(r.arms->runs());
  const auto partitions = r.caller().partitions().value();
  REQUIRE(partitions.size() == 2);
  CHECK(partitions[0].name == "arms");
  CHECK(partitions[0].reachable);
  CHECK(partitions[0].frames == 0);
  // Attached again, below the other partition's root and below itself.
  REQUIRE(r.caller().add("arm_1", "world", kX, "arms"));
  REQUIRE(r.caller().add("hand", "arm_1", kY));
  r.oracle.add("arm_1", "world", kX);
  r.oracle.add("hand", "arm_1", kY);
  r.check_agreement();
}

TEST_CASE("processes: unknown start, unknown end and no connection are three errors") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  const auto start = r.caller().lookup("nowhere", "camera");
  const auto end = r.caller().lookup("hand_left", "nowhere");
  REQUIRE_FALSE(start);
  REQUIRE_FALSE(end);
  CHECK(start.error().code == Errc::kUnknownStart);
  CHECK(end.error().code == Errc::kUnknownEnd);
  CHECK_THAT(start.error().message, testing::ContainsSubstring("'nowhere'"));
  CHECK_THAT(end.error().message, testing::ContainsSubstring("'nowhere'"));
  REQUIRE(r.caller().add("island", "", kX, "arms"));
  for (const char* other : {"world", "hand_left"}) {
    const auto apart = r.caller().lookup(other, "island");
    REQUIRE_FALSE(apart);
    CHECK(apart.error().code == Errc::kNotConnected);
    CHECK_THAT(apart.error().message, testing::ContainsSubstring("'island'"));
  }
}

TEST_CASE("processes: own, others' and connecting edges are updated") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  for (const char* id : {"robot_2", "hand_left", "arm_1"}) {
    REQUIRE(r.caller().update(id, kX));
    r.oracle.update(id, kX);
    r.check_agreement();
  }
  const auto handle = r.caller().find("arm_1");
  REQUIRE(handle);
  REQUIRE(r.caller().update(*handle, kY));
  r.oracle.update("arm_1", kY);
  REQUIRE(r.caller().update({{"robot_1", kX}, {"arm_left", kY}, {"camera", kY}}));
  r.oracle.update("robot_1", kX);
  r.oracle.update("arm_left", kY);
  r.oracle.update("camera", kY);
  r.check_agreement();
  check_refused(r, r.caller().update("nowhere", kX), Errc::kUnknownFrame, {"nowhere"});
  check_refused(r, r.caller().update({{"robot_1", kY}, {"nowhere", kX}}), Errc::kUnknownFrame,
                {"nowhere"});
}

TEST_CASE("processes: an owner can build at once on what another owner confirmed") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  for (int i = 0; i < 50; ++i) {
    REQUIRE(r.caller().add("tool", "camera", kX));
    REQUIRE(r.caller().add("tip", "tool", kX, "arms"));
    REQUIRE(r.caller().move("arm_2", "tool"));
    REQUIRE(r.caller().move("arm_2", "arm_1"));
    REQUIRE(r.caller().move("tool", "arm_2"));
    REQUIRE(r.caller().remove("tool"));
    REQUIRE(r.caller().add("tool", "arm_2", kX));
    REQUIRE(r.caller().remove("tool"));
  }
  r.check_agreement();
}

TEST_CASE("processes: published edges arrive at both owners") {
  const int who = GENERATE(0, 1, 2);
  Robot r(who);
  r.oracle.update("robot_1", kX);
  r.oracle.update("arm_1", kY);
  REQUIRE(eventually([&r] {
    return r.caller().publish({{"robot_1", kX}, {"arm_1", kY}}) &&
           lookups_diff(*r.witness, r.oracle).empty();
  }));
  r.check_agreement();
}

}  // namespace tfdude
