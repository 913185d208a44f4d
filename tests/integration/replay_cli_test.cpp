// Replays on the command line.

#include <chrono>
#include <cmath>
#include <csignal>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9)); }

Transform shifted(double x, double sigma) {
  return {*Pose::create(Eigen::Quaterniond::Identity(), {x, 0, 0}),
          *Covariance::from_stddev({sigma, sigma, sigma, sigma, sigma, sigma})};
}

constexpr double kBegin = 1000;
constexpr double kEnd = 1010;

// Two partitions: a base whose lift moves by 0.1 m/s, and an arm that gets a tool after 5 s.
std::string written(const TemporaryDirectory& directory) {
  const std::string file = directory.path() + "/robot.mcap";
  auto writer = RecordingWriter::create(file, at(kBegin));
  REQUIRE(writer);
  const auto add = [&](const char* partition, auto what, double time) {
    REQUIRE(writer->add(PartitionNews{partition, std::move(what)}, at(time)));
  };
  add("base", ReachNews{true, ""}, kBegin);
  add("base", FramesNews{{{"lift", "world"}, {"world", ""}}, 5}, kBegin);
  add("base", ValuesNews{1, {{0, at(kBegin), shifted(0, 0.01), {}, Covariance()}}}, kBegin);
  add("arm", ReachNews{true, ""}, kBegin);
  add("arm", FramesNews{{{"hand", "lift"}}, 6}, kBegin);
  CommonError supply{"supply", false, Loading::Constant(6, 1, 0.01)};
  add("arm",
      ValuesNews{1, {{0, std::nullopt, shifted(1, 0.02), {false, {supply}, {}}, Covariance()}}},
      kBegin);
  JointInfo wrist{"wrist", "hand", JointType::kRevolute, JointLimits{-1, 1}, Mimic{"lift", 2, 0}};
  for (int i = 1; i <= 1000; ++i) {
    const double time = kBegin + 0.01 * i;
    wrist.position = 0.001 * i;
    REQUIRE(writer->add("arm", {wrist}, at(time)));
    add("base",
        ValuesNews{1U + static_cast<unsigned>(i), {{0, at(time), shifted(0.001 * i, 0.01)}}}, time);
    // An observation has corrected the sample.
    if (i == 300) add("base", ValuesNews{301, {{0, at(time), shifted(0.31, 0.004)}}}, time + 0.005);
    if (i != 500) continue;
    add("arm", FramesNews{{{"hand", "lift"}, {"tool", "hand"}}, 6}, time);
    add("arm", ValuesNews{2, {{1, std::nullopt, shifted(0.5, 0.005), {}, Covariance()}}}, time);
  }
  REQUIRE(writer->finish(at(kEnd)));
  return file;
}

Options external(const TestDomain& domain) {
  Options options = domain.options();
  options.clock = ClockKind::kExternal;
  return options;
}

bool has_frame(Client& client, const std::string& id) {
  const auto partitions = client.partitions();
  return partitions && client.parent(id).has_value();
}

void check_same(const Result<StampedTransform>& served, const Result<StampedTransform>& recorded) {
  REQUIRE(served);
  REQUIRE(recorded);
  CHECK(served->stamp == recorded->stamp);
  CHECK((served->pose.matrix() - recorded->pose.matrix()).cwiseAbs().maxCoeff() < 1e-12);
  const auto& a = served->covariance.of_specified().matrix();
  const auto& b = recorded->covariance.of_specified().matrix();
  CHECK((a - b).cwiseAbs().maxCoeff() < 1e-12);
}

}  // namespace

