// A frame goes to another daemon on the command line, and is there after both have restarted.

#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;
using Arguments = std::vector<std::string>;

const char* const kArm1 = R"(
partition: arm1
frames:
  - {id: base}
  - {id: flange1, parent: base, xyz: [1, 0, 0]}
  - {id: gripper, parent: flange1, xyz: [0, 1, 0]}
  - {id: finger, parent: gripper, history: {moving: true, span: 600}}
)";
const char* const kArm2 = R"(
partition: arm2
frames:
  - {id: flange2, parent: base, xyz: [2, 0, 0]}
)";

struct Arms {
  Arms() {
    std::ofstream(directory.path() + "/arm1.yaml") << kArm1;
    std::ofstream(directory.path() + "/arm2.yaml") << kArm2;
    for (const char* name : {"arm1", "arm2"}) start(name);
  }
  void start(const std::string& name) {
    daemons.push_back(domain.start_daemon({"--config", directory.path() + "/" + name + ".yaml",
                                           "--state", directory.path() + "/state"}));
    (void)testing::await_ready(daemons.back());
  }
  json answered(const Arguments& arguments) const {
    Arguments all{"--json"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const CliResult result = domain.cli(all);
    INFO(result.err);
    REQUIRE(result.status == 0);
    return json::parse(result.out);
  }
  std::string failure(const Arguments& arguments) const {
    const CliResult result = domain.cli(arguments);
    CHECK(result.status != 0);
    return result.err;
  }
  json frame(const std::string& id) const {
    const json all = answered({"frames"});
    for (const json& frame : all.at("frames")) {
      if (frame.at("id") == id) return frame;
    }
    return {};
  }
  double x(const Arguments& of) const {
    Arguments all{"lookup"};
    all.insert(all.end(), of.begin(), of.end());
    return answered(all).at("translation").at(0).get<double>();
  }

  TestDomain domain;
  TemporaryDirectory directory;
  std::vector<Process> daemons;
};

}  // namespace

TEST_CASE("move --to-owner: a frame goes to another daemon with its history") {
  Arms arms;
  for (const char* stamp : {"1000", "1002"}) {
    (void)arms.answered({"update", "finger", "--xyz", stamp, "0", "0", "--stamp", stamp});
  }
  const json moved{{"done", "moved"}, {"id", "gripper"}};
  CHECK(arms.answered({"move", "gripper", "--to-owner", "arm2", "--parent", "flange2"}) == moved);
  CHECK(arms.frame("gripper").at("partition") == "arm2");
  CHECK(arms.frame("gripper").at("parent") == "flange2");
  CHECK(arms.frame("finger").at("partition") == "arm2");
  CHECK(arms.x({"gripper", "finger", "--at", "1001"}) == 1001);
  CHECK(arms.x({"base", "gripper"}) == 2);
  CHECK(arms.answered({"move", "gripper", "--to-owner", "arm1"}) == moved);
  CHECK(arms.answered({"move", "gripper", "--to-owner", "arm2"}) == moved);
  CHECK_THAT(arms.failure({"move", "gripper"}), ContainsSubstring("--to-owner"));
  CHECK_THAT(arms.failure({"move", "gripper", "--to-owner", "arm1", "--xyz", "1", "2", "3"}),
             ContainsSubstring("--parent"));
  CHECK_THAT(arms.failure({"move", "gripper", "--to-owner", "arm3"}), ContainsSubstring("arm3"));

  for (Process& daemon : arms.daemons) daemon.kill();
  arms.daemons.clear();
  arms.start("arm1");
  arms.start("arm2");
  REQUIRE(eventually([&] { return arms.frame("finger").is_object(); }));
  CHECK(arms.frame("gripper").at("partition") == "arm2");
  CHECK(arms.frame("gripper").at("parent") == "flange2");
  CHECK(arms.x({"gripper", "finger"}) == 1002);
}

}  // namespace tfdude
