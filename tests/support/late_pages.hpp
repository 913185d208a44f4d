#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <utility>

#include "support/relay.hpp"

namespace tfdude::testing {

/// A transport that can delay the pages of one partition, as a starved process or a bad link does.
class LatePages final : public Relay {
 public:
  using Relay::Relay;

  /// From now on the pages of this partition wait.
  void hold(const std::string& partition) {
    const std::lock_guard lock(mutex_);
    held_ = partition;
  }
  /// Waits for a page, and passes on the oldest one.
  void let_one_through() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_.empty(); });
    const Page page = std::move(waiting_.front());
    waiting_.pop_front();
    handler().on_page(page);
  }
  /// Passes on all of them in order, and no longer delays pages.
  void let_through() {
    const std::lock_guard lock(mutex_);
    held_.clear();
    for (const Page& page : std::exchange(waiting_, {})) handler().on_page(page);
  }
  /// Waits until the partition was asked for the epoch of its structure.
  [[nodiscard]] bool wait_until_asked(Milliseconds longest) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, longest, [this] { return asked_; });
  }

  using Relay::send;
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    const auto* remove = std::get_if<RemoveRequest>(&request.body);
    if (remove != nullptr && remove->tops.empty()) {
      const std::lock_guard lock(mutex_);
      asked_ = asked_ || partition == held_;
      changed_.notify_all();
    }
    return Relay::send(partition, request, deadline);
  }

 private:
  void on_page(const Page& page) override {
    const std::lock_guard lock(mutex_);
    if (page.partition != held_) return handler().on_page(page);
    waiting_.push_back(page);
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::string held_;  // empty: none
  std::deque<Page> waiting_;
  bool asked_ = false;
};

}  // namespace tfdude::testing
