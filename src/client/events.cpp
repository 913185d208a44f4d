#include "client/events.hpp"

#include <string>
#include <utility>

namespace tfdude {

Events::~Events() { stop(); }

std::uint64_t Events::subscribe(Callback callback) {
  const std::lock_guard lock(mutex_);
  if (!thread_.joinable() && !stopping_) thread_ = std::thread([this] { run(); });
  subscribers_.emplace(++last_subscriber_, std::make_shared<const Callback>(std::move(callback)));
  return last_subscriber_;
}

void Events::unsubscribe(std::uint64_t subscriber) {
  std::unique_lock lock(mutex_);
  subscribers_.erase(subscriber);
  if (thread_.get_id() == std::this_thread::get_id()) return;
  changed_.wait(lock, [&] { return running_ != subscriber; });
}

void Events::post(std::vector<Change> changes) {
  {
    const std::lock_guard lock(mutex_);
    if (subscribers_.empty()) return;
    for (Change& change : changes) {
      if (waiting_.size() < kMaxWaiting) {
        waiting_.push_back({std::move(change), last_subscriber_});
      } else {
        ++missed_;
      }
    }
  }
  changed_.notify_all();
}

void Events::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::optional<Events::Waiting> Events::next(std::unique_lock<std::mutex>& lock) {
  changed_.wait(lock, [this] { return stopping_ || !waiting_.empty() || missed_ > 0; });
  if (stopping_) return std::nullopt;
  if (waiting_.empty()) {
    Change change{ChangeKind::kMissed, {}, {}, {}, {}, {}, {}};
    change.message = std::to_string(std::exchange(missed_, 0)) +
                     " changes were not told: the listeners take too long";
    return Waiting{std::move(change), last_subscriber_};
  }
  Waiting first = std::move(waiting_.front());
  waiting_.pop_front();
  return first;
}

void Events::run() {
  std::unique_lock lock(mutex_);
  while (const auto waiting = next(lock)) {
    for (std::uint64_t told = 0;;) {
      const auto subscriber = subscribers_.upper_bound(told);
      if (subscriber == subscribers_.end() || subscriber->first > waiting->last_subscriber) break;
      told = running_ = subscriber->first;
      const auto callback = subscriber->second;
      lock.unlock();
      (*callback)(waiting->change);
      lock.lock();
      running_ = 0;
      changed_.notify_all();
    }
  }
}

}  // namespace tfdude
