#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/types/options.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

class WatchedPath;

/// A path whose owners push what changes on it, so that it is read from this process's memory. Watched as long as a copy of
/// this lives; it may outlive the Client, and then gets nothing new.
/// @par Thread safety  All functions.
class TFDUDE_EXPORT PathWatch {
 public:
  explicit PathWatch(std::shared_ptr<WatchedPath> path) : path_(std::move(path)) {}

  /// X_AB at the newest instant that has come of all its moving edges. No network, lock or allocation. Always one of the
  /// path's transforms: what an owner wrote at once is read in one piece; while the path takes another route, or an owner
  /// starts again, it is the last one before.
  /// @return as Forest::lookup; why, where the path does not exist any more, or is not known yet.
  [[nodiscard]] Result<StampedTransform> latest() const { return lookup({}); }
  [[nodiscard]] Result<StampedTransform> at(Time t) const;
  [[nodiscard]] Result<StampedTransform> lookup(const Query& query) const;

  /// Whether all owners of the path are there; while one is not, what it told last is still answered.
  /// @return kUnreachable, naming the partition; while the path is not known, why.
  [[nodiscard]] Result<void> health() const;

  /// How many messages have come that said something new.
  [[nodiscard]] std::uint64_t messages() const;

  /// Waits until more have come than so many; false at the deadline.
  [[nodiscard]] bool wait_for_more(std::uint64_t messages,
                                   std::chrono::steady_clock::time_point deadline) const;

 private:
  std::shared_ptr<WatchedPath> path_;
};

}  // namespace tfdude
