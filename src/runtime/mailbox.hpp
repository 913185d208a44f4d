#pragma once

#include <atomic>
#include <memory>
#include <utility>

namespace tfdude {

/// Passes the newest object of a producer to one user, which never waits, allocates or frees:
/// objects that it no longer uses go back to the producer, which frees them.
/// @par Thread safety  put() and collect() belong to one thread at a time, newest() to another one.
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

  /// Replaces an object that was not taken.
  void put(T value) {
    delete next_.exchange(new Letter{std::move(value), nullptr}, std::memory_order_acq_rel);
  }

  /// Frees objects that the user no longer uses.
  void collect() {
    Letter* letter = used_.exchange(nullptr, std::memory_order_acquire);
    while (letter != nullptr) delete std::exchange(letter, letter->below);
  }

  /// Null before the first object. It stays valid until the next call.
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

  // Repeated only if the producer collects at that moment; then nothing is below.
  void give_back(Letter* letter) {
    letter->below = used_.load(std::memory_order_relaxed);
    while (!used_.compare_exchange_weak(letter->below, letter, std::memory_order_release,
                                        std::memory_order_relaxed)) {
    }
  }

  std::atomic<Letter*> next_{nullptr};
  std::atomic<Letter*> used_{nullptr};  // a stack
  Letter* current_ = nullptr;           // in use by the user
};

}  // namespace tfdude
