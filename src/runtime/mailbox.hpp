#pragma once

#include <atomic>
#include <memory>
#include <utility>

namespace tfdude {

/// Hands the newest of what a maker makes to one user, who never waits, allocates or frees: what it has no more goes back to
/// the maker, who frees it.
/// @par Thread safety  put() and collect() are of one thread at a time, newest() of another one.
template <class T>
class Mailbox {
 public:
  Mailbox() = default;
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;
  ~Mailbox() {
    delete current_;
    delete next_.load();
    collect();
  }

  /// What was put before and not taken goes.
  void put(T value) {
    delete next_.exchange(new Letter{std::move(value), nullptr}, std::memory_order_acq_rel);
  }

  /// Frees what the user has no more.
  void collect() {
    Letter* letter = used_.exchange(nullptr, std::memory_order_acquire);
    while (letter != nullptr) delete std::exchange(letter, letter->below);
  }

  /// Null before the first. The user's until it asks again.
  [[nodiscard]] T* newest() {
    if (next_.load(std::memory_order_relaxed) != nullptr) {
      Letter* before = std::exchange(current_, next_.exchange(nullptr, std::memory_order_acq_rel));
      if (before != nullptr) give_back(before);
    }
    return current_ != nullptr ? &current_->value : nullptr;
  }

 private:
  struct Letter {
    T value;
    Letter* below;
  };

  // Tried again only where the maker collects at that moment, and then there is nothing below.
  void give_back(Letter* letter) {
    letter->below = used_.load(std::memory_order_relaxed);
    while (!used_.compare_exchange_weak(letter->below, letter, std::memory_order_release,
                                        std::memory_order_relaxed)) {
    }
  }

  std::atomic<Letter*> next_{nullptr};
  std::atomic<Letter*> used_{nullptr};  // a stack
  Letter* current_ = nullptr;           // the user's
};

}  // namespace tfdude
