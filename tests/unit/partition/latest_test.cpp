#include "partition/latest.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;

using Steady = LatestHints::Steady;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

SegmentValues answer(std::optional<Time> stamp, double x, std::optional<double> at_hint = {}) {
  SegmentValues values{{{along_x(x)}}, stamp, 10ms, {}};
  if (at_hint) values.at_hint.values.push_back(along_x(*at_hint));
  return values;
}

double x_of(const SegmentValues& values) { return values.values.at(0).pose.translation().x(); }

}  // namespace

TEST_CASE("answers of one instant or of static edges are used as they are") {
  CHECK(one_instant({}, std::nullopt).answers.empty());
  CHECK_FALSE(one_instant({}, std::nullopt).ask_again);
  const auto fixed = one_instant({answer(std::nullopt, 1), answer(std::nullopt, 2)}, ms(5));
  CHECK(fixed.answers.size() == 2);
  const auto same =
      one_instant({answer(ms(7), 1), answer(std::nullopt, 2), answer(ms(7), 3, 9)}, ms(5));
  REQUIRE(same.answers.size() == 3);
  CHECK(x_of(same.answers[2]) == 3);
}

TEST_CASE("the guessed instant is used if all owners have it and it is recent") {
  const auto ask = [](Time hint, std::optional<double> of_first = 11,
                      std::optional<double> of_last = 12) {
    return one_instant(
        {answer(ms(100), 1, of_first), answer(ms(90), 2, of_last), answer(std::nullopt, 3)}, hint);
  };
  for (const std::int64_t near : {70, 80, 89}) {
    const auto found = ask(ms(near));
    REQUIRE(found.answers.size() == 3);
    CHECK(found.answers[0].stamp == ms(near));
    CHECK(found.answers[1].stamp == ms(near));
    CHECK(x_of(found.answers[0]) == 11);
    CHECK(x_of(found.answers[1]) == 12);
    CHECK(x_of(found.answers[2]) == 3);
  }
  // The guess is the newest instant of the slowest owner itself.
  CHECK(x_of(ask(ms(90), 11, std::nullopt).answers.at(1)) == 2);
  for (const auto& far :
       {ask(ms(69)), ask(ms(91)), ask(ms(80), std::nullopt), ask(ms(80), 11, {})}) {
    CHECK(far.answers.empty());
    CHECK(far.ask_again == ms(90));
  }
  CHECK(one_instant({answer(ms(1), 1), answer(ms(2), 2)}, std::nullopt).ask_again == ms(1));
}

TEST_CASE("a guess is one period behind the expected newest sample of the slowest owner") {
  LatestHints hints;
  const Steady start{};
  CHECK_FALSE(hints.guess("a", "b", start));
  hints.note("a", "b", start, start, {answer(ms(100), 1), answer(ms(90), 2)});
  // Not before what all are known to have.
  CHECK(hints.guess("a", "b", start) == ms(90));
  CHECK(hints.guess("a", "b", start + 25ms) == ms(105));
  CHECK_FALSE(hints.guess("b", "a", start));
  // If all owners repeatedly have the same instant, there is nothing to guess.
  const std::vector<SegmentValues> same{answer(ms(130), 1), answer(ms(130), 2)};
  hints.note("c", "d", start, start, same);
  CHECK_FALSE(hints.guess("c", "d", start));
  hints.note("a", "b", start + 30ms, start + 30ms, same);
  CHECK(hints.guess("a", "b", start + 30ms) == ms(130));
  CHECK(hints.guess("a", "b", start + 50ms) == ms(140));
  for (int i = 0; i < 10; ++i) hints.note("a", "b", start + 30ms, start + 30ms, same);
  CHECK_FALSE(hints.guess("a", "b", start + 30ms));
  hints.note("a", "b", start + 30ms, start + 30ms, {answer(ms(130), 1), answer(ms(120), 2)});
  CHECK(hints.guess("a", "b", start + 30ms) == ms(120));
  CHECK(hints.guess("a", "b", start + 45ms) == ms(125));
}

TEST_CASE("a guess is used only if it is recent, however slow the samples are") {
  const auto ask = [](Time hint) {
    SegmentValues slow = answer(ms(9000), 1, 11);
    slow.period = 10s;
    return one_instant({std::move(slow), answer(ms(9500), 2, 12)}, hint);
  };
  CHECK(ask(ms(8980)).answers.size() == 2);
  CHECK(ask(ms(8979)).ask_again == ms(9000));
}

