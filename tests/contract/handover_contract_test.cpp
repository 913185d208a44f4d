// Frames are handed over from one owner to another, over each transport: what readers, the owners
// and later participants have.

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "support/arms.hpp"
#include "support/joint_frames.hpp"

namespace tfdude {
namespace {

using testing::agree;
using testing::along_x;
using testing::Arms;
using testing::check_writable;
using testing::ContainsSubstring;
using testing::difference;
using testing::eventually;
using testing::is_settled;
using testing::Join;
using testing::joined_by;
using testing::kEnd;
using testing::long_history;
using testing::ms;
using testing::outcome;
using testing::owner_of;
using testing::query;
using testing::Random;
using testing::seen;

}  // namespace

TEST_CASE("handover: values, histories and correlations are the same at the new owner") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto before = seen(*arms.client);
  REQUIRE(arms.client->hand_over("gripper", "arm2"));
  for (const char* id : {"gripper", "finger", "pad"}) CHECK(owner_of(*arms.client, id) == "arm2");
  CHECK(owner_of(*arms.client, "camera") == "eye");
  CHECK(owner_of(*arms.client, "flange1") == "arm1");
  REQUIRE(is_settled(arms, "arm2"));
  for (Client* one : arms.clients()) CHECK(difference(seen(*one), before) == "");
  const auto history = arms.client->history("finger").value().at(0);
  CHECK(history.samples == kEnd / 10 + 1);
  CHECK(history.count_limit == 100'000);
  // The history goes on there.
  REQUIRE(arms.arm2->update("finger", along_x(4), ms(4000)));
  CHECK(testing::x_of(arms.client->lookup("gripper", "finger")) == 4);
  REQUIRE(arms.arm1->update("finger", along_x(5), ms(5000)));
  CHECK(testing::x_of(arms.client->lookup("gripper", "finger")) == 5);
  check_writable(arms, 7);
  // One who comes later finds the same.
  Client late = Client::open(arms.join("")).value();
  CHECK(owner_of(late, "finger") == "arm2");
  CHECK(testing::x_of(late.lookup("gripper", "finger")) == 5);
  ClientOptions asks;
  asks.follow.emplace();
  Client follower = Client::open(arms.join(""), asks).value();
  REQUIRE(follower.hand_over("gripper", "arm1", "base1"));
  CHECK(follower.parent("gripper").value() == "base1");
  CHECK(eventually([&] { return owner_of(*arms.client, "gripper") == "arm1"; }));
  REQUIRE(arms.client->hand_over("gripper", "arm2"));
  REQUIRE(arms.client->remove("gripper"));
  CHECK_FALSE(arms.client->exists("pad"));
  CHECK(eventually([&] { return !arms.arm1->exists("gripper"); }));
}

TEST_CASE("handover: to another parent in the same step") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto finger = arms.client->lookup("gripper", "finger", query(1234)).value();
  REQUIRE(arms.client->hand_over("gripper", "arm2", "flange2", along_x(2)));
  REQUIRE(is_settled(arms, "arm2"));
  for (Client* one : arms.clients()) {
    CHECK(one->parent("gripper").value() == "flange2");
    CHECK(testing::x_of(one->lookup("flange2", "gripper")) == 2);
    CHECK(testing::transform_diff(one->lookup("gripper", "finger", query(1234)).value(), finger,
                                  1e-9) == "");
  }
  // An owner itself takes it back, with its value.
  REQUIRE(arms.arm1->hand_over("gripper", "arm1", "flange1"));
  REQUIRE(is_settled(arms, "arm1"));
  for (Client* one : arms.clients()) CHECK(testing::x_of(one->lookup("flange1", "gripper")) == 2);
  // There is nothing to do but to move it, and nothing to wait for.
  const auto begin = std::chrono::steady_clock::now();
  REQUIRE(arms.client->hand_over("gripper", "arm1"));
  REQUIRE(arms.client->hand_over("gripper", "arm1", "base1"));
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(2));
  CHECK(arms.client->parent("gripper").value() == "base1");
  REQUIRE(arms.arm1->hand_over("gripper", "arm2"));
  REQUIRE(is_settled(arms, "arm2"));
}

