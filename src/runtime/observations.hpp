#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "calls/observe_task.hpp"
#include "runtime/context.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// Applies measurements of paths, and reports how consistent covariances are. Client describes the
/// return values.
/// @par Thread safety  All functions are thread-safe.
class Observations {
 public:
  explicit Observations(const Context& context)
      : structure_(context.structure), discovery_(context.discovery), requests_(context.requests) {}

  [[nodiscard]] Result<Observed> observe(const Measurement& measured, const Deadline& deadline) {
    return determine({}, measured, deadline);
  }
  /// @param id  the frame whose edge takes all of it; empty: all edges take their shares
  [[nodiscard]] Result<Observed> determine(const std::string& id, const Measurement& measured,
                                           const Deadline& deadline);
  [[nodiscard]] Result<std::vector<EdgeConsistency>> consistency(const std::string& partition);

 private:
  // Older ones are recognized by their age.
  static constexpr std::size_t kMostSettled = 16;
  static constexpr std::size_t kMostRewritten = 64;

  [[nodiscard]] EarlierObservations earlier() const;
  void note(const ObserveTask& done);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  std::atomic<std::uint64_t> count_{0};
  mutable Mutex mutex_;
  std::deque<std::string> settled_ TFDUDE_GUARDED_BY(mutex_);  // see EarlierObservations
  std::deque<std::string> rewritten_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
