// Lookups of the command line that a daemon of this computer answers, compared with those over DDS.

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/test_domain.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Random;

Time at_ms(std::int64_t ms) { return time_of(1'700'000'000'000'000'000 + ms * 1'000'000); }

// The command line without the program that it becomes if nobody answers: so it has an answer from
// a daemon, or none.
class Quick {
 public:
  explicit Quick(const testing::TestDomain& domain) : domain_(domain) {
    std::filesystem::copy_file(TFDUDE_CLI, program_);
  }

  [[nodiscard]] CliResult run(const std::vector<std::string>& arguments,
                              const std::vector<std::string>& before = {}) const {
    std::vector<std::string> command = before;
    command.push_back(program_);
    const auto given = [&](const char* option) {
      return std::count(arguments.begin(), arguments.end(), option) > 0;
    };
    if (!given("--domain")) {
      command.insert(command.end(), {"--domain", std::to_string(domain_.number())});
    }
    if (!given("--local") && !given("--profile")) {
      command.insert(command.end(), {"--profile", TFDUDE_LOOPBACK_PROFILE});
    }
    command.insert(command.end(), arguments.begin(), arguments.end());
    testing::Process process(command);
    CliResult result = testing::finish(process);
    const bool none = result.err.find("cannot start") != std::string::npos;
    CHECK(result.status == (none ? 2 : 0));
    CHECK(result.out.empty() == none);
    return result;
  }
  [[nodiscard]] bool answers(const std::vector<std::string>& arguments,
                             const std::vector<std::string>& before = {}) const {
    return run(arguments, before).status == 0;
  }

  // The answer, which must come; a busy machine may need longer than is waited for.
  [[nodiscard]] CliResult answer(const std::vector<std::string>& arguments) const {
    CliResult result;
    CHECK(eventually([&] {
      result = run(arguments);
      return result.status == 0;
    }));
    return result;
  }

 private:
  const testing::TestDomain& domain_;
  const testing::TemporaryDirectory directory_;
  const std::string program_ = directory_.path() + "/tfdude";
};

// Asked over DDS.
CliResult over_dds(const testing::TestDomain& domain, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "--no-shared-memory");
  return domain.cli(arguments);
}

// A quaternion and its negative are one rotation.
json without_sign(json answer) {
  json& q = answer.at("rotation");
  if (q[3].get<double>() < 0) {
    for (json& one : q) one = -one.get<double>();
  }
  return answer;
}

// What differs, other than by rounding.
std::string difference(const json& a, const json& b, const std::string& where = "") {
  if (a.is_number_float() && b.is_number_float()) {
    const double gap = std::abs(a.get<double>() - b.get<double>());
    return gap < 1e-9 ? "" : where + ": " + a.dump() + " " + b.dump();
  }
  if (!a.is_structured() || a.type() != b.type() || a.size() != b.size()) {
    return a == b ? "" : where + ": " + a.dump() + " " + b.dump();
  }
  for (auto one = a.begin(), other = b.begin(); one != a.end(); ++one, ++other) {
    const std::string key = a.is_object() ? one.key() : "element";
    if (a.is_object() && key != other.key()) return where + ": other keys";
    if (auto found = difference(*one, *other, where + "/" + key); !found.empty()) return found;
  }
  return "";
}

struct Robot : testing::ThesisDaemons {
  Robot() {
    REQUIRE(eventually([&] {
      const bool answers = quick.answers({"lookup", "world", "hand_left"});
      // Otherwise nobody would ask for the memory of the other daemon.
      if (!answers) (void)over_dds(domain, {"lookup", "world", "hand_left"});
      return answers;
    }));
  }

  Client dds = Client::open([this] {
                 Options options = domain.options();
                 options.shared_memory = false;
                 return options;
               }())
                   .value();
  Quick quick{domain};
};

}  // namespace

TEST_CASE("one-shot: a daemon answers as over DDS, and says the same") {
  Robot d;
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"lookup", "world", "hand_left"},
        {"lookup", "hand_left", "world", "--cov"},
        {"lookup", "arm_1", "camera", "--matrix", "--deg"},
        {"--json", "lookup", "hand_left", "robot_2", "--matrix"},
        {"lookup", "--json", "world", "world"},
        {"lookup", "--at", "1700000000.5", "world", "hand_left"},
        {"exists", "hand_left"},
        {"--json", "exists", "world"}}) {
    CAPTURE(arguments);
    const CliResult answered = d.quick.answer(arguments);
    CHECK(answered.out == d.domain.cli(arguments).out);
    const std::string expected = over_dds(d.domain, arguments).out;
    if (answered.out[0] == '{') {
      CHECK(difference(json::parse(answered.out), json::parse(expected)) == "");
    } else {
      CHECK(answered.out == expected);
    }
  }
}

