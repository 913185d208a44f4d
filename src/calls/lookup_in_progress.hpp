#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "calls/call.hpp"
#include "partition/latest.hpp"
#include "partition/routing.hpp"

namespace tfdude {

/// LatestHints for several threads.
class SharedHints {
 public:
  using Steady = LatestHints::Steady;

  [[nodiscard]] std::optional<Time> guess(std::string_view a, std::string_view b,
                                          Steady now) const {
    const Lock lock(mutex_);
    return hints_.guess(a, b, now);
  }
  void note(std::string_view a, std::string_view b, Steady planned, Steady now,
            const std::vector<SegmentValues>& answers) {
    const Lock lock(mutex_);
    hints_.note(a, b, planned, now, answers);
  }

 private:
  mutable Mutex mutex_;
  LatestHints hints_ TFDUDE_GUARDED_BY(mutex_);
};

/// What a lookup wants.
struct WantedLookup {
  std::string a;
  std::string b;
  Query query;
  /// Waits for no frames and data that are missing, but until it is known that they are.
  bool once = false;
};

/// The values in the owners' replies, in order, or the first error.
[[nodiscard]] Result<std::vector<SegmentValues>> values_of(std::vector<Reply> replies);

/// Names an owner of these parts with another clock than this participant; empty: there is none.
[[nodiscard]] std::string other_clock(const Directory& directory, ClockKind own,
                                      const std::vector<Part>& parts);

/// A lookup that needs other owners: the requests, and the evaluation of their replies.
class LookupInProgress {
 public:
  /// As route_lookup(). @param own  the clock of this participant
  /// @return also kInvalidInput if ages are wanted, and clocks differ
  [[nodiscard]] static Result<LookupInProgress> plan(const Forest& forest,
                                                     const Directory& directory, ClockKind own,
                                                     const WantedLookup& wanted,
                                                     const SharedHints& hints,
                                                     SharedHints::Steady now);

  [[nodiscard]] std::vector<Part>& parts() { return plan_.parts; }

  /// Evaluates the replies to the parts.
  /// @return X_AB; empty if the parts must be sent again: they now ask for an instant that all may
  ///   have
  [[nodiscard]] std::optional<Result<StampedTransform>> take(std::vector<Reply> replies,
                                                             SharedHints& hints,
                                                             SharedHints::Steady now);

 private:
  LookupInProgress(LookupPlan plan, const WantedLookup& wanted, std::optional<Time> hint,
                   SharedHints::Steady now)
      : plan_(std::move(plan)),
        a_(wanted.a),
        b_(wanted.b),
        believed_(wanted.query.believed_at.has_value()),
        hint_(hint),
        planned_(now) {}

  /// Says in an error about time what may be its reason: another clock, or why a second round asked
  /// for the instant.
  [[nodiscard]] Error explained(Error error) const;
  [[nodiscard]] Result<StampedTransform> assembled(const std::vector<SegmentValues>& answers) const;

  LookupPlan plan_;
  std::string a_;
  std::string b_;
  bool believed_;                       // it is about what was believed before
  std::optional<Time> hint_;            // the instant predicted when the plan was made
  SharedHints::Steady planned_;         // then
  std::string differs_;                 // that an owner has another clock; empty: none has
  std::optional<std::size_t> slowest_;  // the part whose newest instant a second round asks for
};

/// The pose of one frame in another.
class LookupTask final : public Task {
 public:
  LookupTask(const Forest& forest, ClockKind own, SharedHints& hints, WantedLookup wanted)
      : forest_(forest), own_(own), hints_(hints), wanted_(std::move(wanted)) {}

  [[nodiscard]] std::vector<std::string> frames() const override { return {wanted_.a, wanted_.b}; }
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override { return lookup_ ? lookup_->parts() : none_; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;

  /// Once it is done.
  [[nodiscard]] StampedTransform& X_AB() { return *X_AB_; }

 private:
  const Forest& forest_;
  const ClockKind own_;
  SharedHints& hints_;
  const WantedLookup wanted_;
  std::optional<LookupInProgress> lookup_;
  std::vector<Part> none_;
  std::optional<StampedTransform> X_AB_;
};

}  // namespace tfdude
