// What transport.hpp promises to several threads at once, over each transport.

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/recorder.hpp"

namespace tfdude {
namespace {

using testing::Heard;
using testing::Join;
using testing::joined_by;
using testing::Listener;
using testing::sequences;
using testing::Server;

Request request(std::uint32_t sequence) { return {sequence, "hand", RemoveRequest{{"hand"}}}; }

/// Runs something over and over in a thread of its own.
class Repeating {
 public:
  template <class Action>
  explicit Repeating(Action action)
      : thread_([this, action] {
          for (std::uint32_t round = 1; !done_; ++round) {
            action(round);
            rounds_ = round;
          }
        }) {}
  ~Repeating() {
    done_ = true;
    thread_.join();
  }
  Repeating(const Repeating&) = delete;
  Repeating& operator=(const Repeating&) = delete;

  [[nodiscard]] std::uint32_t rounds() const { return rounds_; }

 private:
  std::atomic<bool> done_{false};
  std::atomic<std::uint32_t> rounds_{0};
  std::thread thread_;  // last: uses the others
};

TEST_CASE("each of many askers of many servers gets its own replies") {
  const Join join = joined_by(GENERATE(0, 1));
  constexpr std::uint32_t kAskers = 3;
  constexpr std::uint32_t kThreads = 2;
  constexpr std::uint32_t kRequests = 50;
  const Server arms(join, "arms", 1);
  const Server legs(join, "legs", 2);
  std::vector<std::unique_ptr<Listener>> askers;
  for (std::uint32_t i = 0; i < kAskers; ++i) askers.push_back(std::make_unique<Listener>(join));
  std::atomic<std::uint32_t> unanswered{0};
  std::vector<std::thread> threads;
  for (std::uint32_t n = 0; n < kAskers * kThreads; ++n) {
    threads.emplace_back([&, n] {
      for (std::uint32_t i = 0; i < kRequests; ++i) {
        // Even numbers are for the arms, so that a reply shows whose it is.
        const std::uint32_t sequence = n * kRequests + i;
        const char* partition = sequence % 2 == 0 ? "arms" : "legs";
        if (!askers[n / kThreads]->ask(partition, request(sequence))) ++unanswered;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(unanswered == 0);
  for (std::uint32_t i = 0; i < kAskers; ++i) {
    const Heard heard = askers[i]->heard();
    const auto replies = sequences(heard.replies);
    CHECK(replies.size() == kThreads * kRequests);
    CHECK(*replies.begin() == i * kThreads * kRequests);
    CHECK(*replies.rbegin() == (i + 1) * kThreads * kRequests - 1);
    for (const Reply& reply : heard.replies) CHECK(reply.epoch == reply.sequence % 2 + 1);
  }
  const auto by_arms = sequences(arms.heard().requests);
  CHECK(by_arms.size() == kAskers * kThreads * kRequests / 2);
  for (const std::uint32_t sequence : by_arms) CHECK(sequence % 2 == 0);
}

TEST_CASE("nothing reaches a server that has stopped, and nobody else misses it") {
  const Join join = joined_by(GENERATE(0, 1));
  Listener asker(join);
  const Server legs(join, "legs");
  Server arms(join, "arms");
  REQUIRE(asker.ask("arms", request(0)));
  {
    const Repeating sending([&](std::uint32_t round) {
      (void)asker.transport->send("arms", request(round), Listener::soon(Milliseconds(20)));
      (void)asker.transport->send("arms", Update{{{"hand", {}}}}, Listener::soon(Milliseconds(20)));
    });
    REQUIRE(arms.hears([](const Heard& h) { return h.requests.size() > 20; }));
    arms.transport->stop();
    arms.recorder.close();
    // The sender goes on, and so does the other server.
    const std::uint32_t rounds = sending.rounds();
    for (std::uint32_t i = 0; i < 20; ++i) CHECK(asker.ask("legs", request(1000000 + i)));
    while (sending.rounds() < rounds + 3) std::this_thread::yield();
  }
  CHECK(arms.heard().after_close == 0);
  CHECK(asker.hears([](const Heard& h) { return h.loss("arms", 1); }));
}

TEST_CASE("nothing reaches a listener that has stopped") {
  const Join join = joined_by(GENERATE(0, 1));
  Server arms(join, "arms");
  Listener leaving(join);
  const Listener staying(join);
  const Repeating publishing([&](std::uint32_t round) { arms.publish(round % 5, round); });
  REQUIRE(leaving.hears([](const Heard& h) { return h.pages.size() > 20; }));
  leaving.transport->stop();
  leaving.recorder.close();
  const std::size_t before = staying.heard().pages.size();
  CHECK(staying.hears([before](const Heard& h) { return h.pages.size() > before + 20; }));
  CHECK(leaving.heard().after_close == 0);
}

TEST_CASE("who joins while pages are published hears no older page after a newer one") {
  const int transport = GENERATE(0, 1);
  const Join join = joined_by(transport);
  Server arms(join, "arms");
  const Repeating publishing([&](std::uint32_t round) { arms.publish(round % 3, round); });
  // Joining takes long over DDS.
  for (int joined = 0; joined < (transport == 0 ? 300 : 5); ++joined) {
    const Listener late(join);
    REQUIRE(late.hears([](const Heard& h) { return h.pages.size() > 10; }));
    const Heard heard = late.heard();
    std::uint64_t last[3] = {0, 0, 0};
    for (const Page& page : heard.pages) {
      INFO("page " << page.number << " in the " << joined << ". try");
      REQUIRE(page.epoch >= last[page.number]);
      last[page.number] = page.epoch;
    }
  }
}

}  // namespace
}  // namespace tfdude
