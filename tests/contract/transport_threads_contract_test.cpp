// The promises of transport.hpp for several concurrent threads, over each transport.

#include <array>
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

/// Runs a function repeatedly in its own thread.
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

TEST_CASE("each participant gets its own replies while several ask several servers") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
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

TEST_CASE("a stopped server receives nothing and the others still answer") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Listener asker(join);
  const Server legs(join, "legs");
  Server arms(join, "arms");
  REQUIRE(asker.ask("arms", request(0)));
  REQUIRE(asker.hears([](const Heard& h) { return h.presence("arms", 1); }));
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
  const int transport = GENERATE(from_range(testing::networks()));
  const Join join = joined_by(transport);
  Server arms(join, "arms");
  const Listener staying(join);
  const Repeating publishing([&](std::uint32_t round) {
    arms.publish(round % 5, round);
    std::this_thread::yield();  // a loop that takes the lock again at once starves joining threads
  });
  // Joining takes long over DDS.
  for (int left = 0; left < (transport == 0 ? 500 : 5); ++left) {
    Listener leaving(join);
    REQUIRE(leaving.hears([](const Heard& h) { return h.pages.size() > 7; }));
    leaving.transport->stop();
    leaving.recorder.close();
    const std::uint32_t rounds = publishing.rounds();
    while (publishing.rounds() < rounds + 2) std::this_thread::yield();
    REQUIRE(leaving.heard().after_close == 0);
  }
  const std::size_t before = staying.heard().pages.size();
  CHECK(staying.hears([before](const Heard& h) { return h.pages.size() > before; }));
}

TEST_CASE("stop waits for the calls that are being handled") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  std::atomic<bool> stopping{false};
  std::atomic<bool> under_way{false};
  testing::Recorder slow;
  slow.answer = [&](const PeerId&, const Request&) {
    under_way = true;
    while (!stopping) std::this_thread::yield();
    for (int i = 0; i < 10000; ++i) std::this_thread::yield();
    under_way = false;
  };
  const auto arms = join("arms");
  REQUIRE(arms->start(slow));
  REQUIRE(arms->serve("arms"));
  const Listener asker(join);
  std::thread asking([&] {
    while (!stopping) {
      (void)asker.transport->send("arms", request(1), Listener::soon(Milliseconds(20)));
    }
  });
  const bool asked = slow.hears([](const Heard& h) { return !h.requests.empty(); });
  while (asked && !under_way) std::this_thread::yield();
  stopping = true;
  arms->stop();
  CHECK(asked);
  CHECK_FALSE(under_way);
  asking.join();
}

TEST_CASE("a participant that joins during publishing receives no older page after a newer one") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Server arms(join, "arms");
  const Repeating publishing([&](std::uint32_t round) {
    arms.publish(round % 3, round);
    std::this_thread::yield();  // a loop that takes the lock again at once starves joining threads
  });
  for (int joined = 0; joined < 5; ++joined) {
    testing::Recorder late;
    // Takes its time over the presence, which may come first, while the pages change.
    late.greet = [] {
      for (int i = 0; i < 1000; ++i) std::this_thread::yield();
    };
    const auto transport = join("");
    REQUIRE(transport->start(late));
    REQUIRE(late.hears([](const Heard& h) { return h.pages.size() > 10; }));
    const Heard heard = late.heard();
    std::array<std::uint64_t, 3> last{};
    std::size_t older = 0;
    for (const Page& page : heard.pages) {
      if (page.epoch < last[page.number]) ++older;
      last[page.number] = page.epoch;
    }
    CHECK(older == 0);
  }
}

}  // namespace
}  // namespace tfdude
