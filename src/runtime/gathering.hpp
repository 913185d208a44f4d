#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/mutex.hpp"
#include "partition/latest.hpp"
#include "partition/routing.hpp"

namespace tfdude {

/// LatestHints for several threads.
class SharedHints {
 public:
  [[nodiscard]] std::optional<Time> guess(std::string_view a, std::string_view b) const {
    const Lock lock(mutex_);
    return hints_.guess(a, b, std::chrono::steady_clock::now());
  }
  void note(std::string_view a, std::string_view b, const std::vector<SegmentValues>& answers) {
    const Lock lock(mutex_);
    hints_.note(a, b, std::chrono::steady_clock::now(), answers);
  }

 private:
  mutable Mutex mutex_;
  LatestHints hints_ TFDUDE_GUARDED_BY(mutex_);
};

/// The values in the owners' replies, in order, or the first error.
[[nodiscard]] Result<std::vector<SegmentValues>> values_of(std::vector<Reply> replies);

/// A lookup that needs other owners: the requests, and the evaluation of their replies.
class Gathering {
 public:
  /// @param hint  the instant predicted when the plan was made
  Gathering(LookupPlan plan, std::string a, std::string b, std::optional<Time> hint)
      : plan_(std::move(plan)), a_(std::move(a)), b_(std::move(b)), hint_(hint) {}

  [[nodiscard]] std::vector<Part>& parts() { return plan_.parts; }

  /// Evaluates the replies to the parts.
  /// @return X_AB; empty if the parts must be sent again: they now ask for an instant that all may
  ///   have
  [[nodiscard]] std::optional<Result<StampedTransform>> take(std::vector<Reply> replies,
                                                             SharedHints& hints);

 private:
  /// Says in the error of a second round why the instant was asked for.
  [[nodiscard]] Error explained(Error error) const;

  LookupPlan plan_;
  std::string a_;
  std::string b_;
  std::optional<Time> hint_;
  std::optional<std::size_t> slowest_;  // the part whose newest instant a second round asks for
};

}  // namespace tfdude
