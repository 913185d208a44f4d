#pragma once

#include <algorithm>
#include <optional>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// From which instant on a watch may lack samples, as messages were lost. Only an answer that was
/// asked for afterwards tells them: another one may have been made before they were written.
class MissingSamples {
 public:
  /// All from this instant on may be missing.
  void add(Time from) {
    from_ = std::min(from_.value_or(from), from);
    since_asked_ = std::min(since_asked_.value_or(from), from);
  }
  [[nodiscard]] const std::optional<Time>& from() const { return from_; }
  /// Of these, what was added since the last request.
  [[nodiscard]] const std::optional<Time>& since_asked() const { return since_asked_; }

  /// A request follows. @return the instant that it is to name
  [[nodiscard]] std::optional<Time> ask() {
    since_asked_.reset();
    return from_;
  }
  /// All owners have answered a request that named this instant.
  void told(Time from) {
    if (from_ && from <= *from_) from_ = since_asked_;
  }

 private:
  std::optional<Time> from_;
  std::optional<Time> since_asked_;
};

}  // namespace tfdude
