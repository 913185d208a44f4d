// The past is rewritten on the command line, with a real daemon, and as docs/rewriting.md says.

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"
#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::Approx;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;
using Arguments = std::vector<std::string>;

// The first block of the page in a language.
std::string block(const std::string& language) {
  std::ifstream in(TFDUDE_DOCS "/rewriting.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  const std::string head = "\n```" + language + "\n";
  const std::size_t begin = page.find(head);
  REQUIRE(begin != std::string::npos);
  const std::size_t from = begin + head.size();
  return page.substr(from, page.find("\n```", from) - from + 1);
}

// The daemon of the page.
struct Slam {
  Slam() : daemon(domain.serve(write("slam.yaml", block("yaml")))) {}

  std::string write(const std::string& name, const std::string& text) const {
    std::string path = directory.path() + "/" + name;
    std::ofstream(path) << text;
    return path;
  }
  json answered(const Arguments& arguments) const {
    Arguments all{"--json"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const CliResult result = domain.cli(all);
    INFO(result.err);
    REQUIRE(result.status == 0);
    return json::parse(result.out);
  }
  double x(const std::string& at, const Arguments& more = {}) const {
    Arguments all{"--json", "lookup", "map", "odom", "--at", at};
    all.insert(all.end(), more.begin(), more.end());
    const CliResult result = domain.cli(all);
    return result.status == 0 ? json::parse(result.out).at("translation").at(0).get<double>() : -1;
  }

  TestDomain domain;
  TemporaryDirectory directory;
  Process daemon;
};

// The time in tenths of metres, each second.
std::string measured() {
  std::string lines = "edge,stamp,x,y,z,qx,qy,qz,qw\n";
  for (int i = 0; i < 6; ++i) {
    lines += "odom," + std::to_string(1'695'000'000 + i) + "," + std::to_string(5 + i) +
             ",0,0,0,0,0,1\n";
  }
  return lines;
}

}  // namespace

TEST_CASE("rewrite: the files and commands of the page, and what a recording then says") {
  const Slam slam;
  const std::string recorded = slam.directory.path() + "/robot.mcap";
  const Process recorder = slam.domain.start_cli({"record", recorded});
  // Samples from before the recorder's watch began are not recorded.
  REQUIRE(eventually([&] {
    return slam.domain.cli({"frames", "--recording", recorded}).out.find("odom") !=
           std::string::npos;
  }));
  slam.write("measured.csv", measured());
  slam.write("corrected.csv", block("csv"));
  std::istringstream lines(block("sh"));
  std::string line;
  REQUIRE(std::getline(lines, line));
  CHECK(line == "tfdude publish measured.csv");
  (void)slam.answered({"publish", slam.directory.path() + "/measured.csv"});
  REQUIRE(eventually([&] { return slam.x("1695000005") == 10; }));
  REQUIRE(eventually([&] { return slam.x("1695000005", {"--recording", recorded}) == 10; }));
  const auto before = std::to_string(
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
  REQUIRE(std::getline(lines, line));
  CHECK(line == "tfdude rewrite odom corrected.csv");
  const json done = slam.answered({"rewrite", "odom", slam.directory.path() + "/corrected.csv"});
  CHECK(done.at("done") == "rewritten");
  CHECK(done.at("samples") == 2);
  CHECK(done.at("from_ns") == 1'695'000'001'000'000'000);
  CHECK(done.at("to_ns") == 1'695'000'002'000'000'000);
  CHECK(slam.x("1695000000") == 5);
  CHECK(slam.x("1695000001.5") == Approx(0.15));
  CHECK(slam.x("1695000003") == 8);

  // The daemon of the page also remembers what was believed.
  CHECK(slam.x("1695000001.5", {"--believed-at", before}) == 6.5);
  CHECK(slam.x("1695000001.5", {"--believed-at", "-0"}) == Approx(0.15));
  CHECK(slam.x("1695000001.5", {"--believed-at", "-3600"}) == -1);

  const auto believed = [&](const std::string& at, const std::string& when) {
    return slam.x(at, {"--recording", recorded, "--believed-at", when});
  };
  // The last line of the page, but with the file of this test.
  REQUIRE(eventually([&] { return believed("1695000001.5", "-0") == Approx(0.15); }));
  CHECK(believed("1695000001.5", before) == 6.5);
  CHECK(believed("1695000000", "-0") == 5);
  CHECK(believed("1695000003.5", "-0") == 8.5);
}

TEST_CASE("rewrite: an interval, lines of JSON from a pipe, and errors that name the line") {
  const Slam slam;
  (void)slam.answered({"publish", slam.write("measured.csv", measured())});
  REQUIRE(eventually([&] { return slam.x("1695000005") == 10; }));
  const std::string one = slam.write(
      "one.jsonl", R"({"edge": "odom", "xyz": [1, 0, 0], "stamp_ns": 1695000003000000000})"
                   "\n");
  (void)slam.answered({"rewrite", "odom", one, "--from", "1695000001", "--to", "1695000004"});
  CHECK(slam.x("1695000003") == 1);
  CHECK(slam.x("1695000004") == Approx((1 + 10) / 2.0));

  const auto why = [&](const std::string& id, const std::string& text) {
    const CliResult result = slam.domain.cli({"rewrite", id, slam.write("wrong.csv", text)});
    CHECK(result.status != 0);
    return result.err;
  };
  const std::string names = "edge,stamp,x,y,z\n";
  CHECK_THAT(why("odom", names + "odom,1695000001,0,0,0\nmap,1695000002,0,0,0\n"),
             ContainsSubstring("wrong.csv, line 3: "));
  CHECK_THAT(why("odom", "edge,x,y,z\nodom,0,0,0\n"), ContainsSubstring("no stamp"));
  CHECK_THAT(why("odom", names), ContainsSubstring("no samples"));
  CHECK_THAT(why("odom", names + "odom,1695000002,0,0,0\nodom,1695000001,0,0,0\n"),
             ContainsSubstring("wrong.csv, line 3: its stamp, ") &&
                 ContainsSubstring(", is not later than ") &&
                 ContainsSubstring(" of the sample before"));
  const auto within = [&](const char* from, const char* to) {
    return slam.domain.cli({"rewrite", "odom", one, "--from", from, "--to", to}).err;
  };
  CHECK_THAT(within("1695000004", "1695000002"),
             ContainsSubstring("--from, ") && ContainsSubstring(", is after --to, "));
  CHECK_THAT(within("1695000004", "1695000005"),
             ContainsSubstring("one.jsonl, line 1: its stamp, ") &&
                 ContainsSubstring(", is before --from, "));
  CHECK_THAT(within("1695000001", "1695000002"), ContainsSubstring(", is after --to, "));
  CHECK_THAT(why("nobody", names + "nobody,1695000001,0,0,0\n"), ContainsSubstring("nobody"));
  CHECK(slam.x("1695000003") == 1);
}

// An observation has corrected a sample of what is rewritten: its covariance is in two parts.
TEST_CASE("rewrite: a replay is no more certain of the past than the recording") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/slam.mcap";
  const auto at = [](double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9)); };
  const Transform X{Pose(), *Covariance::from_stddev({0.01, 0.01, 0.01, 0.01, 0.01, 0.01})};
  {
    auto writer = RecordingWriter::create(file, at(1000));
    REQUIRE(writer);
    const auto add = [&](auto what, double time) {
      REQUIRE(writer->add(PartitionNews{"slam", std::move(what)}, at(time)));
    };
    add(ReachNews{true, ""}, 1000);
    add(FramesNews{{{"map", ""}, {"odom", "map"}}, 5}, 1000);
    add(ValuesNews{1, {{1, at(1000), X, {}, Covariance()}}}, 1000);
    add(ValuesNews{2, {{1, at(1001), X}}}, 1001);
    const CommonError observed{"observed:1", false, Loading::Constant(6, 1, 0.1)};
    const CommonError scale{"scale", false, Loading::Constant(6, 1, 0.2)};
    ValuesNews rewritten{3, {{1, at(1001), X, {false, {scale}, {}}, Covariance()}}};
    rewritten.values[0].kept_before = at(1000.5);
    rewritten.values.push_back({1, at(1001.5), X, {false, {observed}, {"odom"}}});
    add(std::move(rewritten), 1002);
    for (int i = 0; i < 80; ++i) {
      const double time = 1002.5 + 0.1 * i;
      add(ValuesNews{4U + static_cast<unsigned>(i), {{1, at(time), X}}}, time);
    }
    REQUIRE(writer->finish(at(1010)));
  }
  auto recording = Recording::open(file);
  REQUIRE(recording);
  Process replay = domain.start_cli({"replay", file});
  auto client = Client::open(domain.options());
  REQUIRE(client);
  REQUIRE(eventually([&] { return client->parent("odom").has_value(); }));
  Query query;
  query.at = at(1003);
  REQUIRE(client->lookup("map", "odom", query, 20s));
  for (const double time : {1000.25, 1001.0, 1001.5}) {
    query.at = at(time);
    const auto served = client->lookup("map", "odom", query);
    const auto recorded = recording->lookup_at("map", "odom", *query.at, query);
    REQUIRE(served);
    REQUIRE(recorded);
    const auto& a = served->covariance.of_specified().matrix();
    const auto& b = recorded->covariance.of_specified().matrix();
    INFO(time << ": " << a(0, 0) << " and " << b(0, 0));
    CHECK((a - b).cwiseAbs().maxCoeff() < 1e-12);
  }
  replay.signal(SIGINT);
  (void)testing::finish(replay);
}

}  // namespace tfdude
