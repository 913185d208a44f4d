#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "tfdude/base/result.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// Keeps a listener attached, until it is destroyed or another Subscription is assigned to it.
///
/// @par Attach and detach  The listener may be called as soon as on_change() is called, even before
///   that returns. After ~Subscription or ~Client has returned, whichever is first, the listener is
///   not running and will not run: both wait for a call of it under way. If the listener itself
///   destroys its Subscription, another one, or the Client, the destructor returns at once, and the
///   listener is not called again. So a listener may use what outlives its Subscription and the
///   Client, and must not wait for a thread that destroys one of these. A Subscription that
///   outlives its Client does nothing.
/// @par Thread safety  Each Subscription may be used by one thread at a time.
class Subscription {
 public:
  Subscription() = default;
  explicit Subscription(std::shared_ptr<void> token) : token_(std::move(token)) {}
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  Subscription(Subscription&&) = default;
  Subscription& operator=(Subscription&&) = default;
  ~Subscription() = default;

 private:
  std::shared_ptr<void> token_;
};

/// A lookup that waits for its data. Destroying it cancels the lookup.
///
/// @par Attach and detach  After cancel(), ~PendingLookup or ~Client has returned, the callback is
///   not running and will not run. They wait for a running callback, and otherwise return at once
///   (within 20 ms). If the callback itself does one of these, that also returns at once. A
///   callback must not wait for a thread that does one of these.
/// @par Thread safety  Each PendingLookup may be used by one thread at a time.
class PendingLookup {
 public:
  using Callback = std::function<void(Result<StampedTransform>)>;

  PendingLookup() = default;
  explicit PendingLookup(std::shared_ptr<void> task) : task_(std::move(task)) {}
  PendingLookup(const PendingLookup&) = delete;
  PendingLookup& operator=(const PendingLookup&) = delete;
  PendingLookup(PendingLookup&&) = default;
  PendingLookup& operator=(PendingLookup&&) = default;
  ~PendingLookup() = default;

  /// Cancels the lookup, as its destructor does.
  void cancel() { task_.reset(); }

 private:
  std::shared_ptr<void> task_;
};

}  // namespace tfdude
