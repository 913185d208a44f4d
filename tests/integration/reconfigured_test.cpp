// The state of a daemon after its configuration was edited or removed.

#include <algorithm>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::await_ready;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::finish;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;
using testing::x_of;
using Arguments = std::vector<std::string>;

constexpr const char* kBoth = R"(partition: arms
frames:
  - {id: arm}
  - {id: hand, parent: arm, xyz: [10, 0, 0]}
)";
constexpr const char* kArmOnly = "partition: arms\nframes:\n  - {id: arm}\n";

// A daemon of the partition "arms" that is killed and started with other arguments.
struct Arms {
  Arms() {
    const std::string both = directory.write("both.yaml", kBoth);
    with_both = {"--config", both};
    with_arm = {"--config", directory.write("arm.yaml", kArmOnly)};
    start(with_both);
  }
  void start(Arguments arguments) {
    arguments.insert(arguments.end(), {"--state", directory.path()});
    daemon.emplace(domain.start_daemon(arguments));
    ready = await_ready(*daemon);
  }
  void restart(const Arguments& arguments) {
    daemon->kill();
    start(arguments);
  }
  CliResult check(Arguments arguments) {
    arguments.insert(arguments.end(), {"--check", "--state", directory.path()});
    Process process = domain.start_daemon(arguments);
    return finish(process);
  }

  TestDomain domain;
  TemporaryDirectory directory;
  Arguments with_both;
  Arguments with_arm;
  std::optional<Process> daemon;
  std::string ready;
};

// Above hand and head there is one link.
const char* const kBranchingRobot = R"(<robot name="r">
  <link name="base"/> <link name="torso"/> <link name="hand"/> <link name="head"/>
  <joint name="a" type="fixed"><parent link="base"/><child link="torso"/></joint>
  <joint name="b" type="fixed"><parent link="torso"/><child link="hand"/></joint>
  <joint name="c" type="fixed"><parent link="torso"/><child link="head"/></joint>
</robot>)";

}  // namespace

TEST_CASE("reconfigured: a daemon without a configuration restores its whole state") {
  Arms arms;
  auto client = Client::open(arms.domain.options()).value();
  REQUIRE(client.add("tool", "hand", along_x(100)));
  REQUIRE(client.update("hand", along_x(20)));
  arms.restart({"--partition", "arms"});
  CHECK_THAT(arms.ready, ContainsSubstring("frames=3"));
  REQUIRE(eventually([&] { return x_of(client.lookup("arm", "tool")) == 120; }));
  // What the configuration said before is still known: it changes nothing.
  arms.restart(arms.with_both);
  CHECK_THAT(arms.ready, ContainsSubstring("frames=3"));
  REQUIRE(eventually([&] { return x_of(client.lookup("arm", "tool")) == 120; }));
}