TEST_CASE("handover: readers find the same values all the time") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto before = arms.client->lookup("base1", "pad").value();
  const auto past = arms.client->lookup("base1", "camera").value();
  std::atomic<bool> over{false};
  std::atomic<int> reads{0};
  std::vector<std::string> wrong(4);
  std::vector<std::thread> readers;
  auto clients = arms.clients();
  for (std::size_t i = 0; i < clients.size(); ++i) {
    readers.emplace_back([&, i] {
      while (!over && wrong[i].empty()) {
        ++reads;
        const auto X = clients[i]->lookup("base1", "pad");
        wrong[i] =
            X ? testing::transform_diff(*X, before, 1e-9) : outcome(X) + ": " + X.error().message;
        const auto Y = clients[i]->lookup("base1", "camera");
        if (wrong[i].empty()) {
          wrong[i] =
              Y ? testing::transform_diff(*Y, past, 1e-9) : outcome(Y) + ": " + Y.error().message;
        }
      }
    });
  }
  int done = 0;
  std::string failed;
  for (; done < 100 && failed.empty(); ++done) {
    const std::string to = done % 2 == 0 ? "arm2" : "arm1";
    const auto handed = arms.client->hand_over("gripper", to);
    if (!handed) failed = outcome(handed) + ": " + handed.error().message;
    if (failed.empty() && !is_settled(arms, to)) failed = "not all have heard of it";
  }
  over = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(failed.empty());
  INFO(failed);
  CHECK(done == 100);
  for (const std::string& what : wrong) CHECK(what == "");
  CHECK(reads > 200);
  REQUIRE(is_settled(arms, "arm1"));
  check_writable(arms, 3);
}

TEST_CASE("handover: what observations have found goes along") {
  const int transport = GENERATE(from_range(testing::networks()));
  // The same twice, once with a handover between two observations.
  std::vector<std::vector<Transform>> ends;
  for (const bool hands : {false, true}) {
    Arms arms(joined_by(transport));
    Random random(77);
    const auto measure = [&](const char* a, const char* b) {
      Transform X = arms.client->lookup(a, b).value().transform();
      X.covariance = random.covariance();
      const auto seen = arms.client->observe(a, b, X);
      INFO(outcome(seen) << (seen ? "" : ": " + seen.error().message));
      REQUIRE(seen);
    };
    measure("base1", "pad");
    measure("base2", "pad");
    if (hands) {
      const auto before = seen(*arms.client);
      REQUIRE(arms.client->hand_over("gripper", "arm2"));
      REQUIRE(is_settled(arms, "arm2"));
      CHECK(difference(seen(*arms.client), before) == "");
    }
    measure("base1", "pad");
    measure("base2", "gripper");
    ends.push_back(seen(*arms.client));
  }
  CHECK(difference(ends[1], ends[0]) == "");
}

TEST_CASE("handover: an edge that drifts keeps its rows") {
  std::vector<std::vector<Transform>> ends;
  for (const bool hands : {false, true}) {
    const Join join = testing::join_loopback();
    Random random(5);
    EdgeTiming timing = long_history();
    timing.drifts = true;
    timing.process_noise = random.covariance();
    FrameSpec odom{"odom", "map", {}};
    odom.timing = timing;
    Node first = Node::open(join("first"), "first", {{"map", "", {}}, odom}).value();
    Node second = Node::open(join("second"), "second", {}).value();
    Client client = Client::open(join("")).value();
    REQUIRE(client.exists("odom"));
    for (std::int64_t t = 0; t <= 1000; t += 10) {
      REQUIRE(first.update("odom", along_x(0.001 * static_cast<double>(t)), ms(t)));
    }
    const auto measure = [&](std::int64_t t) {
      Transform X = client.lookup("map", "odom", query(t)).value().transform();
      X.covariance = random.covariance();
      const auto seen = client.observe("map", "odom", X, ms(t));
      INFO(outcome(seen) << (seen ? "" : ": " + seen.error().message));
      REQUIRE(seen);
    };
    for (const std::int64_t t : {300, 500, 400, 800}) measure(t);
    if (hands) REQUIRE(client.hand_over("odom", "second"));
    for (const std::int64_t t : {700, 1000}) measure(t);
    REQUIRE(client.update("odom", along_x(2), ms(2000)));
    measure(2000);
    ends.emplace_back();
    for (const std::int64_t t : {0, 300, 350, 500, 650, 700, 800, 1000, 1500, 2000}) {
      ends.back().push_back(client.lookup("map", "odom", query(t)).value());
    }
  }
  CHECK(difference(ends[1], ends[0]) == "");
}