TEST_CASE("replay: the partitions are served as they were recorded, at the recording's time") {
  const TemporaryDirectory directory;
  const std::string file = written(directory);
  auto recording = Recording::open(file);
  REQUIRE(recording);
  const TestDomain domain;
  Process replay = domain.start_cli({"replay", file, "--rate", "2"});
  auto client = Client::open(external(domain));
  REQUIRE(client);
  REQUIRE(eventually([&] { return has_frame(*client, "hand") && has_frame(*client, "lift"); }));
  CHECK_FALSE(has_frame(*client, "tool"));
  Query query;
  query.at = at(kBegin + 4.005);
  check_same(client->lookup("world", "hand", query, 20s),
             recording->lookup_at("world", "hand", *query.at, query));
  query.at = at(kBegin + 3);
  recording->seek(at(kBegin + 4));
  const auto corrected = recording->lookup("world", "lift", query);
  CHECK(corrected.value().pose.translation().x() == 0.31);
  check_same(client->lookup("world", "lift", query), corrected);
  const auto now = client->now();
  REQUIRE(now);
  CHECK(*now >= at(kBegin + 4));
  CHECK(*now <= at(kEnd));
  query.at = at(kBegin + 8.0025);
  check_same(client->lookup("world", "tool", query, 20s),
             recording->lookup_at("world", "tool", *query.at, query));
  const CliResult result = testing::finish(replay);
  CHECK(result.status == 0);
  CHECK_THAT(result.out, ContainsSubstring("replayed") && !ContainsSubstring("rejected"));
}

// An edge that drifts says how it is correlated with each sample. What an observation has left of a
// sample is said of this one only, so in a replay its relation to other edges is unknown.
TEST_CASE("replay: no path is more certain than it was recorded") {
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/drift.mcap";
  auto writer = RecordingWriter::create(file, at(kBegin));
  REQUIRE(writer);
  const auto add = [&](auto what, double time) {
    REQUIRE(writer->add(PartitionNews{"base", std::move(what)}, at(time)));
  };
  const CommonError mount{"mount", false, Loading::Constant(6, 1, 0.01)};
  const CommonError seen{"observed:1", false, Loading::Constant(6, 1, 0.01)};
  add(ReachNews{true, ""}, kBegin);
  add(FramesNews{{{"camera", "odom"}, {"mark", "odom"}, {"odom", "world"}, {"world", ""}}, 5},
      kBegin);
  const Covariance walk = shifted(0, 0.001).covariance.of_specified();
  WatchedValue drifting{2, at(kBegin), shifted(0, 0.01), {false, {mount}, {"odom"}}, walk};
  drifting.drifts = true;
  add(ValuesNews{1,
                 {{0, std::nullopt, shifted(0, 0.02), {false, {mount}, {}}, Covariance()},
                  {1, at(kBegin), shifted(0, 0.02), {}, Covariance()},
                  drifting}},
      kBegin);
  for (int i = 1; i <= 100; ++i) {
    const double time = kBegin + 0.1 * i;
    WatchedValue mark{1, at(time), shifted(0, 0.02)};
    if (i == 50) mark.correlation = {false, {seen}, {"mark", "odom"}};
    add(ValuesNews{1U + static_cast<unsigned>(i),
                   {mark, {2, at(time), shifted(0, 0.01), {false, {mount}, {"odom"}}}}},
        time);
  }
  REQUIRE(writer->finish(at(kEnd)));

  const TestDomain domain;
  Process replay = domain.start_cli({"replay", file, "--rate", "4"});
  auto client = Client::open(external(domain));
  REQUIRE(client);
  REQUIRE(eventually([&] { return has_frame(*client, "camera") && has_frame(*client, "mark"); }));
  const auto variance = [&](const char* frame, double time) {
    Query query;
    query.at = at(time);
    const auto X = client->lookup("world", frame, query, 20s);
    return X.value().covariance.of_specified().matrix()(0, 0);
  };
  // Both have the error of the mount: (0.01 + 0.01)².
  CHECK(std::abs(variance("camera", kBegin + 3) - (1e-4 + 4e-4 + 4e-4)) < 1e-12);
  // Nothing is known to tie the sample with the edge above: (√(2e-4) + √(5e-4))².
  CHECK(std::abs(variance("mark", kBegin + 5) - std::pow(std::sqrt(2e-4) + std::sqrt(5e-4), 2)) <
        1e-12);
  testing::finish(replay);
}