TEST_CASE("answers that were overtaken do not make the next guess older") {
  LatestHints hints;
  const Steady start{};
  hints.note("a", "b", start + 1ms, start + 2ms, {answer(ms(110), 1), answer(ms(115), 2)});
  hints.note("a", "b", start, start + 3ms, {answer(ms(100), 1), answer(ms(105), 2)});
  CHECK(hints.guess("a", "b", start + 3ms) == ms(110));
  // After a jump of the clock, what was begun later counts.
  hints.note("a", "b", start + 4ms, start + 5ms, {answer(ms(20), 1), answer(ms(25), 2)});
  CHECK(hints.guess("a", "b", start + 5ms) == ms(20));
}

TEST_CASE("no lookup goes back behind an earlier one, or far behind what all have") {
  testing::Random random(2718);
  INFO("seed " << random.seed());
  for (int run = 0; run < 200; ++run) {
    LatestHints hints;
    // Two owners whose samples come at any time, with stamps that are in order.
    std::int64_t now = 1'000'000'000'000;
    std::int64_t newest[2] = {now, now};
    std::int64_t period[2] = {0, 0};
    std::int64_t seen = 0;
    const std::size_t gap = random.index(3) == 0 ? 2'000'000'000 : 20'000'000;
    for (int i = 0; i < 200; ++i) {
      now += static_cast<std::int64_t>(random.index(gap));
      for (const std::size_t one : {0U, 1U}) {
        if (random.index(3) != 0) continue;
        const std::int64_t stamp = now - static_cast<std::int64_t>(random.index(1000));
        if (stamp <= newest[one]) continue;
        period[one] = stamp - std::exchange(newest[one], stamp);
      }
      const Steady steady{std::chrono::nanoseconds(now)};
      const auto hint = hints.guess("a", "b", steady);
      std::vector<SegmentValues> answers;
      for (const std::size_t one : {0U, 1U}) {
        SegmentValues values{
            {{along_x(1)}}, time_of(newest[one]), std::chrono::nanoseconds(period[one]), {}};
        if (hint && nanoseconds(*hint) <= newest[one]) values.at_hint.values.push_back(along_x(1));
        answers.push_back(std::move(values));
      }
      hints.note("a", "b", steady, steady, answers);
      const std::int64_t latest = std::min(newest[0], newest[1]);
      const auto found = one_instant(std::move(answers), hint);
      const std::int64_t answered =
          found.ask_again ? nanoseconds(*found.ask_again) : nanoseconds(*found.answers[0].stamp);
      CAPTURE(run, i);
      REQUIRE(answered <= latest);
      REQUIRE(answered >= latest - 20'000'000);
      REQUIRE(answered >= seen);
      seen = answered;
    }
  }
}

TEST_CASE("one round trip is enough if samples arrive at constant rates") {
  testing::Random random(31415);
  INFO("seed " << random.seed());
  LatestHints hints;
  // Two owners with periods of their own, whose samples reach readers after a delay.
  const std::int64_t periods[2] = {1'000'000, 4'000'000};
  const std::int64_t delay = 300'000;
  int again = 0;
  constexpr int kLookups = 2000;
  std::int64_t now = 1'000'000'000;
  for (int i = 0; i < kLookups; ++i) {
    now += static_cast<std::int64_t>(random.index(9'000'000));
    const Steady steady{std::chrono::nanoseconds(now)};
    const auto hint = hints.guess("a", "b", steady);
    std::vector<SegmentValues> answers;
    for (const std::int64_t period : periods) {
      const std::int64_t newest = (now - delay) / period * period + period / 3;
      SegmentValues values{{{along_x(1)}}, time_of(newest), std::chrono::nanoseconds(period), {}};
      if (hint && nanoseconds(*hint) <= newest) values.at_hint.values.push_back(along_x(1));
      answers.push_back(std::move(values));
    }
    hints.note("a", "b", steady, steady, answers);
    again += one_instant(std::move(answers), hint).ask_again ? 1 : 0;
  }
  CHECK(again <= kLookups / 20);
}

}  // namespace tfdude