TEST_CASE("reconfigured: a deleted entry removes its frame and no frame below it") {
  Arms arms;
  const std::string tools = arms.directory.write(
      "tools.yaml", "partition: tools\nframes:\n  - {id: gripper, parent: hand}\n");
  auto other = arms.domain.start_daemon({"--config", tools, "--state", arms.directory.path()});
  await_ready(other);
  auto client = Client::open(arms.domain.options()).value();
  REQUIRE(eventually([&] { return client.lookup("arm", "gripper").has_value(); }));
  REQUIRE(client.add("tool", "hand", along_x(100)));
  REQUIRE(client.add("tip", "tool", along_x(1000)));
  std::mutex mutex;
  std::vector<std::string> heard;
  const auto subscription = client.on_change([&](const Change& change) {
    const std::lock_guard lock(mutex);
    heard.push_back(std::string(to_string(change.kind)) + " " + change.frame);
  });
  const auto hears = [&](const std::string& what) {
    return eventually([&] {
      const std::lock_guard lock(mutex);
      return std::find(heard.begin(), heard.end(), what) != heard.end();
    });
  };
  arms.restart(arms.with_arm);
  CHECK(hears("frame_removed hand"));
  CHECK(hears("frame_orphaned tool"));
  CHECK(hears("frame_orphaned gripper"));
  REQUIRE(eventually([&] { return client.partitions().value()[0].reachable; }));
  CHECK_FALSE(client.exists("hand"));
  CHECK(client.parent("tool") == std::string("hand"));
  CHECK(client.parent("gripper") == std::string("hand"));
  CHECK(x_of(client.lookup("tool", "tip")) == 1000);
  CHECK(eventually([&] {
    (void)arms.daemon->runs();
    return arms.daemon->err().find(
               "frame 'gripper' of partition 'tools' waits for its parent "
               "'hand'") != std::string::npos;
  }));
  CHECK_THAT(arms.daemon->err(), ContainsSubstring("configuration: frame 'hand': removed"));
  CHECK_THAT(arms.daemon->err(),
             ContainsSubstring("frame 'tool' of partition 'arms' waits for its parent 'hand'"));
  // Others that come back do not take the removal for one that was asked for.
  other.kill();
  auto again = arms.domain.start_daemon({"--config", tools, "--state", arms.directory.path()});
  await_ready(again);
  REQUIRE(eventually([&] { return client.partitions().value()[1].reachable; }));
  CHECK(client.exists("gripper"));
  arms.restart(arms.with_both);
  CHECK(eventually([&] { return x_of(client.lookup("arm", "tip")) == 1110; }));
  CHECK(eventually([&] { return client.lookup("arm", "gripper").has_value(); }));
}

