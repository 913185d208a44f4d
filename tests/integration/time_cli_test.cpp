// Time on the command line, with real daemons.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/thesis_json.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::answered;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::in_time;
using testing::Process;
using testing::text;
using testing::ThesisDaemons;
using Arguments = std::vector<std::string>;

void sample(const ThesisDaemons& d, const std::string& id, const std::string& x,
            const std::string& stamp) {
  CHECK(text(d, {"update", id, "--xyz", x, "0", "0", "--rpy", "0", "0", "0", "--stamp", stamp}) ==
        "updated " + id + "\n");
}

}  // namespace

TEST_CASE("time: samples are stamped, and looked up at an instant") {
  const ThesisDaemons d;
  sample(d, "arm_1", "1", "100.000000001");
  sample(d, "arm_1", "2", "101.000000001");
  const json between = answered(d, {"lookup", "robot_1", "arm_1", "--at", "100.500000001"});
  CHECK(between.at("translation").at(0).get<double>() == testing::Approx(1.5));
  CHECK(between.at("stamp_ns") == 100'500'000'001);
  const json newest = answered(d, {"lookup", "robot_1", "arm_1"});
  CHECK(newest.at("stamp_ns") == 101'000'000'001);
  CHECK(answered(d, {"lookup", "world", "camera"}).at("stamp").is_null());
  CHECK_THAT(text(d, {"lookup", "robot_1", "arm_1", "--at", "100.25"}),
             ContainsSubstring("stamp        100.250000000  ("));
  const json early = answered(d, {"lookup", "world", "hand_left", "--at", "99.5"}, 1);
  CHECK(early.at("error").at("code") == "too_old");
  CHECK_THAT(early.at("error").at("message").get<std::string>(),
             ContainsSubstring("'arm_1'") && ContainsSubstring("500.000 ms"));
  const json late = answered(d, {"lookup", "world", "hand_left", "--at", "101.1"}, 1);
  CHECK(late.at("error").at("code") == "not_yet");
  const json beyond =
      answered(d, {"lookup", "robot_1", "arm_1", "--at", "101.1", "--extrapolate", "100"});
  CHECK(beyond.at("translation").at(0).get<double>() == testing::Approx(2.1));
  CHECK(answered(d, {"lookup", "robot_1", "arm_1", "--at", "101.2", "--extrapolate", "100"}, 1)
            .at("error")
            .at("code") == "not_yet");
  const json travelled = answered(d, {"lookup", "arm_1", "arm_1", "--fixed", "world", "--at",
                                      "100.000000001", "--at-b", "101.000000001"});
  CHECK(travelled.at("translation").at(0).get<double>() == testing::Approx(1.0));
}

TEST_CASE("time: a negative stamp counts back from now") {
  const ThesisDaemons d;
  sample(d, "arm_1", "5", "-2");
  sample(d, "arm_1", "5", "-1");
  CHECK(answered(d, {"lookup", "robot_1", "arm_1", "--at", "-1.5"}).at("translation").at(0) == 5.0);
  CHECK(answered(d, {"lookup", "robot_1", "arm_1", "--at", "-0"}, 1).at("error").at("code") ==
        "not_yet");
  const auto start = std::chrono::steady_clock::now();
  const CliResult waited =
      d.domain.cli({"lookup", "robot_1", "arm_1", "--at", "-0", "--wait", "300"});
  CHECK(waited.status == 1);
  CHECK(std::chrono::steady_clock::now() - start >= std::chrono::milliseconds(300));
}

TEST_CASE("time: an invalid stamp is rejected before anything is sent") {
  const ThesisDaemons d;
  for (const char* stamp : {"", "x", "1.2.3", "--", "99999999999", "1 2"}) {
    INFO(stamp);
    CHECK(d.domain.cli({"update", "arm_1", "--stamp", stamp}).status == 2);
    CHECK(d.domain.cli({"lookup", "world", "arm_1", "--at", stamp}).status == 2);
  }
  CHECK(d.domain.cli({"lookup", "world", "arm_1", "--extrapolate", "-1"}).status == 2);
  CHECK(d.domain.cli({"lookup", "world", "arm_1", "--at-b", "1"}).status == 2);
  CHECK_THAT(text(d, {"history", "arm_1"}), ContainsSubstring("arm_1 is static"));
}

TEST_CASE("time: the velocity of a frame is shown with its standard deviations") {
  const ThesisDaemons d;
  // 2 m/s along x, and all edges but this one are static.
  for (const char* sample : {"100", "101", "102"}) {
    const std::string x = std::to_string(2 * std::stoi(sample));
    CHECK(text(d, {"update", "arm_1", "--xyz", x, "0", "0", "--rpy", "0", "0", "0", "--stddev",
                   "0.01", "0.01", "0.01", "0", "0", "0", "--stamp", sample}) == "updated arm_1\n");
  }
  const json velocity =
      answered(d, {"velocity", "robot_1", "arm_1", "--at", "101", "--over", "0.5"});
  CHECK(velocity.at("linear").at(0).get<double>() == testing::Approx(2));
  CHECK(velocity.at("angular") == json({0.0, 0.0, 0.0}));
  CHECK(velocity.at("begin_ns") == 100'750'000'000);
  CHECK(velocity.at("end_ns") == 101'250'000'000);
  // The bound: twice the error of one end, per half a second.
  CHECK(std::sqrt(velocity.at("covariance").at(0).at(0).get<double>()) ==
        testing::Approx(2 * 0.01 / 0.5).epsilon(1e-6));
  CHECK(velocity.at("basis").at("bound") == true);
  const std::string shown = text(d, {"velocity", "world", "hand_left", "--cov"});
  CHECK_THAT(shown, ContainsSubstring("linear       ") && ContainsSubstring("m/s\n") &&
                        ContainsSubstring("to           102.000000000\n") &&
                        ContainsSubstring("covariance   (linear first"));
  CHECK_THAT(text(d, {"velocity", "world", "camera"}), ContainsSubstring("all edges are static"));
  CHECK(answered(d, {"velocity", "world", "arm_1", "--at", "103"}, 1).at("error").at("code") ==
        "not_yet");
  CHECK(answered(d, {"velocity", "world", "nobody"}, 1).at("error").at("code") == "unknown_end");
  CHECK(d.domain.cli({"velocity", "world", "arm_1", "--over", "0"}).status == 2);
}

TEST_CASE("time: histories and rates are shown with the rejected samples") {
  const ThesisDaemons d;
  for (int i = 0; i < 5; ++i) sample(d, "arm_1", "1", std::to_string(100 + i));
  CHECK(answered(d, {"update", "arm_1", "--stamp", "102"}, 1).at("error").at("code") ==
        "stamp_taken");
  CHECK(answered(d, {"update", "arm_1", "--stamp", "90"}, 1).at("error").at("code") == "too_old");
  CHECK(answered(d, {"update", "arm_1", "--stamp", "9e9"}, 1).at("error").at("code") ==
        "invalid_input");
  const json history = answered(d, {"history", "arm_1"});
  CHECK(history.at("refused_ahead") == 1);
  CHECK(history.at("samples") == 5);
  CHECK(history.at("span") == 4.0);
  CHECK(history.at("rate") == 1.0);
  CHECK(history.at("max_gap") == 1.0);
  CHECK(history.at("refused_old") == 1);
  CHECK(history.at("refused_equal") == 1);
  CHECK_THAT(text(d, {"history", "arm_1"}), ContainsSubstring("samples      5 of at most 10240") &&
                                                ContainsSubstring("rate         1.000 Hz"));
  CHECK(answered(d, {"history", "nobody"}, 1).at("error").at("code") == "unknown_frame");
  CHECK(answered(d, {"update", "hand_left", "--stamp", "9e9"}, 1).at("error").at("code") ==
        "invalid_input");
  CHECK_THAT(text(d, {"history", "hand_left"}),
             ContainsSubstring("hand_left is static") && ContainsSubstring("1 too far ahead"));
  const json monitor = answered(d, {"monitor", "--once"});
  CHECK(monitor.at("partitions").at(0).at("edges").at(0).at("id") == "arm_1");
  CHECK(monitor.at("partitions").at(1).at("edges").empty());
  CHECK_THAT(text(d, {"monitor", "--once"}), ContainsSubstring("arm_1"));
  const json partitions = answered(d, {"partitions"});
  CHECK(partitions.at("partitions").at(0).at("samples") == 5);
  CHECK(partitions.at("partitions").at(0).at("history_bytes") > 1000);
  CHECK_THAT(text(d, {"partitions"}), ContainsSubstring(" 5      1.2 KiB"));
}

TEST_CASE("time: a clock that jumps back restarts the history and the daemon logs it") {
  ThesisDaemons d;
  for (const char* stamp : {"1000", "1001", "1002"}) sample(d, "arm_1", "1", stamp);
  // The fifth in a row is believed.
  for (const char* stamp : {"100", "101", "102", "103"}) {
    CHECK(answered(d, {"update", "arm_1", "--xyz", "2", "0", "0", "--stamp", stamp}, 1)
              .at("error")
              .at("code") == "too_old");
  }
  sample(d, "arm_1", "2", "104");
  sample(d, "arm_1", "3", "105");
  CHECK(answered(d, {"history", "arm_1"}).at("samples") == 2);
  d.arms->signal(SIGTERM);
  REQUIRE(d.arms->wait(in_time()));
  CHECK_THAT(d.arms->err(),
             ContainsSubstring("frame 'arm_1' of partition 'arms': history restarted") &&
                 ContainsSubstring("jumped back"));
}

TEST_CASE("time: watch shows what is written and follows a frame that is moved") {
  const ThesisDaemons d;
  Process watch = d.domain.start_cli({"--json", "watch", "world", "hand_left", "--rate", "100"});
  REQUIRE(watch.wait_for_line("{\"basis", in_time()));
  sample(d, "arm_1", "1", "100");
  REQUIRE(eventually([&] {
    (void)watch.runs();
    return watch.out().find("\"stamp_ns\":100000000000") != std::string::npos;
  }));
  CHECK(text(d, {"move", "hand_left", "--parent", "camera", "--xyz", "0", "0", "7"}) ==
        "moved hand_left\n");
  CHECK(eventually([&] {
    (void)watch.runs();
    const auto line = watch.out().rfind("{\"basis");
    return line != std::string::npos &&
           watch.out().find("\"partitions\":[\"robot\",\"arms\"],", line) != std::string::npos &&
           watch.out().find("\"stamp_ns\":null", line) != std::string::npos;
  }));
  watch.signal(SIGINT);
  CHECK(watch.wait(in_time()) == 0);
  Process echo = d.domain.start_cli({"echo", "world", "hand_left", "--rate", "50"});
  REQUIRE(echo.wait_for_line("age       none", in_time()));
  echo.signal(SIGINT);
  CHECK(echo.wait(in_time()) == 0);
}

TEST_CASE("cli: watch and echo say once why there is nothing to show") {
  const ThesisDaemons d;
  const std::string command = GENERATE("watch", "echo");
  CAPTURE(command);
  Process watch = d.domain.start_cli({command, "world", "probe", "--rate", "50"});
  const auto complaints = [&] {
    (void)watch.runs();
    return std::count(watch.err().begin(), watch.err().end(), '\n');
  };
  REQUIRE(eventually([&] { return complaints() > 0 && watch.err().find("'probe'") < 1000; }));
  const auto before = complaints();
  // Long enough for it to be repeated before the frame is there.
  CHECK(d.domain.cli({"exists", "probe"}).status == 1);
  CHECK(text(d, {"add", "probe", "--parent", "world"}) == "added probe\n");
  REQUIRE(watch.wait_for_line(command == "watch" ? "translation" : "probe seen", in_time()));
  CHECK(complaints() == before);
  CHECK(text(d, {"remove", "probe"}) == "removed probe\n");
  CHECK(eventually([&] { return complaints() > before; }));
  watch.signal(SIGINT);
  CHECK(watch.wait(in_time()) == 0);
}

TEST_CASE("cli: tree and lookup are redrawn until interrupted") {
  const ThesisDaemons d;
  Process tree = d.domain.start_cli({"tree", "--watch"});
  REQUIRE(tree.wait_for_line("world  [robot]", in_time()));
  REQUIRE(d.domain.cli({"remove", "hand_left"}).status == 0);
  CHECK(eventually([&] {
    (void)tree.runs();
    const auto last = tree.out().rfind("world  [robot]");
    const auto end = tree.out().find("[robot]\n\n", last + 10);
    return end != std::string::npos && tree.out().find("hand_left", last) == std::string::npos;
  }));
  tree.signal(SIGINT);
  CHECK(tree.wait(in_time()) == 0);
  Process lookup = d.domain.start_cli({"lookup", "world", "camera", "--watch"});
  REQUIRE(lookup.wait_for_line("camera in world", in_time()));
  REQUIRE(lookup.wait_for_line("camera in world", in_time()));
  lookup.signal(SIGINT);
  CHECK(lookup.wait(in_time()) == 0);
  CHECK(d.domain.cli({"lookup", "world", "camera", "--watch", "--at", "1"}).status == 2);
}

}  // namespace tfdude
