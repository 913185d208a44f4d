// Recordings on the command line, with real daemons.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/thesis_json.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::answered;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Process;
using testing::TemporaryDirectory;
using testing::text;
using testing::ThesisDaemons;
using Arguments = std::vector<std::string>;

Arguments of_file(Arguments arguments, const std::string& file) {
  arguments.insert(arguments.end(), {"--recording", file});
  return arguments;
}

// Whether two answers are equal, and their numbers within 1e-12.
bool same(const json& a, const json& b) {
  if (a.is_number() && b.is_number()) {
    return std::abs(a.get<double>() - b.get<double>()) <= 1e-12;
  }
  if (!a.is_structured() || a.type() != b.type() || a.size() != b.size()) return a == b;
  return std::equal(a.begin(), a.end(), b.begin(),
                    [](const json& x, const json& y) { return same(x, y); });
}

std::string seconds(Time time) {
  const std::string ns = std::to_string(nanoseconds(time));
  return ns.substr(0, ns.size() - 9) + "." + ns.substr(ns.size() - 9);
}

Time now() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

// Whether the newest sample of an edge is in the file.
bool has_sample(const ThesisDaemons& d, const std::string& file, Time stamp) {
  const CliResult result =
      d.domain.cli({"--json", "lookup", "robot_1", "arm_1", "--recording", file});
  if (result.status != 0) return false;
  const json found = json::parse(result.out).at("stamp_ns");
  return found == json(nanoseconds(stamp));
}

// Samples of an edge, 100 ms apart, the last one now. @return their stamps
std::vector<Time> move_arm(const ThesisDaemons& d) {
  std::vector<Time> stamps;
  for (int i = 0; i < 5; ++i) {
    stamps.push_back(now());
    (void)text(d, {"update", "arm_1", "--xyz", std::to_string(0.1 * i), "0.2", "0", "--rpy", "0.1",
                   "0", std::to_string(0.2 * i), "--stddev", "0.01", "0.02", "0.01", "0.001",
                   "0.002", "0.001", "--stamp", seconds(stamps.back())});
    std::this_thread::sleep_for(100ms);
  }
  return stamps;
}

}  // namespace

TEST_CASE("record: what was believed of an instant before a late sample came can be asked") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/robot.mcap";
  const std::string at_first = seconds(now());
  const Process recorder = d.domain.start_cli({"record", file});
  REQUIRE(eventually([&] { return d.domain.cli({"info", file}).status == 0; }));
  const auto stamps = move_arm(d);
  REQUIRE(eventually([&] { return has_sample(d, file, stamps.back()); }));
  const std::string before = seconds(now());
  const std::string between = seconds(stamps[1] + (stamps[2] - stamps[1]) / 2);
  (void)text(d, {"update", "arm_1", "--xyz", "5", "0", "0", "--stamp", between});
  const auto x = [&](const Arguments& more) {
    Arguments arguments{"--json", "lookup", "robot_1", "arm_1", "--at", between};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CliResult result = d.domain.cli(of_file(arguments, file));
    return result.status == 0 ? json::parse(result.out).at("translation").at(0).get<double>() : -1;
  };
  REQUIRE(eventually([&] { return x({"--believed-at", seconds(now())}) == 5; }));
  CHECK(std::abs(x({"--believed-at", before}) - 0.15) < 0.05);
  CHECK(std::abs(x({}) - 0.15) < 0.05);
  // What was not known yet is not read on for.
  CHECK(x({"--believed-at", at_first}) == -1);
  // These owners remember nothing.
  const CliResult live = d.domain.cli({"lookup", "robot_1", "arm_1", "--believed-at", "-1"});
  CHECK(live.status == 1);
  CHECK_THAT(live.err, ContainsSubstring("what was believed") && ContainsSubstring("arm_1"));
}

TEST_CASE("record: a killed recorder leaves a file that answers as the live system did") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/robot.mcap";
  Process recorder = d.domain.start_cli({"record", file});
  REQUIRE(eventually([&] { return d.domain.cli({"info", file}).status == 0; }));
  REQUIRE(eventually([&] {
    const CliResult tree = d.domain.cli({"tree", "--recording", file});
    return tree.status == 0 && tree.out == text(d, {"tree"});
  }));
  // What nobody has specified is named.
  (void)text(d, {"update", "camera", "--covariance", "unspecified"});
  const auto stamps = move_arm(d);
  const auto written = now();
  REQUIRE(eventually([&] { return has_sample(d, file, stamps.back()); }));
  // Flushed at least once a second; the rest is the time of this test's programs.
  CHECK(now() - written < 5s);
  recorder.kill();
  const json info = answered(d, {"info", file});
  CHECK(info.at("finished") == false);
  CHECK(info.at("problems").size() == 1);
  CHECK(info.at("partitions").size() == 2);
  CHECK(text(d, {"frames", "--recording", file}) == text(d, {"frames"}));
  CHECK(text(d, {"joints", "--recording", file}) == text(d, {"joints"}));
  const std::string between = seconds(stamps[1] + 37ms);
  const std::vector<Arguments> questions{
      {"lookup", "world", "hand_left"},
      {"lookup", "hand_left", "camera"},
      {"lookup", "world", "hand_left", "--at", between},
      {"lookup", "robot_1", "arm_1", "--at", between, "--order", "4"},
      {"lookup", "arm_1", "arm_1", "--fixed", "world", "--at", between, "--at-b",
       seconds(stamps[3])},
      {"lookup", "world", "nobody"},
      {"tree"},
      {"frames"},
      {"joints"},
  };
  for (const Arguments& question : questions) {
    INFO(question[0] << " " << (question.size() > 2 ? question[2] : ""));
    const int status = question.back() == "nobody" ? 1 : 0;
    const json live = answered(d, question, status);
    const json recorded = answered(d, of_file(question, file), status);
    if (status == 0) {
      INFO(live.dump() << "\n" << recorded.dump());
      CHECK(same(live, recorded));
    } else {
      CHECK(recorded.at("error").at("code") == live.at("error").at("code"));
    }
  }
  const std::string graph = directory.path() + "/graph.dot";
  (void)text(d, {"graph", "--out", graph, "--recording", file});
  CHECK(std::filesystem::file_size(graph) > 100);
  (void)text(d, {"plot", "world", "hand_left", "--out", directory.path() + "/hand.svg",
                 "--recording", file, "--at", between});
  const std::string echoed = text(d, {"--json", "echo", "robot_1", "arm_1", "--rate", "20",
                                      "--recording", file, "--at", seconds(stamps[0])});
  CHECK(std::count(echoed.begin(), echoed.end(), '\n') >= 8);
}

