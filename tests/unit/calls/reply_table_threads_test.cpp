#include <atomic>
#include <thread>
#include <vector>

#include "calls/reply_table.hpp"
#include "support/catch.hpp"

namespace tfdude {
namespace {

// Far enough that it is only reached where a reply got lost.
ReplyTable::Clock::time_point far() { return ReplyTable::Clock::now() + std::chrono::seconds(60); }

TEST_CASE("calls: a waiting call is woken by its last reply") {
  ReplyTable table;
  ReplyTable::Call call(table, {"a", "b"});
  std::thread replier([&table, &entries = call.entries()] {
    for (const ReplyTable::Entry& entry : entries) {
      table.on_reply(entry.partition, {entry.sequence, 0, Done{}});
    }
  });
  CHECK(call.wait_until(far()));
  replier.join();
}

TEST_CASE("calls: a waiting call is woken by the loss of the last partition it waits for") {
  ReplyTable table;
  ReplyTable::Call call(table, {"a"});
  std::thread loser([&table] { table.on_lost("a"); });
  CHECK(call.wait_until(far()));
  loser.join();
}

TEST_CASE("calls: many concurrent calls each get their own replies") {
  constexpr std::uint32_t kCalls = 2000;
  constexpr std::uint32_t kCallers = 3;
  ReplyTable table;
  std::atomic<std::uint32_t> running{kCallers};
  std::atomic<std::uint32_t> wrong{0};
  std::vector<std::thread> threads;
  for (std::uint32_t i = 0; i < kCallers; ++i) {
    threads.emplace_back([&] {
      for (std::uint32_t n = 0; n < kCalls; ++n) {
        ReplyTable::Call call(table, {"a", "b"});
        if (!call.wait_until(far())) ++wrong;
        for (const ReplyTable::Entry& entry : call.entries()) {
          if (entry.reply->sequence != entry.sequence || entry.reply->epoch != entry.sequence) {
            ++wrong;
          }
        }
      }
      --running;
    });
  }
  // Answers everything over and over, so that replies come too early, twice, and too late.
  std::thread replier([&] {
    while (running > 0) {
      for (std::uint32_t n = 1; n <= 2 * kCallers * kCalls && running > 0; ++n) {
        table.on_reply("a", {n, n, Done{}});
        table.on_reply("b", {n, n, Done{}});
      }
    }
  });
  for (std::thread& thread : threads) thread.join();
  replier.join();
  CHECK(wrong == 0);
}

}  // namespace
}  // namespace tfdude