TEST_CASE("reconfigured: --check prints what a configuration would change and changes nothing") {
  Arms arms;
  auto client = Client::open(arms.domain.options()).value();
  REQUIRE(client.add("tool", "hand", along_x(100)));
  const std::string domain = std::to_string(arms.domain.number());
  const std::string file = arms.directory.path() + "/domain-" + domain + "/arms.sqlite";
  const std::string serves = "would serve partition 'arms' in domain " + domain + " with profile ";
  // Beside the daemon that has the file open.
  const CliResult shrunk = arms.check(arms.with_arm);
  CHECK(shrunk.status == 0);
  CHECK(shrunk.out.rfind(serves, 0) == 0);
  CHECK_THAT(shrunk.out, ContainsSubstring(
                             ": 2 frames\nconfigured by " + arms.with_arm[1] +
                             ": 1 frame, 0 joints\nstate " + file +
                             ": 3 frames\n  frame 'hand': removed, because its entry was deleted\n"
                             "  frame 'tool': waits for its parent 'hand', which is removed\n"
                             "  2 frames kept as stored\n"
                             "needs 'hand' of another partition, for 'tool'\n"));
  const CliResult same = arms.check(arms.with_both);
  CHECK(same.status == 0);
  const std::string unchanged =
      "state " + file + ": 3 frames\n  nothing changes\n  3 frames kept as stored\n";
  CHECK_THAT(same.out, ContainsSubstring(": 2 frames, 0 joints\n" + unchanged));
  const CliResult none = arms.check({"--partition", "arms"});
  CHECK_THAT(none.out, ContainsSubstring("no frames configured") && ContainsSubstring(unchanged));
  const CliResult fresh = arms.check(
      {"--config", arms.directory.write("legs.yaml", "partition: legs\nframes:\n  - {id: leg}\n")});
  CHECK_THAT(fresh.out,
             ContainsSubstring("legs.sqlite: 0 frames\n  frame 'leg': added as a root\n"));
  // The configuration puts `hand` below `wrist`, which is now below `hand`: a cycle.
  REQUIRE(client.move("hand", ""));
  REQUIRE(client.add("wrist", "hand", {}));
  const CliResult cycle =
      arms.check({"--config", arms.directory.write("cycle.yaml", R"(partition: arms
frames:
  - {id: arm}
  - {id: hand, parent: wrist}
)")});
  CHECK(cycle.status == 2);
  CHECK_THAT(cycle.err, ContainsSubstring("cannot be moved under 'wrist', which lies below it"));
  CHECK(client.exists("wrist"));
}

TEST_CASE("reconfigured: --check tells what a configuration describes, and needs of others") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  const auto check = [&](Arguments arguments) {
    arguments.insert(arguments.end(), {"--check", "--no-state"});
    Process process = domain.start_daemon(arguments);
    return finish(process);
  };
  const std::string urdf = directory.write("arm.urdf", R"(<robot name="arm">
  <link name="base"/> <link name="upper"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="upper"/> <axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>)");
  const std::string config =
      directory.write("arm.yaml", "partition: arm\nframes:\n  - {id: mount, parent: world}\n");
  const CliResult whole = check({"--config", config, "--urdf", urdf, "--root", "mount"});
  CHECK(whole.status == 0);
  CHECK_THAT(whole.out, ContainsSubstring("configured by " + config +
                                          ": 1 frame, 0 joints\n"
                                          "configured by " +
                                          urdf +
                                          ": 2 frames, 1 joint\n"
                                          "nothing is stored, and nothing was: --no-state\n"
                                          "needs 'world' of another partition, for 'mount'\n"));
  const CliResult broken =
      check({"--config", config, "--urdf", directory.write("broken.urdf", "<robot")});
  CHECK(broken.status == 2);
  CHECK_THAT(broken.err, ContainsSubstring("broken.urdf"));
  const CliResult no_keys = check({"--config", config, "--keys", directory.path() + "/none"});
  CHECK(no_keys.status == 2);
  CHECK_THAT(no_keys.err, ContainsSubstring("none"));
}

TEST_CASE("reconfigured: --check tells whether several configurations fit together") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  const auto config = [&](const std::string& partition, const std::string& rest) {
    return directory.write(partition + ".yaml", "partition: " + partition + "\n" + rest);
  };
  const auto urdf = [&](const std::string& prefix) {
    return "urdf: [{file: " + directory.path() + "/arm.urdf, prefix: " + prefix +
           ", root: world}]\n";
  };
  (void)directory.write("arm.urdf", R"(<robot name="arm">
  <link name="base"/> <link name="upper"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="upper"/> <axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>)");
  const std::string world = config("world", "frames: [{id: world}]\n");
  const std::string left = config("left", urdf("left_"));
  const std::string right = config("right", urdf("right_"));
  const auto check = [&](const Arguments& files) {
    Arguments arguments{"--check", "--no-state"};
    for (const std::string& file : files) arguments.insert(arguments.end(), {"--config", file});
    Process process = domain.start_daemon(arguments);
    return finish(process);
  };
  const CliResult good = check({world, left, right});
  INFO(good.err);
  CHECK(good.status == 0);
  CHECK_THAT(good.out,
             ContainsSubstring("partition 'left'") && ContainsSubstring("partition 'right'"));
  const auto wrong = [&](const Arguments& files, const std::string& why) {
    const CliResult result = check(files);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, ContainsSubstring(why));
  };
  wrong({left, right}, "no configuration has its parent 'world'");
  wrong({world, left, config("other", urdf("left_"))}, "frame 'left_base' is in ");
  wrong({world, left, config("other", urdf("left_"))}, "joint 'left_shoulder' is in ");
  wrong({world, left, left}, "partition 'left' has two configurations");
  const std::string a = config("a", "frames: [{id: a, parent: b}]\n");
  wrong({a, config("b", "frames: [{id: b, parent: a}]\n")}, "lies below itself");
  Process serving = domain.start_daemon({"--config", world, "--config", left});
  CHECK(finish(serving).status == 2);
}

