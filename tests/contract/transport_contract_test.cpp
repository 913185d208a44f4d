// The promises of transport.hpp, over each transport. To check that something does not arrive, a
// test waits for a later event: it would have arrived before that.

#include <future>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/recorder.hpp"

namespace tfdude {
namespace {

using testing::Heard;
using testing::Join;
using testing::joined_by;
using testing::Listener;
using testing::Random;
using testing::sequences;
using testing::Server;
using Numbers = std::set<std::uint32_t>;

Request request(std::uint32_t sequence) { return {sequence, "hand", RemoveRequest{{"hand"}}}; }

// ---- presence and pages

TEST_CASE("presences and pages reach all participants and those that join later") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Listener early(join);
  Server arms(join, "arms", 7);
  Server legs(join, "legs", 8);
  arms.publish(0, 1, {{"arm", "base"}, {"hand", "arm"}});
  arms.publish(1, 2);
  arms.transport->announce({"arms", 7, "tower", 4711, 2, true});
  legs.publish(0, 3, {{"leg", ""}});
  const Listener late(join);
  const auto all_of_arms = [](const Heard& h) {
    const bool announced =
        !h.presences.empty() && std::any_of(h.presences.begin(), h.presences.end(),
                                            [](const Presence& p) { return p.pages == 2; });
    return announced && h.page("arms", 0, 1) && h.page("arms", 1, 2);
  };
  const auto all_of_legs = [](const Heard& h) {
    return h.presence("legs", 8) && h.page("legs", 0, 3);
  };
  CHECK(early.hears(all_of_arms));
  CHECK(early.hears(all_of_legs));
  CHECK(late.hears(all_of_arms));
  CHECK(late.hears(all_of_legs));
  CHECK(legs.hears(all_of_arms));
  CHECK(arms.hears(all_of_legs));

  const Heard heard = late.heard();
  for (const Page& page : heard.pages) {
    if (page.partition != "arms" || page.number != 0) continue;
    CHECK(page.incarnation == 7);
    REQUIRE(page.entries.size() == 2);
    CHECK(page.entries[1].id == "hand");
    CHECK(page.entries[1].parent == "arm");
  }
  for (const Presence& presence : heard.presences) {
    CHECK(presence.host == "tower");
    CHECK(presence.pid == 4711);
    CHECK(presence.serving);
  }
  // A participant does not receive its own messages.
  const Heard by_arms = arms.heard();
  for (const Page& page : by_arms.pages) CHECK(page.partition == "legs");
  for (const Presence& presence : by_arms.presences) CHECK(presence.partition == "legs");
}

TEST_CASE("a participant that joins later receives only the last version of each page") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Server arms(join, "arms");
  for (std::uint64_t epoch = 1; epoch <= 20; ++epoch) {
    arms.publish(static_cast<std::uint32_t>(epoch % 2), epoch);
  }
  arms.transport->announce({"arms", 1, "tower", 4711, 2, true});
  const Listener late(join);
  CHECK(late.hears([](const Heard& h) { return h.page("arms", 0, 20) && h.page("arms", 1, 19); }));
  CHECK(late.hears([](const Heard& h) { return h.presence("arms", 1); }));
  CHECK(late.heard().pages.size() == 2);
  CHECK(late.heard().presences.back().pages == 2);
}

TEST_CASE("a new participant that has discovered all others knows all partitions") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const Server arms(join, "arms");
  const Listener late(join);
  CHECK(late.transport->discovery_time() >= Milliseconds(0));
  const auto end = Listener::soon(testing::Recorder::kLong);
  while (!late.transport->discovered() && std::chrono::steady_clock::now() < end) {
    std::this_thread::yield();
  }
  CHECK(late.transport->discovered());
  CHECK(late.heard().presence("arms", 1));
}

// ---- requests, replies, updates

TEST_CASE("a request reaches only its partition and a reply only the participant that asked") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Server arms(join, "arms", 7);
  Server legs(join, "legs", 8);
  Listener first(join);
  Listener second(join);
  for (std::uint32_t i = 1; i <= 20; ++i) REQUIRE(first.ask("arms", request(i)));
  REQUIRE(second.ask("arms", request(101)));
  REQUIRE(second.ask("legs", request(102)));
  REQUIRE(legs.ask("arms", request(201)));
  REQUIRE(arms.ask("legs", request(202)));
  REQUIRE(first.ask("legs", request(21)));

  CHECK(sequences(legs.heard().requests) == Numbers{21, 102, 202});
  const Numbers by_arms = sequences(arms.heard().requests);
  CHECK(by_arms.size() == 22);
  CHECK(by_arms.count(101) + by_arms.count(201) == 2);
  CHECK(sequences(second.heard().replies) == Numbers{101, 102});
  CHECK(sequences(legs.heard().replies) == Numbers{201});
  CHECK(sequences(arms.heard().replies) == Numbers{202});
  const Heard heard = first.heard();
  CHECK(sequences(heard.replies).size() == 21);
  for (const Reply& reply : heard.replies) CHECK(reply.epoch == (reply.sequence == 21 ? 8 : 7));
  CHECK(heard.requests.empty());
}

