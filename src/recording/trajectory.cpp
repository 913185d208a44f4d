#include <algorithm>
#include <cstdint>
#include <numeric>
#include <optional>
#include <utility>

#include "recording/path_appends.hpp"
#include "recording/reading.hpp"
#include "types/trajectory_builder.hpp"

// One pair of frames at many instants.
namespace tfdude::recording {

/// The instants, from the earliest on. Each is looked up in the state in which lookup_at() would
/// find its answer, or in one that differs only by messages that append samples.
class Reading::Instants {
 public:
  Instants(Reading& reading, std::string_view a, std::string_view b,
           const std::vector<Time>& instants, const Query& query, Milliseconds wait)
      : reading_(reading),
        a_(a),
        b_(b),
        instants_(instants),
        query_(query),
        wait_(wait),
        at_once_(query.extrapolate > std::chrono::nanoseconds(0) ? 0 : kAtOnce),
        order_(instants.size()),
        appends_(a, b),
        answers_(instants.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    const auto is_earlier = [&](std::size_t x, std::size_t y) {
      return reading_.instant_for(instants[x]) < reading_.instant_for(instants[y]);
    };
    if (!std::is_sorted(order_.begin(), order_.end(), is_earlier)) {
      std::stable_sort(order_.begin(), order_.end(), is_earlier);
    }
  }

  [[nodiscard]] Trajectory look_up() && {
    if (!order_.empty()) go_to_next();
    std::size_t looked = SIZE_MAX;  // for which of them it was looked whether messages are skipped
    while (done_ < order_.size()) {
      if (std::exchange(looked, done_) != done_ && reading_.skips_to(place())) go_to_next();
      const RecordedMessage* message = reading_.cursor_.front();
      if (message == nullptr) {
        (void)answer(std::nullopt, nullptr);
      } else {
        pass(*message);
      }
    }
    return std::move(answers_).take();
  }

 private:
  // How many messages at most are passed without an answer, so that samples are still in the cache.
  static constexpr std::size_t kAtOnce = 256;

  [[nodiscard]] Time next() const { return instants_[order_[done_]]; }
  // Where that is looked up.
  [[nodiscard]] Time place() const { return reading_.instant_for(next()); }

  void go_to_next() {
    reading_.seek(place());
    begin();
  }

  void begin() {
    appends_.begin(*reading_.state_);
    passed_ = 0;
  }

  // Applies a message, after what was asked before it if that makes a difference.
  void pass(const RecordedMessage& message) {
    const Time log = message.log;
    const bool appends = appends_.only_appends(*reading_.state_, message);
    const bool answers = !appends || ++passed_ > at_once_ || is_late(log, place(), wait_);
    // The answer may have read another place.
    if (answers && !answer(log, &message)) return begin();
    if (answers) passed_ = 0;
    (void)reading_.step();
    if (appends) return;
    begin();
    if (!answer(log, nullptr)) begin();
  }

  // Answers what can be answered now, of what was asked before the next message; at the end, all.
  // @param coming  that message, if it has not come yet: its structure is not that of the instants
  // @return whether the state is still the same
  [[nodiscard]] bool answer(std::optional<Time> next_message, const RecordedMessage* coming) {
    const State* const state = reading_.state_.get();
    handles_.reset();
    for (; done_ < order_.size() && (!next_message || place() < *next_message); ++done_) {
      query_.at = next();
      if (answer_fast()) continue;
      const auto X_AB = reading_.lookup(a_, b_, query_);
      find_handles(X_AB.has_value());
      const bool reads_on =
          !X_AB && may_come(X_AB.error().code) && X_AB.error().code != Errc::kUnreachable;
      const bool goes_on = next_message && !is_late(*next_message, place(), wait_);
      if (reads_on && goes_on && !ends_with(coming)) break;
      answers_.add(order_[done_], X_AB);
    }
    return state == reading_.state_.get();
  }

  // What was looked up may have read another place, where another message is next.
  [[nodiscard]] bool ends_with(const RecordedMessage* coming) {
    if (coming == nullptr || reading_.cursor_.front() != coming) return false;
    return reading_.ends_with(*coming, a_, b_, place());
  }

  // All edges have values, and are of one forest: so the handles are enough.
  [[nodiscard]] bool answer_fast() {
    if (!handles_) return false;
    const auto X_AB = reading_.state_->forest().lookup(handles_->first, handles_->second, query_);
    if (X_AB) answers_.add(order_[done_], X_AB);
    return X_AB.has_value();
  }

  // To fourth order, an answer depends on the segments of owners.
  void find_handles(bool answered) {
    handles_.reset();
    if (!answered || query_.order != Order::kSecond) return;
    const Forest& forest = reading_.state_->forest();
    const auto a = forest.find(a_);
    const auto b = forest.find(b_);
    if (a && b) handles_ = {*a, *b};
  }

  Reading& reading_;
  const std::string_view a_;
  const std::string_view b_;
  const std::vector<Time>& instants_;
  Query query_;
  const Milliseconds wait_;
  const std::size_t at_once_;       // none if an answer may come before the samples around it
  std::vector<std::size_t> order_;  // of the instants
  std::size_t done_ = 0;            // of those in this order
  PathAppends appends_;
  std::size_t passed_ = 0;  // messages since the last answer
  std::optional<std::pair<Handle, Handle>> handles_;
  TrajectoryBuilder answers_;
};

Trajectory Reading::trajectory(std::string_view a, std::string_view b,
                               const std::vector<Time>& instants, const Query& query,
                               Milliseconds wait) {
  const Cursor::ReadsAhead ahead(cursor_);
  return Instants(*this, a, b, instants, query, wait).look_up();
}

}  // namespace tfdude::recording