TEST_CASE("replay: it pauses, and begins anywhere") {
  const TemporaryDirectory directory;
  const std::string file = written(directory);
  const TestDomain domain;
  Process replay = domain.start_cli({"replay", file, "--at", "1006", "--paused"});
  auto client = Client::open(external(domain));
  REQUIRE(client);
  REQUIRE(eventually([&] { return has_frame(*client, "tool") && has_frame(*client, "lift"); }));
  REQUIRE(client->now());
  CHECK(client->now().value() == at(kBegin + 6));
  std::this_thread::sleep_for(300ms);
  CHECK(client->now().value() == at(kBegin + 6));
  const auto X = client->lookup("world", "lift", Query());
  REQUIRE(X);
  CHECK(X->stamp == at(kBegin + 6));
  replay.signal(SIGINT);
  CHECK(testing::finish(replay).status == 0);
}

TEST_CASE("replay: a loop begins again, and what came later is gone") {
  const TemporaryDirectory directory;
  const std::string file = written(directory);
  const TestDomain domain;
  Process replay = domain.start_cli({"replay", file, "--loop", "--rate", "4", "--at", "1004"});
  auto client = Client::open(external(domain));
  REQUIRE(client);
  REQUIRE(eventually([&] { return has_frame(*client, "tool"); }));
  REQUIRE(eventually([&] { return !has_frame(*client, "tool"); }));
  const auto now = client->now();
  REQUIRE(now);
  CHECK(*now < at(kBegin + 8));
  REQUIRE(eventually([&] { return has_frame(*client, "tool"); }));
  replay.signal(SIGINT);
  const CliResult result = testing::finish(replay);
  CHECK_THAT(result.err, ContainsSubstring("from the beginning"));
  // Nothing is wrong.
  CHECK_THAT(result.err, !ContainsSubstring("[warning]"));
}

TEST_CASE("replay: joints are where they were") {
  const TemporaryDirectory directory;
  const std::string file = written(directory);
  const TestDomain domain;
  Process replay = domain.start_cli({"replay", file, "--at", "1006", "--paused"});
  auto client = Client::open(external(domain));
  REQUIRE(client);
  REQUIRE(eventually([&] {
    const auto joints = client->joints("arm");
    return joints && joints->size() == 1;
  }));
  const auto joints = client->joints("arm");
  REQUIRE(joints);
  const JointInfo& wrist = joints->front();
  CHECK(wrist.name == "wrist");
  CHECK(wrist.frame == "hand");
  CHECK(std::abs(wrist.position - 0.6) < 0.0025);
  REQUIRE(wrist.limits);
  CHECK(wrist.limits->upper == 1);
  REQUIRE(wrist.mimic);
  CHECK(wrist.mimic->joint == "lift");
}

TEST_CASE("replay: a recording without partitions is an error") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/empty.mcap";
  Process recorder = domain.start_cli({"record", file});
  REQUIRE(eventually([&] { return domain.cli({"info", file}).status == 0; }));
  recorder.signal(SIGINT);
  const CliResult recorded = testing::finish(recorder);
  CHECK(recorded.status == 0);
  CHECK_THAT(recorded.err, ContainsSubstring("no partition was recorded"));
  CHECK_THAT(domain.cli({"info", file}).out, ContainsSubstring("partition    none"));
  const CliResult refused = domain.cli({"replay", file});
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, ContainsSubstring("has no partition"));
}

TEST_CASE("replay: a name that a live partition has is refused") {
  const testing::ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/robot.mcap";
  Process recorder = d.domain.start_cli({"record", file});
  REQUIRE(eventually([&] {
    return d.domain.cli({"tree", "--recording", file}).out == testing::text(d, {"tree"});
  }));
  recorder.signal(SIGINT);
  REQUIRE(testing::finish(recorder).status == 0);
  const CliResult refused = d.domain.cli({"replay", file});
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, ContainsSubstring("partition"));
  // Elsewhere it is served, with all that the robot had.
  const TestDomain other;
  Process replay = other.start_cli({"replay", file, "--at", "-0", "--paused"});
  const std::vector<std::string> question{"--clock", "external", "tree"};
  const std::string live = testing::text(d, {"tree"});
  CHECK(eventually([&] { return other.cli(question).out == live; }));
}

}  // namespace tfdude