TEST_CASE("record: it ends at a signal, with the events, and says what it wrote") {
  ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/robot.mcap";
  Process recorder = d.domain.start_cli({"--json", "record", file});
  REQUIRE(eventually([&] {
    return d.domain.cli({"tree", "--recording", file}).out == text(d, {"tree"});
  }));
  const Time before = now();
  (void)text(d, {"add", "lamp", "--parent", "world", "--xyz", "0", "0", "2"});
  d.arms->kill();
  // What is lost, a new participant does not know, but the recorder does.
  REQUIRE(eventually([&] {
    const std::string tree = d.domain.cli({"tree", "--recording", file}).out;
    return tree.find("lamp  [robot]") != std::string::npos &&
           tree.find("hand_left  [arms, unreachable]") != std::string::npos;
  }));
  recorder.signal(SIGINT);
  const CliResult result = testing::finish(recorder);
  CHECK(result.status == 0);
  const json said = json::parse(result.out);
  CHECK(said.at("files") == json({file}));
  CHECK(said.at("bytes").get<std::uintmax_t>() == std::filesystem::file_size(file));
  CHECK(answered(d, {"info", file}).at("finished") == true);
  const std::string events = text(d, {"events", "--recording", file});
  CHECK_THAT(events, ContainsSubstring("lamp") && ContainsSubstring("arms"));
  CHECK(text(d, {"frames", "--recording", file, "--at", seconds(before)}).find("lamp") ==
        std::string::npos);
  const CliResult again = d.domain.cli({"record", file});
  CHECK(again.status == 1);
  CHECK_THAT(again.err, ContainsSubstring(file));
}

TEST_CASE(
    "record: a full disk ends the recording with a clear error, and the file stays readable") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/robot.mcap";
  // The limit is 100 kB.
  Process recorder({"/bin/sh", "-c", "ulimit -f 200; exec \"$@\"", "sh", TFDUDE_CLI, "--domain",
                    std::to_string(d.domain.number()), "--profile", TFDUDE_LOOPBACK_PROFILE,
                    "record", file, "--raw"});
  REQUIRE(eventually([&] {
    return d.domain.cli({"tree", "--recording", file}).out == text(d, {"tree"});
  }));
  auto client = Client::open(d.domain.options());
  REQUIRE(client);
  std::atomic<bool> stop{false};
  std::thread load([&] {
    for (int i = 0; !stop; ++i) {
      Transform X_PC;
      X_PC.covariance = *Covariance::from_stddev({0.1 + 1e-6 * i, 1, 1, 1, 1, 1});
      (void)client->publish({{"arm_1", X_PC}, {"arm_2", X_PC}}, now());
      std::this_thread::sleep_for(1ms);
    }
  });
  const CliResult result = testing::finish(recorder);
  stop = true;
  load.join();
  CHECK(result.status == 1);
  CHECK_THAT(result.err, ContainsSubstring(file) && ContainsSubstring("File too large"));
  CHECK(std::filesystem::file_size(file) <= 200 * 512);
  CHECK(answered(d, {"info", file}).at("problems").size() == 1);
  CHECK(d.domain.cli({"lookup", "world", "hand_left", "--recording", file}).status == 0);
}

TEST_CASE("record: wrong usage and unreadable files are refused") {
  const testing::TestDomain domain;
  const TemporaryDirectory directory;
  const std::string text = directory.write("text.mcap", "no recording");
  CHECK(domain.cli({"info", text}).status == 2);
  CHECK_THAT(domain.cli({"tree", "--recording", text}).err, ContainsSubstring("MCAP"));
  const CliResult none = domain.cli({"--json", "info", directory.path() + "/none"});
  CHECK(none.status == 2);
  CHECK(json::parse(none.out).at("error").at("code") == "config");
  CHECK(domain.cli({"tree", "--at", "5"}).status == 2);
  CHECK(domain.cli({"record"}).status == 2);
  CHECK(domain.cli({"record", directory.path() + "/x", "--split-size", "0"}).status == 2);
  CHECK(domain.cli({"record", "/nowhere/x.mcap"}).status == 1);
}

}  // namespace tfdude