TEST_CASE("one-shot: answers over random trees are those over DDS, and never older") {
  Robot d;
  Random random(31);
  INFO("seed " << random.seed());
  std::vector<std::string> ids;
  const auto frames = d.dds.frames().value();
  for (const Frame& frame : frames) ids.push_back(frame.id);
  const auto any = [&]() -> const std::string& { return ids[random.index(ids.size())]; };
  std::int64_t now = 1000;
  int answers = 0;
  for (int step = 0; step < 60; ++step) {
    CAPTURE(step);
    const std::string changed = any();
    const std::size_t dice = random.index(8);
    if (dice == 0) {
      const std::string id = "new " + std::to_string(step);
      if (d.dds.add(id, changed, random.transform())) ids.push_back(id);
    } else if (dice == 1) {
      const auto before = d.dds.parent(changed).value();
      const std::string to = any();
      if (d.dds.move(changed, to, random.transform()) && before != to && !before.empty()) {
        const auto asked = d.quick.run({"--json", "lookup", to, changed});
        const auto expected =
            json::parse(over_dds(d.domain, {"--json", "lookup", to, changed}).out);
        if (asked.status == 0)
          CHECK(difference(without_sign(json::parse(asked.out)), without_sign(expected)) == "");
      }
    } else {
      const Transform X = random.transform();
      const bool moving = dice > 4;
      const auto stamp = moving ? std::optional<Time>(at_ms(now += 5)) : std::nullopt;
      const auto parent = d.dds.parent(changed).value();
      if (d.dds.update(changed, X, stamp) && !parent.empty()) {
        const auto asked = d.quick.run({"--json", "lookup", parent, changed});
        if (asked.status == 0) {
          ++answers;
          const auto shown = json::parse(asked.out).at("translation");
          const Eigen::Vector3d t(shown[0], shown[1], shown[2]);
          CHECK((t - X.pose.translation()).norm() < 1e-9);
        }
      }
    }
    std::vector<std::string> question{"--json", "lookup", any(), any()};
    if (random.index(2) == 0) {
      question.push_back("--at");
      question.push_back("17000000" + std::to_string(random.index(8)) + "." + std::to_string(5));
    }
    const CliResult asked = d.quick.run(question);
    const CliResult expected = over_dds(d.domain, question);
    CAPTURE(question, asked.out, expected.out);
    if (asked.status != 0) continue;
    ++answers;
    REQUIRE(expected.status == 0);
    CHECK(difference(without_sign(json::parse(asked.out)),
                     without_sign(json::parse(expected.out))) == "");
  }
  // How many come in time depends on how busy the machine is.
  CHECK(answers > 5);
}

TEST_CASE("one-shot: a frame that another client has removed is not shown any more") {
  Robot d;
  for (int i = 0; i < 10; ++i) {
    // Of either daemon.
    const std::string parent = i % 2 == 0 ? "world" : "arm_1";
    REQUIRE(d.dds.add("short", parent, Transform::exact({})));
    REQUIRE(eventually([&] { return d.quick.answers({"exists", "short"}); }));
    CHECK(eventually([&] { return d.quick.answers({"lookup", "camera", "short"}); }));
    REQUIRE(d.dds.remove("short"));
    CHECK_FALSE(d.quick.answers({"exists", "short"}));
    CHECK_FALSE(d.quick.answers({"lookup", "camera", "short"}));
    const auto why = d.domain.cli({"lookup", "camera", "short"});
    CHECK(why.status == 1);
    CHECK_THAT(why.err, ContainsSubstring("no frame 'short'"));
  }
  CHECK(d.domain.cli({"exists", "short"}).out == "no\n");
}

TEST_CASE(
    "one-shot: an owner that was killed or hangs has no answers, and why is said as over DDS") {
  Robot d;
  const std::vector<std::string> question{"lookup", "world", "hand_left"};
  d.arms->freeze();
  CHECK(eventually([&] { return !d.quick.answers(question); }));
  d.arms->signal(SIGCONT);
  CHECK(
      eventually([&] { return d.domain.cli(question).status == 0 && d.quick.answers(question); }));
  d.arms->kill();
  CHECK(eventually([&] { return !d.quick.answers(question); }));
  const auto asked = d.domain.cli(question);
  const auto expected = over_dds(d.domain, question);
  CHECK(asked.status == expected.status);
  CHECK(asked.status == 3);
  CHECK_THAT(asked.err, ContainsSubstring("'arms'"));
  // What the other one has is still answered.
  (void)d.quick.answer({"lookup", "world", "camera"});
  // The one that is asked hangs.
  d.robot.freeze();
  CHECK_FALSE(d.quick.answers({"lookup", "world", "camera"}));
  d.robot.signal(SIGCONT);
  CHECK(eventually([&] { return d.quick.answers({"lookup", "world", "camera"}); }));
}