TEST_CASE("reconfigured: a daemon says who owns the links that it cannot have") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  const std::string urdf = directory.write("robot.urdf", kBranchingRobot);
  Process first =
      domain.start_daemon({"--partition", "arm", "--urdf", urdf, "--links", "hand", "--no-state"});
  REQUIRE(!await_ready(first).empty());
  Process second = domain.start_daemon({"--partition", "body", "--urdf", urdf, "--no-state"});
  const CliResult refused = finish(second);
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, ContainsSubstring("frame 'hand' belongs to partition 'arm'") &&
                              ContainsSubstring("write --links base..torso,head for '"));
  Process third = domain.start_daemon(
      {"--partition", "body", "--urdf", urdf, "--links", "base..torso,head", "--no-state"});
  CHECK_THAT(await_ready(third), ContainsSubstring("frames=3"));
}

TEST_CASE(
    "reconfigured: what a daemon says to write keeps its links, and has no root without one") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  const std::string urdf = directory.write("robot.urdf", kBranchingRobot);
  const auto config = [&](const std::string& links, const std::string& root) {
    return directory.write(
        "body.yaml", "partition: body\nframes: [{id: lamp}]\nurdf:\n  - {file: " + urdf + ", " +
                         root + "links: [" + links + "]}\n");
  };
  const auto body = [&](const std::string& file) {
    return domain.start_daemon({"--config", file, "--no-state"});
  };
  Process base = domain.start_daemon(
      {"--partition", "base", "--urdf", urdf, "--links", "base..base", "--no-state"});
  REQUIRE(!await_ready(base).empty());
  Process second = body(config("base..torso, head", "root: lamp, xyz: [1, 0, 0], "));
  CHECK_THAT(finish(second).err,
             ContainsSubstring("write links: [torso..torso, head] and no root, nor a pose in it"));
  Process third = body(config("torso..torso, head", ""));
  CHECK_THAT(await_ready(third), ContainsSubstring("frames=3"));
  Process fourth = domain.start_daemon(
      {"--partition", "other", "--urdf", urdf, "--links", "head", "--no-state"});
  CHECK_THAT(finish(fourth).err, ContainsSubstring("others own all of its links"));
}

TEST_CASE("reconfigured: correlations from observations and requests survive a kill") {
  Arms arms;
  auto client = Client::open(arms.domain.options()).value();
  const Covariance some = *Covariance::from_stddev({0.01, 0.01, 0.01, 0.01, 0.01, 0.01});
  for (const auto& [id, x] : {std::pair("tool", 1.0), std::pair("tip", 2.0)}) {
    REQUIRE(client.add(id, id == std::string("tool") ? "hand" : "tool", {along_x(x).pose, some}));
  }
  const CliResult said =
      arms.domain.cli({"correlate", "tip", "--source", "supply", "0", "0", "0", "0", "0", "0.002"});
  CHECK(said.status == 0);
  CHECK_THAT(said.out, ContainsSubstring("correlated tip"));
  REQUIRE(client.observe("hand", "tip", {along_x(3).pose, some}));
  const auto before = client.lookup("hand", "tip", Query{});
  REQUIRE(before);
  REQUIRE(before->basis.sources.size() == 2);
  arms.restart({"--partition", "arms"});
  const auto as_before = [&] {
    const auto after = client.lookup("hand", "tip", Query{});
    return after && after->basis.sources == before->basis.sources &&
           testing::transform_diff(*after, *before, 1e-12) == "";
  };
  CHECK(eventually(as_before));
  CHECK(arms.domain.cli({"correlate", "tip", "--source", "supply", "0", "0", "x", "0", "0", "1"})
            .status == 2);
  CHECK(arms.domain.cli({"correlate", "tip", "--source", "supply", "0", "0"}).status == 2);
  CHECK(as_before());
  REQUIRE_FALSE(before->basis.bound);
  CHECK(arms.domain.cli({"correlate", "tip", "--unknown"}).status == 0);
  const auto unknown = client.lookup("hand", "tip", Query{});
  REQUIRE(unknown);
  CHECK(unknown->basis.bound);
}

}  // namespace tfdude
