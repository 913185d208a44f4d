#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"

namespace tfdude {

/// What a MessageFilter waits for, and how long.
struct MessageFilterOptions {
  std::string target;          ///< the frame in which each message's frame is wanted
  Milliseconds max_age{1000};  ///< how long a message waits for its transform
  std::size_t most = 100;      ///< messages that wait; one more drops the oldest
  bool in_order = false;       ///< as pushed; otherwise each as soon as it can be had
  Query query{};               ///< of the lookups; their instant is the stamp of the message
};

/// Holds messages of any type back until the transform of their frame, at their stamp, can be had:
/// the counterpart of tf2_ros::MessageFilter. Messages need no stamp of their own; push() is told.
///
///     MessageFilter<Scan> scans(client, {"map"}, [](Scan scan, const StampedTransform& X) { ... },
///                               [](Scan scan, const Error& why) { ... });
///     scans.push(std::move(scan), "lidar", stamp);
///
/// Each message is passed to one of the two functions once, unless the filter is destroyed before.
/// Both are called by threads of the library that hold no lock, one call at a time; but by push()
/// for a message that a newer one displaces (kTooMuch), and those that only waited for it. They may
/// call any function, and destroy the filter; they must not throw.
/// @par Attach and detach  As PendingLookup: after ~MessageFilter has returned, no function is
///   running and none will run, except one that calls it. The client must outlive the filter.
/// @par Thread safety  push() may be called by any thread, and by the functions.
/// @tparam Message  movable
template <class Message>
class MessageFilter {
 public:
  using OnReady = std::function<void(Message, const StampedTransform& X_TF)>;
  /// @param why  as of Client::lookup() with a wait; kTooMuch
  using OnDropped = std::function<void(Message, const Error& why)>;

  MessageFilter(Client& client, MessageFilterOptions options, OnReady on_ready,
                OnDropped on_dropped = nullptr)
      : client_(client),
        options_(std::move(options)),
        state_(std::make_shared<State>(std::move(on_ready), std::move(on_dropped),
                                       options_.in_order)) {}
  MessageFilter(const MessageFilter&) = delete;
  MessageFilter& operator=(const MessageFilter&) = delete;
  ~MessageFilter() { state_->close(); }

  /// Passes a message on as soon as its transform is there. Does not wait for anything.
  void push(Message message, const std::string& frame, Time stamp) {
    auto entry = std::make_shared<Entry>(std::move(message));
    const std::shared_ptr<State> state = state_;
    if (!state->add(entry, options_.most)) return;
    Query query = options_.query;
    query.at = stamp;
    PendingLookup lookup = client_.lookup_async(
        options_.target, frame, query, options_.max_age,
        [state, entry](Result<StampedTransform> X_TF) { state->take(entry, std::move(X_TF)); });
    state->started(*entry, lookup);
  }

  /// The number of messages that wait for their transform, or for those before them.
  [[nodiscard]] std::size_t waiting() const { return state_->waiting(); }

 private:
  struct Entry {
    explicit Entry(Message m) : message(std::move(m)) {}
    Message message;
    Result<StampedTransform> X_TF = tl::unexpected(Error{Errc::kTimeout, {}});
    PendingLookup lookup;
    bool answered = false;
    bool over = false;  // dropped, or its answer was taken: it needs its lookup no more
  };
  using EntryPtr = std::shared_ptr<Entry>;

  // What callbacks share with the filter, and outlives it. A lookup is never cancelled with the
  // lock, since that waits for its callback.
  class State {
   public:
    State(OnReady on_ready, OnDropped on_dropped, bool in_order)
        : on_ready_(std::move(on_ready)), on_dropped_(std::move(on_dropped)), in_order_(in_order) {}

    /// @return false: a function that it has called has destroyed the filter
    bool add(const EntryPtr& entry, std::size_t most) {
      EntryPtr displaced;
      PendingLookup cancelled;
      std::unique_lock<std::mutex> lock(mutex_);
      if (waiting_.size() >= std::max<std::size_t>(most, 1)) {
        displaced = std::move(waiting_.front());
        waiting_.pop_front();
        displaced->over = true;
        cancelled = std::move(displaced->lookup);
        active_.erase(displaced);
      }
      waiting_.push_back(entry);
      active_.insert(entry);
      if (!displaced) return true;
      lock.unlock();
      cancelled.cancel();
      if (on_dropped_) {
        on_dropped_(std::move(displaced->message),
                    Error{Errc::kTooMuch, "more than " + std::to_string(most) + " messages wait"});
      }
      lock.lock();
      pass_on(lock);
      return !closed_;
    }

    // The lookup has begun, and may have ended already.
    void started(Entry& entry, PendingLookup& lookup) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!entry.over) entry.lookup = std::move(lookup);
    }

    void take(const EntryPtr& entry, Result<StampedTransform> X_TF) {
      std::unique_lock<std::mutex> lock(mutex_);
      if (closed_ || entry->over) return;
      entry->X_TF = std::move(X_TF);
      entry->answered = true;
      if (!in_order_) {
        waiting_.erase(std::find(waiting_.begin(), waiting_.end(), entry));
        ready_.push_back(entry);
      }
      pass_on(lock);
      entry->over = true;
      active_.erase(entry);
      const PendingLookup own = std::move(entry->lookup);
      lock.unlock();
    }

    void close() {
      std::vector<PendingLookup> all;
      const std::lock_guard<std::mutex> one_at_a_time(closing_);
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        closed_ = true;
        for (const EntryPtr& entry : active_) all.push_back(std::move(entry->lookup));
        active_.clear();
        waiting_.clear();
        ready_.clear();
      }
      all.clear();  // waits for callbacks
    }

    std::size_t waiting() {
      const std::lock_guard<std::mutex> lock(mutex_);
      return waiting_.size();
    }

   private:
    // One thread at a time passes on what is ready.
    void pass_on(std::unique_lock<std::mutex>& lock) {
      while (in_order_ && !waiting_.empty() && waiting_.front()->answered) {
        ready_.push_back(std::move(waiting_.front()));
        waiting_.pop_front();
      }
      while (!delivering_ && !ready_.empty() && !closed_) {
        const EntryPtr next = std::move(ready_.front());
        ready_.pop_front();
        delivering_ = true;
        lock.unlock();
        deliver(*next);
        lock.lock();
        delivering_ = false;
      }
    }

    void deliver(Entry& entry) {
      if (entry.X_TF) {
        on_ready_(std::move(entry.message), *entry.X_TF);
      } else if (on_dropped_) {
        on_dropped_(std::move(entry.message), entry.X_TF.error());
      }
    }

    const OnReady on_ready_;
    const OnDropped on_dropped_;
    const bool in_order_;
    std::mutex closing_;
    std::mutex mutex_;
    std::deque<EntryPtr> waiting_;         // as pushed
    std::deque<EntryPtr> ready_;           // to be passed on
    std::unordered_set<EntryPtr> active_;  // whose lookup is needed
    bool delivering_ = false;
    bool closed_ = false;
  };

  Client& client_;
  const MessageFilterOptions options_;
  const std::shared_ptr<State> state_;
};

}  // namespace tfdude