TEST_CASE("one-shot: only daemons of the same domain and profile are asked, unless it is off") {
  Robot d;
  const std::vector<std::string> question{"lookup", "world", "hand_left"};
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.end(), question.begin(), question.end());
    return d.quick.answers(options);
  };
  CHECK(eventually([&] { return with({}); }));
  CHECK_FALSE(with({"--domain", std::to_string((d.domain.number() + 1) % 232)}));
  CHECK_FALSE(with({"--local"}));
  CHECK_FALSE(with({"--no-shared-memory"}));
  CHECK_FALSE(with({"--clock", "external"}));
  CHECK_FALSE(with({"--discovery-server", "127.0.0.1:11811"}));
  for (const char* variable : {"TFDUDE_SHARED_MEMORY=off", "TFDUDE_KEYS=/nowhere",
                               "ROS_DISCOVERY_SERVER=127.0.0.1:11811"}) {
    CAPTURE(variable);
    CHECK_FALSE(d.quick.answers(question, {"/usr/bin/env", variable}));
  }
  // A copy of the profile is the same profile, and another one is not.
  const testing::TemporaryDirectory files;
  const std::string copy = files.path() + "/copy.xml";
  std::filesystem::copy_file(TFDUDE_LOOPBACK_PROFILE, copy);
  CHECK(eventually([&] { return with({"--profile", copy}); }));
  CHECK_FALSE(with({"--profile", files.write("other.xml", "<profiles/>")}));
  CHECK_FALSE(with({"--profile", files.path() + "/missing.xml"}));
  // What fails is asked over DDS, and so is what the rest of the command line is for.
  for (const std::vector<std::string>& other :
       {std::vector<std::string>{"lookup", "world", "nowhere"},
        {"lookup", "world"},
        {"lookup", "world", "hand_left", "--wait", "5"},
        {"lookup", "world", "hand_left", "--geodetic"},
        {"lookup", "--help"},
        {"exists", "nowhere"},
        {"frames"}}) {
    CAPTURE(other);
    CHECK_FALSE(d.quick.answers(other));
  }
}

TEST_CASE("one-shot: a daemon whose memory nobody may read answers nobody") {
  testing::TestDomain domain;
  auto arms = domain.start_daemon({"--config", testing::kArmsFile, "--no-shared-memory"});
  testing::await_ready(arms);
  const Quick quick(domain);
  CHECK(domain.cli({"lookup", "arm_1", "hand_left"}).status == 0);
  CHECK_FALSE(quick.answers({"lookup", "arm_1", "hand_left"}));
}

TEST_CASE("one-shot: covariance that is not given is said, and joints that were never measured") {
  const testing::TestDomain domain;
  const testing::TemporaryDirectory files;
  const auto urdf = files.write("arm.urdf",
                                R"(<robot name="r"><link name="base"/><link name="hand"/>
      <joint name="lift" type="prismatic"><parent link="base"/><child link="hand"/>
      <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>)");
  const auto config = files.write("arm.yaml", "partition: arm\nurdf:\n  - file: " + urdf +
                                                  "\nframes:\n  - {id: tool, parent: hand}\n");
  const auto daemon = domain.serve(config);
  const Quick quick(domain);
  const auto tool = quick.answer({"lookup", "hand", "tool"});
  CHECK_THAT(tool.out, ContainsSubstring("tool"));
  CHECK(tool.out == over_dds(domain, {"lookup", "hand", "tool"}).out);
  // Only its owner knows which joints are assumed.
  const std::vector<std::string> question{"lookup", "base", "tool"};
  CHECK_FALSE(quick.answers(question));
  CHECK_THAT(domain.cli(question).out, ContainsSubstring("lift"));
  // An empty instant is not the newest.
  CHECK_FALSE(quick.answers({"lookup", "hand", "tool", "--at", ""}));
  for (const char* option : {"--at", "--fixed"}) {
    const auto empty = domain.cli({"lookup", "hand", "tool", option, ""});
    CHECK(empty.status == 2);
    CHECK_THAT(empty.err, ContainsSubstring(option));
  }
  REQUIRE(domain.cli({"joint", "lift=0.5"}).status == 0);
  CHECK(eventually([&] { return quick.answers(question); }));
}

#ifdef TFDUDE_SLOW_SYNC
TEST_CASE("one-shot: what is not stored yet is not shown") {
  const testing::TestDomain domain;
  const testing::TemporaryDirectory files;
  const auto slow = files.path() + "/slow";
  auto daemon = domain.start_daemon(
      {"--config", testing::kArmsFile, "--state", files.path() + "/state", "--sync"},
      {"/usr/bin/env", "LD_PRELOAD=" TFDUDE_SLOW_SYNC, "TFDUDE_SYNC_MS=2000",
       "TFDUDE_SYNC_IF=" + slow});
  testing::await_ready(daemon);
  const Quick quick(domain);
  (void)quick.answer({"exists", "arm_1"});
  (void)files.write("slow", "");
  const auto begin = testing::Clock::now();
  auto adding = domain.start_cli({"--timeout", "20000", "add", "late", "--parent", "arm_1"});
  REQUIRE(eventually([&] { return quick.answers({"exists", "late"}); }));
  CHECK(testing::Clock::now() - begin > std::chrono::milliseconds(1900));
  CHECK(adding.wait(testing::in_time()) == 0);
}
#endif

}  // namespace tfdude
