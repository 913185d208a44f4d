// When lookups that wait ask owners again.

#include "calls/waiting_lookup.hpp"

#include <chrono>
#include <optional>
#include <string>

#include "support/catch.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using Clock = WaitingLookup::Clock;

constexpr Time kAsked{100s};

/// Owners that lack the sample, and say so at once.
struct Owners final : LookupHost, RequestLink {
  Result<LookupInProgress> plan(const WantedLookup&) override {
    ++asked;
    return fail(Errc::kNotYet, "not yet");
  }
  bool asks_for_frames() const override { return true; }
  bool was_pushed(const WantedLookup&) const override { return false; }
  Error last_word(Error last, const TimeLimit&) override { return last; }
  std::optional<Time> clock() const override { return std::nullopt; }
  Result<void> send(const std::string&, const Request&, Clock::time_point) override { return {}; }
  Reply answer(const Request&) override { return {}; }

  int asked = 0;
};

struct Waiter {
  explicit Waiter(std::size_t others) { news.waiting = others; }
  bool attend() { return lookup.attend(shared, news, now).has_value(); }

  const Clock::time_point begin{1h};
  Clock::time_point now = begin;
  Forest forest;
  ReplyTable replies;
  SharedHints hints;
  Owners owners;
  const WaitingLookup::Shared shared{forest, replies, owners, hints, owners, nullptr, 1s};
  WaitingLookup::News news;
  WaitingLookup lookup{{"world", "tip", {kAsked, 0ns, {}}},
                       TimeLimit(1s, begin),
                       {Errc::kNotYet, "not asked yet"},
                       begin};
};

}  // namespace

TEST_CASE(
    "waiting lookup: many share a number of requests, but none misses data that came in time") {
  Waiter waiter(10'000);
  CHECK_FALSE(waiter.attend());
  CHECK(waiter.owners.asked == 1);
  // Once more before the end, however many wait.
  const auto last = waiter.lookup.next();
  CHECK(last < waiter.begin + 1s);
  CHECK(last > waiter.begin + 500ms);
  waiter.now = last;
  CHECK_FALSE(waiter.attend());
  CHECK(waiter.owners.asked == 2);
  CHECK(waiter.lookup.next() == waiter.begin + 1s);
}

TEST_CASE("waiting lookup: what came for another one of the same frames is asked for at once") {
  Waiter waiter(2'000);
  // Before the first attempt, and for an earlier instant, nothing is known.
  CHECK_FALSE(waiter.lookup.put_forward(kAsked, waiter.now));
  CHECK_FALSE(waiter.attend());
  CHECK_FALSE(waiter.lookup.put_forward(kAsked - 1ns, waiter.now));
  CHECK(waiter.lookup.next() > waiter.now + 400ms);
  const auto soon = waiter.now + 1ms;
  CHECK(waiter.lookup.put_forward(kAsked, soon));
  CHECK(waiter.lookup.next() == soon);
  waiter.now = soon;
  CHECK_FALSE(waiter.attend());
  CHECK(waiter.owners.asked == 2);
  // In vain: so it waits for its turn, whatever else is answered.
  CHECK_FALSE(waiter.lookup.put_forward(kAsked, waiter.now));
  CHECK(waiter.lookup.next() > waiter.now + 400ms);
  waiter.now = waiter.lookup.next();
  CHECK_FALSE(waiter.attend());
  CHECK(waiter.owners.asked == 3);
  CHECK(waiter.lookup.put_forward({}, waiter.now));
}

}  // namespace tfdude
