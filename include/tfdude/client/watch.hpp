#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/client/subscription.hpp"
#include "tfdude/types/options.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

class WatchedPath;

/// A path whose owners push its changes, so that it is read from this process's memory. It is
/// watched while a copy of this object exists. It may outlive the Client, but then receives nothing
/// new.
/// @par Thread safety  All functions are thread-safe.
class TFDUDE_EXPORT PathWatch {
 public:
  explicit PathWatch(std::shared_ptr<WatchedPath> path) : path_(std::move(path)) {}

  /// X_AB at the newest instant that all dynamic edges of the path have received. No network, lock
  /// or allocation, except for the names of unspecified edges. The result is always a consistent
  /// transform of the path: an atomic update of one owner is seen whole or not at all. While the
  /// path changes its route, an owner restarts, or the edges have no instant in common, the last
  /// transform before that is returned.
  /// @return as Client::lookup(); the reason, if the path no longer exists or is not known
  ///   yet.
  [[nodiscard]] Result<StampedTransform> latest() const { return lookup({}); }
  [[nodiscard]] Result<StampedTransform> at(Time t) const;
  [[nodiscard]] Result<StampedTransform> lookup(const Query& query) const;

  /// Whether all owners of the path are reachable. While one is not, its last values are still
  /// used.
  /// @return kUnreachable, naming the partition; the reason, while the path is not known.
  [[nodiscard]] Result<void> health() const;

  /// The number of received messages with new data.
  [[nodiscard]] std::uint64_t messages() const;

  /// Waits until messages() exceeds the given number; false at the deadline, or when the client
  /// ends.
  [[nodiscard]] bool wait_for_more(std::uint64_t messages,
                                   std::chrono::steady_clock::time_point deadline) const;

  /// Waits for a value that this object has not returned yet: the first time for the newest one,
  /// and then for one of which the pose, the covariance or the stamp differs. Values that come
  /// between two calls are not queued; the newest is returned. So nothing is new while an owner of
  /// the path is gone: health() says which. One thread at a time; each copy of this object has its
  /// own place.
  /// @return as latest(), with the reason as soon as the path or the client ends. The end of a path
  ///   is told once: the next call waits for its return, and has the reason at the end of `wait`.
  ///   kTimeout: nothing new within `wait`
  [[nodiscard]] Result<StampedTransform> wait_next(Milliseconds wait);

  /// Calls a function with the newest value, if there is one, and then when there is another one,
  /// as for wait_next(), or with the reason when there is none any more. On a library thread that
  /// holds no lock: it may call any function and take any time; meanwhile values are not queued,
  /// and the newest comes next. Must not throw. Ends with the Subscription, the last PathWatch of
  /// the path, or the client. A call that has begun may outlast the last PathWatch, but neither of
  /// the others.
  [[nodiscard]] Subscription on_value(
      std::function<void(const Result<StampedTransform>&)> callback) const;

  /// Calls a function when there is something new: data, another route, or none. For loops that
  /// wait for many things, as by a file descriptor; wait_for_more() is simpler otherwise. Called
  /// from library threads, one call at a time, under a lock: the function may only signal. It must
  /// not wait, call this library or throw. Once the Subscription is destroyed, it is not running
  /// and will not run.
  [[nodiscard]] Subscription on_news(std::function<void()> listener) const;

 private:
  std::shared_ptr<WatchedPath> path_;
  std::optional<StampedTransform> returned_;  // by wait_next()
};

/// Edges whose owners push their changes, so that they are read from this process's memory: many
/// edges of an owner in one message. They are watched while a copy of this object exists. It may
/// outlive the Client, but then receives nothing new.
/// @par Thread safety  All functions are thread-safe.
class TFDUDE_EXPORT EdgesWatch {
 public:
  explicit EdgesWatch(std::shared_ptr<WatchedPath> edges) : edges_(std::move(edges)) {}

  /// X_AB over watched edges, as PathWatch::lookup(); but if the edges have no instant in common,
  /// there is no result.
  /// @return as Client::lookup(), where other frames than the ends of watched edges are unknown;
  ///   kUnknownFrame if one of the edges no longer exists.
  [[nodiscard]] Result<StampedTransform> lookup(std::string_view a, std::string_view b,
                                                const Query& query = {}) const;

  /// The stamps of the samples of a watched edge after an instant, in order, as far as they are
  /// kept (WatchOptions::timing): for those who must not miss one. Takes a lock. O(samples).
  /// @param id  of the child
  /// @return empty also if the edge has none, or is not known yet
  [[nodiscard]] std::vector<Time> stamps(std::string_view id, Time after) const;

  /// As PathWatch::health().
  [[nodiscard]] Result<void> health() const;
  /// As PathWatch::messages().
  [[nodiscard]] std::uint64_t messages() const;
  /// As PathWatch::wait_for_more().
  [[nodiscard]] bool wait_for_more(std::uint64_t messages,
                                   std::chrono::steady_clock::time_point deadline) const;
  /// As PathWatch::on_news().
  [[nodiscard]] Subscription on_news(std::function<void()> listener) const;

 private:
  std::shared_ptr<WatchedPath> edges_;
};

}  // namespace tfdude