TEST_CASE("an update reaches only the partition that it is sent to") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Random random(0x7a45);
  const Server arms(join, "arms", 1, {"arm", "hand"});
  const Server legs(join, "legs", 1, {"leg"});
  const Listener sender(join);
  const Transform X = random.transform();
  const auto end = Listener::soon(testing::Recorder::kLong);
  REQUIRE(sender.transport->send("arms", Update{{{"hand", X}, {"arm", {}}}}, end));
  REQUIRE(sender.transport->send("legs", Update{{{"leg", X}}}, end));
  CHECK(arms.hears([](const Heard& h) { return h.updates.size() == 1; }));
  CHECK(legs.hears([](const Heard& h) { return h.updates.size() == 1; }));
  const Heard heard = arms.heard();
  REQUIRE(heard.updates.front().edges.size() == 2);
  CHECK(heard.updates.front().edges[0].id == "hand");
  CHECK(testing::transform_diff(heard.updates.front().edges[0].X_PC, X, 1e-15) == "");
  CHECK(legs.heard().updates.front().edges.front().id == "leg");
  CHECK(heard.updates.size() == 1);
  CHECK(sender.heard().updates.empty());
}

TEST_CASE("joint positions reach only the partition that they are sent to") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const Server arms(join, "arms", 1, {}, {"elbow"});
  const Server legs(join, "legs", 1, {}, {"knee"});
  const Listener sender(join);
  const JointUpdate update{{{"elbow", 0.5, 1e-4}, {"knee", -2, 0}}, time_of(77)};
  REQUIRE(sender.transport->send("arms", update, Listener::soon(testing::Recorder::kLong)));
  CHECK(arms.hears([](const Heard& h) { return h.joints.size() == 1; }));
  const JointUpdate heard = arms.heard().joints.at(0);
  CHECK(heard.joints.at(0).name == "elbow");
  CHECK(heard.joints.at(0).position == 0.5);
  CHECK(heard.joints.at(0).variance == 1e-4);
  CHECK(heard.stamp == time_of(77));
  CHECK(legs.heard().joints.empty());
}

TEST_CASE("sending to a partition that nobody serves times out and names it") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const Server arms(join, "arms");
  const Listener sender(join);
  const auto check_timeout = [](const Result<void>& sent) {
    REQUIRE_FALSE(sent);
    CHECK(sent.error().code == Errc::kTimeout);
    CHECK(sent.error().message.find("'wings'") != std::string::npos);
  };
  sender.transport->prepare("wings");
  check_timeout(sender.transport->send("wings", request(1), Listener::soon(Milliseconds(50))));
  check_timeout(sender.transport->send("wings", Update{}, Listener::soon(Milliseconds(50))));
  check_timeout(sender.transport->send("wings", request(1), Transport::Deadline{}));
}

TEST_CASE("a request waits until its partition is served") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Listener asker(join);
  bool answered = false;
  std::promise<void> begins;
  std::thread asking([&] {
    begins.set_value();
    answered = asker.ask("arms", request(1));
  });
  begins.get_future().wait();
  const Server arms(join, "arms");
  asking.join();
  CHECK(answered);
}

TEST_CASE("a reply to an unknown peer has no effect") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Server arms(join, "arms");
  Listener asker(join);
  arms.transport->reply(PeerId{1, 2, 3}, {5, 5, Done{}});
  REQUIRE(asker.ask("arms", request(1)));
  CHECK(sequences(asker.heard().replies) == Numbers{1});
}

// ---- leaving

TEST_CASE("the loss of a server reaches all and new participants never hear of that server") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Server arms(join, "arms", 7);
  const Server legs(join, "legs", 8);
  const Listener client(join);
  const auto arms_there = [](const Heard& h) { return h.presence("arms", 7); };
  REQUIRE(client.hears(arms_there));
  REQUIRE(legs.hears(arms_there));
  arms.transport->stop();
  const auto arms_gone = [](const Heard& h) { return h.loss("arms", 7); };
  CHECK(client.hears(arms_gone));
  CHECK(legs.hears(arms_gone));
  const Listener late(join);
  CHECK(late.hears([](const Heard& h) { return h.presence("legs", 8); }));
  CHECK_FALSE(late.heard().presence("arms", 7));
  const Heard heard = client.heard();
  for (const auto& [partition, incarnation] : heard.lost) CHECK(partition == "arms");
}

