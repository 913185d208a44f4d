#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "tfdude/base/result.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// Keeps a listener listening; ends that when destroyed, or when another is assigned to it.
///
/// @par Attach and detach  The listener may be called as soon as on_change() is, before that has returned. After
///   ~Subscription has returned, and after ~Client has, whichever is first, the listener is not running and will not run:
///   both wait for a call of it under way. Where the listener itself destroys its Subscription, another's, or the Client,
///   that returns at once, and the listener is not called again. So a listener may use what lives longer than its
///   Subscription, and the Client, and must not wait for a thread that destroys one of these. A Subscription that outlives
///   its Client does nothing any more.
/// @par Thread safety  Each Subscription is of one thread at a time.
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

/// A lookup that waits for its data; cancelled when destroyed.
///
/// @par Attach and detach  After cancel(), ~PendingLookup or ~Client has returned, the callback is not running and will
///   not run: they wait for it where it runs, and return at once (20 ms at most) where it does not. Where the callback
///   itself does one of these, that returns at once, too. A callback must not wait for a thread that does one of these.
/// @par Thread safety  Each PendingLookup is of one thread at a time.
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

  /// As destroying it.
  void cancel() { task_.reset(); }

 private:
  std::shared_ptr<void> task_;
};

}  // namespace tfdude
