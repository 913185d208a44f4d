#include "recording/reading.hpp"

#include <algorithm>
#include <utility>

namespace tfdude::recording {
namespace {

// If what was read before an instant was not enough, so many times more, and in the end all.
constexpr int kMore = 8;
constexpr std::chrono::nanoseconds kAll = std::chrono::hours(24 * 365);

// The owners that were not reachable while a lookup read on. If such a process returns, it has the
// data. Another one knows nothing of the instant, whatever it says holds for all times.
class Losses {
 public:
  // @return the error, if an owner was lost and another process has taken its place; or may have,
  // and then the lookup must read on
  [[nodiscard]] std::optional<Error> judge(const State& state, const std::optional<Lost>& lost,
                                           Time now, bool& ends) {
    const auto is_known = [&](const Lost& one) { return one.partition == lost->partition; };
    if (lost && std::none_of(lost_.begin(), lost_.end(), is_known)) lost_.push_back(*lost);
    for (const Lost& one : lost_) {
      const Returned returned = state.returned(one, now);
      ends = returned == Returned::kAsOther;
      if (ends || returned == Returned::kPerhaps) return one.error;
    }
    return std::nullopt;
  }

 private:
  std::vector<Lost> lost_;
};

Time before(Time at, std::chrono::nanoseconds span) {
  const std::int64_t ns = nanoseconds(at);
  return time_of(ns > span.count() ? ns - span.count() : 0);
}

}  // namespace

void Reading::load(Time at, std::chrono::nanoseconds span) {
  span_ = std::min(span, kAll);
  state_ = std::make_unique<State>();
  cursor_.start(span_ < kAll ? before(at, span_) : Time{});
  now_ = at;
  advance(at);
}

void Reading::advance(Time at) {
  now_ = at;
  for (auto next = cursor_.peek(); next && *next <= at; next = cursor_.peek()) {
    state_->apply(*cursor_.next());
  }
}

bool Reading::skips_to(Time at) const {
  return at - now_ > span_ && span_ < kAll && cursor_.skips(before(at, span_));
}

void Reading::seek(Time at) {
  if (at < now_) return load(at, kHistory);
  if (skips_to(at)) return load(at, span_);
  advance(at);
}

const RecordedMessage* Reading::step() {
  const RecordedMessage* message = cursor_.next();
  if (message == nullptr) return nullptr;
  now_ = std::max(now_, message->log);
  state_->apply(*message);
  return message;
}

// A state that began too late is read again, from an earlier place.
Result<StampedTransform> Reading::lookup(std::string_view a, std::string_view b,
                                         const Query& query) {
  while (true) {
    auto X_AB = state_->lookup(a, b, query);
    if (X_AB || cursor_.from_beginning() || span_ >= kAll) return X_AB;
    const bool too_late =
        X_AB.error().code == Errc::kTooOld || (cursor_.foreign() && may_come(X_AB.error().code));
    if (!too_late) return X_AB;
    load(now_, span_ * kMore);
  }
}

Result<StampedTransform> Reading::lookup_at(std::string_view a, std::string_view b, Query query,
                                            Time at, Milliseconds wait) {
  query.at = at;
  const Time place = instant_for(at);
  seek(place);
  Losses losses;
  while (true) {
    auto X_AB = lookup(a, b, query);
    bool ends = false;
    const bool unreachable = !X_AB && X_AB.error().code == Errc::kUnreachable;
    auto lost = losses.judge(*state_, unreachable ? state_->lost(a, b) : std::nullopt, now_, ends);
    if (lost) X_AB = tl::unexpected(*std::move(lost));
    if (X_AB || ends || !may_come(X_AB.error().code)) return X_AB;
    const RecordedMessage* next = cursor_.front();
    if (next == nullptr || is_late(next->log, at, wait)) return X_AB;
    if (ends_with(*next, a, b, place)) return X_AB;
    (void)step();
  }
}

}  // namespace tfdude::recording