TEST_CASE("a partition can be served again after its server has gone") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Listener client(join);
  {
    const Server former(join, "arms", 1);
    REQUIRE(client.ask("arms", request(1)));
    REQUIRE(client.hears([](const Heard& h) { return h.presence("arms", 1); }));
  }
  REQUIRE(client.hears([](const Heard& h) { return h.loss("arms", 1); }));
  Server next(join, "arms", 2);
  next.publish(0, 1);
  CHECK(client.hears([](const Heard& h) { return h.presence("arms", 2) && h.page("arms", 0, 1); }));
  CHECK(client.ask("arms", request(2)));
  CHECK(client.heard().replies.back().epoch == 2);
  CHECK_FALSE(client.heard().loss("arms", 2));
}

TEST_CASE("a transport can be stopped repeatedly and before it was started") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const auto idle = join("");
  idle->stop();
  Listener client(join);
  client.transport->stop();
  client.transport->stop();
}

// ---- size and order

TEST_CASE("messages of the largest size arrive whole") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Random random(0xb16);
  INFO("seed " << random.seed());
  const auto long_id = [](std::size_t i) {
    const std::string number = std::to_string(i);
    return std::string(255 - number.size(), 'f') + number;
  };
  std::set<std::string, std::less<>> frames;
  Update update;
  for (std::size_t i = 0; i < 4096; ++i) {
    update.edges.push_back({long_id(i), random.transform()});
    frames.insert(update.edges.back().id);
  }
  Server arms(join, "arms", 1, frames);
  Listener client(join);
  std::vector<PageEntry> entries;
  for (std::size_t i = 0; i < 60; ++i) entries.push_back({long_id(i), long_id(i + 1)});
  arms.publish(0, 1, entries);
  REQUIRE(client.hears([](const Heard& h) { return h.page("arms", 0, 1); }));
  const Heard heard = client.heard();
  REQUIRE(heard.pages.front().entries.size() == 60);
  CHECK(heard.pages.front().entries[59].parent == long_id(60));

  const auto end = Listener::soon(testing::Recorder::kLong);
  const auto sent = client.transport->send("arms", update, end);
  INFO((sent ? "sent" : sent.error().message));
  REQUIRE(sent);
  CHECK(arms.hears([](const Heard& h) { return h.updates.size() == 1; }));
  CHECK(client.ask("arms", {1, update.edges[0].id, UpdateRequest{update.edges}}));
  const Heard by_arms = arms.heard();
  REQUIRE(by_arms.updates.size() == 1);
  REQUIRE(by_arms.updates[0].edges.size() == 4096);
  CHECK(by_arms.updates[0].edges[4095].id == long_id(4095));
  CHECK(testing::transform_diff(by_arms.updates[0].edges[4095].X_PC, update.edges[4095].X_PC,
                                1e-15) == "");
  CHECK(std::get<UpdateRequest>(by_arms.requests.at(0).body).edges.size() == 4096);
}

TEST_CASE("pages of one sender arrive in order and the last version of each arrives") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const Listener client(join);
  Server arms(join, "arms");
  REQUIRE(client.hears([](const Heard& h) { return h.presence("arms", 1); }));
  // Large enough that some are lost on the way, and arrive later or not at all.
  const std::vector<PageEntry> entries(60, PageEntry{std::string(255, 'i'), std::string(255, 'p')});
  constexpr std::uint64_t kLast = 600;
  for (std::uint64_t epoch = 1; epoch <= kLast; ++epoch) {
    arms.publish(static_cast<std::uint32_t>(epoch % 3), epoch, entries);
  }
  for (std::uint64_t epoch = kLast - 2; epoch <= kLast; ++epoch) {
    CHECK(client.hears([epoch](const Heard& h) {
      return h.page("arms", static_cast<std::uint32_t>(epoch % 3), epoch);
    }));
  }
  const Heard heard = client.heard();
  for (std::size_t i = 1; i < heard.pages.size(); ++i) {
    INFO("page " << i << " of " << heard.pages.size());
    CHECK(heard.pages[i - 1].epoch < heard.pages[i].epoch);
  }
}

}  // namespace
}  // namespace tfdude