TEST_CASE("handover: what cannot be handed over is refused, and nothing changes") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto before = seen(*arms.client);
  const auto why = [&](const Result<void>& done) {
    return done ? "done" : outcome(done) + ": " + done.error().message;
  };
  Client& client = *arms.client;
  CHECK_THAT(why(client.hand_over("nothing", "arm2")), ContainsSubstring("unknown_frame"));
  CHECK_THAT(why(client.hand_over("gripper", "arm3")), ContainsSubstring("unknown_partition"));
  CHECK_THAT(why(client.hand_over("gripper", "arm2", "nothing")),
             ContainsSubstring("unknown_parent"));
  CHECK_THAT(why(client.hand_over("gripper", "arm2", "pad")), ContainsSubstring("cycle"));
  CHECK_THAT(why(client.hand_over("gripper", "arm2", "camera")), ContainsSubstring("cycle"));
  const FrameSpec turned = testing::moved_by("turned", "wrist", testing::revolute_named("turn"));
  Node third = Node::open(arms.join("arm3"), "arm3", {{"wrist", "base1", {}}, turned}).value();
  REQUIRE(eventually([&] { return client.exists("turned"); }));
  CHECK_THAT(why(client.hand_over("wrist", "arm2")),
             ContainsSubstring("invalid_input") && ContainsSubstring("moved by a joint"));
  CHECK(owner_of(client, "wrist") == "arm3");
  CHECK(difference(seen(client), before) == "");
  check_writable(arms, 3);
}

TEST_CASE("handover: as many samples as may go at once, and no more") {
  const Join join = testing::join_loopback();
  FrameSpec odom{"odom", "map", {}};
  odom.timing = long_history();
  Node first = Node::open(join("first"), "first", {{"map", "", {}}, odom}).value();
  Node second = Node::open(join("second"), "second", {}).value();
  Options patient;  // on a busy computer
  patient.timeout = std::chrono::seconds(10);
  Client client = Client::open(join(""), patient).value();
  REQUIRE(client.exists("odom"));
  for (std::int64_t t = 0; t < 65'536; ++t)
    REQUIRE(first.update("odom", along_x(static_cast<double>(t)), ms(t)));
  REQUIRE(client.hand_over("odom", "second"));
  CHECK(client.history("odom").value().at(0).samples == 65'536);
  for (const std::int64_t t : {0, 1, 255, 256, 257, 30'000, 65'535}) {
    CHECK(testing::x_of(client.lookup("map", "odom", query(t))) == static_cast<double>(t));
  }
  REQUIRE(second.update("odom", along_x(0), ms(65'536)));
  const auto done = client.hand_over("odom", "first");
  REQUIRE_FALSE(done);
  CHECK(done.error().code == Errc::kTooMuch);
  REQUIRE(second.update("odom", along_x(0), ms(65'537)));
}

TEST_CASE("handover: of several at once each ends, and one owner has the frame") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto before = arms.client->lookup("base1", "pad").value();
  std::vector<std::thread> threads;
  std::atomic<int> done{0};
  const std::vector<std::string> targets{"arm1", "arm2", "eye", "arm2"};
  auto clients = arms.clients();
  for (std::size_t i = 0; i < clients.size(); ++i) {
    threads.emplace_back([&, i] {
      for (int round = 0; round < 5; ++round) {
        if (clients[i]->hand_over("gripper", targets[i])) ++done;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(done > 0);
  REQUIRE(eventually([&] { return agree(arms, owner_of(*arms.client, "gripper")); }));
  for (Client* one : clients) {
    CHECK(testing::transform_diff(one->lookup("base1", "pad").value(), before, 1e-9) == "");
  }
  check_writable(arms, 3);
}

TEST_CASE("handover: watched paths and streams go on with the new owner") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  PathWatch watch = arms.client->watch("flange1", "finger").value();
  EdgeStream stream = arms.client->stream({"finger"}).value();
  const auto before = watch.latest().value();
  REQUIRE(arms.client->hand_over("gripper", "arm2"));
  REQUIRE(is_settled(arms, "arm2"));
  // For a moment it may say that it changes its route.
  CHECK(eventually([&] {
    const auto X = watch.latest();
    return X && testing::transform_diff(*X, before, 1e-9).empty();
  }));
  std::int64_t t = kEnd;
  CHECK(eventually([&] {
    t += 10;
    (void)stream.try_publish({along_x(9)}, ms(t));
    const auto X = arms.client->lookup("gripper", "finger");
    return X && X->pose.translation().x() == 9;
  }));
  const auto expected = arms.client->lookup("flange1", "finger").value();
  CHECK(eventually([&] {
    const auto X = watch.latest();
    return X && testing::transform_diff(*X, expected, 1e-9).empty();
  }));
  const auto then = arms.client->lookup("flange1", "finger", query(kEnd)).value();
  CHECK(testing::transform_diff(then, before, 1e-9) == "");
}

}  // namespace tfdude
