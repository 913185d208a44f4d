// Uncertainty on the command line, with real daemons.

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/cli_json.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::Process;
using testing::TestDomain;
using Arguments = std::vector<std::string>;

// Three edges with an owner each. Two share a source, the third has unknown correlation.
class Robot {
 public:
  Robot() {
    for (const char* name : {"base", "arm", "tool"}) {
      daemons_.push_back(
          domain_.serve(std::string(TFDUDE_EXAMPLES "/uncertainty/") + name + ".yaml"));
    }
  }

  json answered(Arguments arguments, int status = 0) const {
    return testing::answered(domain_, std::move(arguments), status);
  }
  CliResult run(const Arguments& arguments) const { return domain_.cli(arguments); }

 private:
  TestDomain domain_;
  std::vector<Process> daemons_;
};

double stddev(const json& lookup, std::size_t axis) {
  return std::sqrt(lookup.at("covariance").at(axis).at(axis).get<double>());
}

const Arguments kSure = {"--stddev", "0.001", "0.001", "0.001", "0.001", "0.001", "0.001"};

Arguments with(Arguments arguments, const Arguments& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace

TEST_CASE("uncertainty: lookups over owners use configured sources and unknown correlation") {
  const Robot robot;
  const json to_base = robot.answered({"lookup", "world", "base"});
  CHECK(to_base.at("basis").at("sources") == json({"calibration"}));
  CHECK(stddev(to_base, 5) == testing::Approx(std::hypot(0.01, 0.02)));
  const json to_arm = robot.answered({"lookup", "world", "arm"});
  // The turns cancel, the lever between them does not.
  CHECK(stddev(to_arm, 5) == testing::Approx(std::hypot(0.01, 0.01)));
  CHECK_FALSE(to_arm.at("basis").at("bound").get<bool>());
  const json to_tool = robot.answered({"lookup", "world", "tool"});
  CHECK(to_tool.at("basis").at("bound").get<bool>());
  CHECK(stddev(to_tool, 3) > std::hypot(0.01, 0.01, 0.01));
  CHECK_THAT(robot.run({"lookup", "world", "tool"}).out,
             ContainsSubstring(
                 "correlation  edges share the error of 'calibration', which is accounted for\n"
                 "             of some edges is not known: the std dev is an upper bound\n"));
  CHECK_THAT(robot.run({"lookup", "arm", "arm"}).out, !ContainsSubstring("correlation"));
  CHECK_THAT(robot.run({"lookup", "world", "arm", "--order", "4"}).out,
             ContainsSubstring("order        fourth\n"));
  const json fourth = robot.answered({"lookup", "world", "arm", "--order", "4"});
  CHECK(fourth.at("basis").at("order") == 4);
  for (const char* order : {"3", "2.0"}) {
    const auto rejected = robot.run({"lookup", "world", "arm", "--order", order});
    CHECK(rejected.status == 2);
    CHECK_THAT(rejected.err,
               ContainsSubstring("--order: '" + std::string(order) + "' is neither 2 nor 4"));
  }
}

TEST_CASE("uncertainty: a measurement corrects or is rejected by the gate and is counted") {
  const Robot robot;
  const double before = stddev(robot.answered({"lookup", "world", "arm"}), 0);
  const json observed =
      robot.answered(with({"observe", "world", "arm", "--xyz", "1.01", "1", "0"}, kSure));
  CHECK(observed.at("accepted").get<bool>());
  CHECK(observed.at("corrected") == json({"base", "arm"}));
  CHECK(observed.at("stamp").is_null());
  const json after = robot.answered({"lookup", "world", "arm"});
  CHECK(after.at("translation").at(0).get<double>() == testing::Approx(1.01).margin(0.002));
  CHECK(stddev(after, 0) < 0.1 * before);
  const json refused =
      robot.answered(with({"observe", "world", "arm", "--xyz", "9", "1", "0"}, kSure), 1);
  CHECK_FALSE(refused.at("accepted").get<bool>());
  CHECK(refused.at("distance_squared").get<double>() > refused.at("limit").get<double>());
  // On a busy computer another way to the answer rounds in another way.
  const json kept = robot.answered({"lookup", "world", "arm"});
  for (const std::size_t i : {0U, 1U, 2U}) {
    CHECK(kept.at("translation").at(i).get<double>() ==
          testing::Approx(after.at("translation").at(i).get<double>()).margin(1e-12));
  }
  const CliResult text =
      robot.run(with({"observe", "world", "arm", "--xyz", "9", "1", "0"}, kSure));
  CHECK(text.status == 1);
  CHECK_THAT(text.out, ContainsSubstring("rejected by the gate"));
  const json fused = robot.answered(with({"fuse", "tool", "--xyz", "0", "0", "1"}, kSure));
  CHECK(fused.at("corrected") == json({"tool"}));
  const json monitor = robot.answered({"monitor", "--once"});
  for (const json& partition : monitor.at("partitions")) {
    const std::string name = partition.at("partition");
    const json& edges = partition.at("observed");
    INFO(partition.dump());
    // Nothing can be said of what is unknown.
    CHECK(edges.size() == (name == "tool" ? 0U : 1U));
    if (name == "tool") continue;
    CHECK(edges.at(0).at("observations") == 3);
    CHECK(edges.at(0).at("refused") == 2);
    CHECK(edges.at(0).at("verdict") == "too small");
  }
  CHECK_THAT(robot.run({"monitor", "--once"}).out, ContainsSubstring("too small"));
}

TEST_CASE("uncertainty: an unspecified edge is named until a measurement determines it") {
  const Robot robot;
  const Arguments lookup = {"lookup", "world", "wrist"};
  CHECK(robot.run({"add", "wrist", "--parent", "arm", "--covariance", "unspecified"}).status == 0);
  CHECK_THAT(robot.run(lookup).out, ContainsSubstring("std dev      unspecified for wrist\n"));
  const json before = robot.answered(lookup);
  CHECK(before.at("covariance").is_null());
  CHECK(before.at("covariance_of_specified").size() == 6);
  CHECK(before.at("basis").at("unspecified") == json({"wrist"}));
  const json observed =
      robot.answered(with({"observe", "world", "wrist", "--xyz", "5", "6", "7"}, kSure));
  CHECK(observed.at("accepted").get<bool>());
  CHECK(observed.at("dimensions") == 0);
  const json after = robot.answered(lookup);
  CHECK(after.at("basis").at("unspecified") == json::array());
  CHECK(after.at("translation").at(2).get<double>() == testing::Approx(7));
  CHECK(stddev(after, 2) == testing::Approx(0.001).epsilon(0.01));
  CHECK(robot.run({"update", "wrist", "--covariance", "unspecified"}).status == 0);
  CHECK(robot.answered(lookup).at("covariance").is_null());
  CHECK(robot.answered(lookup).at("translation").at(2).get<double>() == testing::Approx(7));
  CHECK(robot.run({"update", "wrist", "--covariance", "exact"}).status == 0);
  CHECK_FALSE(robot.answered(lookup).at("covariance").is_null());
  CHECK(robot.run({"update", "wrist", "--covariance", "none"}).status == 2);
}

TEST_CASE("uncertainty: invalid measurements are rejected") {
  const Robot robot;
  const CliResult exact = robot.run({"observe", "world", "arm", "--xyz", "1", "1", "0"});
  CHECK(exact.status == 1);
  CHECK_THAT(exact.err, ContainsSubstring("--stddev or --cov"));
  CHECK(robot.answered(with({"observe", "world", "nobody"}, kSure), 1).at("error").at("code") ==
        "unknown_end");
  CHECK(robot.answered(with({"fuse", "world"}, kSure), 1).at("error").at("code") ==
        "invalid_input");
  CHECK(robot.run(with({"observe", "world", "arm", "--gate", "0"}, kSure)).status == 2);
  CHECK(robot.run(with({"observe", "world", "arm", "--gate", "nan"}, kSure)).status == 2);
  CHECK(robot.run(with({"observe", "world", "arm", "--stamp", "x"}, kSure)).status == 2);
}

}  // namespace tfdude
