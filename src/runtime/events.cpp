#include "runtime/events.hpp"

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {
namespace {

/// A change, and the last listener subscribed when it happened.
struct Waiting {
  Change change;
  std::uint64_t last_subscriber = 0;
};

}  // namespace

struct Events::State {
  /// The next change to report; empty at the end.
  [[nodiscard]] std::optional<Waiting> next(Lock& lock) TFDUDE_REQUIRES(mutex);

  Mutex mutex;
  Condition changed;
  std::map<std::uint64_t, std::shared_ptr<const Callback>> subscribers TFDUDE_GUARDED_BY(mutex);
  std::uint64_t last_subscriber = 0;
  std::uint64_t running TFDUDE_GUARDED_BY(mutex) = 0;  // the subscriber being called
  std::thread::id teller TFDUDE_GUARDED_BY(mutex);
  std::deque<Waiting> waiting TFDUDE_GUARDED_BY(mutex);
  std::size_t missed TFDUDE_GUARDED_BY(mutex) = 0;
  bool stopping TFDUDE_GUARDED_BY(mutex) = false;
};

Events::Events() : state_(std::make_shared<State>()) {}

Events::~Events() { stop(); }

std::uint64_t Events::subscribe(Callback callback) {
  const Lock lock(state_->mutex);
  const std::uint64_t subscriber = ++state_->last_subscriber;
  if (state_->stopping) return subscriber;
  if (!thread_.joinable()) {
    thread_ = std::thread([state = state_] { run(*state); });
    state_->teller = thread_.get_id();
  }
  state_->subscribers.emplace(subscriber, std::make_shared<const Callback>(std::move(callback)));
  return subscriber;
}

void Events::unsubscribe(std::uint64_t subscriber) {
  std::shared_ptr<const Callback> dropped;  // destroyed without the lock
  Lock lock(state_->mutex);
  const auto found = state_->subscribers.find(subscriber);
  if (found != state_->subscribers.end()) {
    dropped = std::move(found->second);
    state_->subscribers.erase(found);
  }
  if (state_->teller != std::this_thread::get_id()) {
    state_->changed.wait(
        lock, [&]() TFDUDE_REQUIRES(state_->mutex) { return state_->running != subscriber; });
  }
  lock.unlock();
}

void Events::post(std::vector<Change> changes) {
  {
    const Lock lock(state_->mutex);
    if (state_->subscribers.empty() || state_->stopping) return;
    for (Change& change : changes) {
      if (state_->waiting.size() < kMaxWaiting) {
        state_->waiting.push_back({std::move(change), state_->last_subscriber});
      } else {
        ++state_->missed;
      }
    }
  }
  state_->changed.notify_all();
}

void Events::stop() {
  std::map<std::uint64_t, std::shared_ptr<const Callback>> dropped;  // destroyed without the lock
  std::thread thread;
  {
    const Lock lock(state_->mutex);
    state_->stopping = true;
    dropped.swap(state_->subscribers);
    thread.swap(thread_);
  }
  state_->changed.notify_all();
  if (!thread.joinable()) return;
  if (thread.get_id() == std::this_thread::get_id()) {
    thread.detach();  // it ends with the listener that calls this
  } else {
    thread.join();
  }
}

std::optional<Waiting> Events::State::next(Lock& lock) {
  changed.wait(
      lock, [this]() TFDUDE_REQUIRES(mutex) { return stopping || !waiting.empty() || missed > 0; });
  if (stopping) return std::nullopt;
  if (waiting.empty()) {
    Change change{ChangeKind::kMissed, {}, {}, {}, {}, {}, {}};
    change.message = std::to_string(std::exchange(missed, 0)) +
                     " changes were dropped: the listeners are too slow";
    return Waiting{std::move(change), last_subscriber};
  }
  Waiting first = std::move(waiting.front());
  waiting.pop_front();
  return first;
}

void Events::run(State& state) {
  Lock lock(state.mutex);
  while (const auto waiting = state.next(lock)) {
    for (std::uint64_t told = 0;;) {
      const auto subscriber = state.subscribers.upper_bound(told);
      if (subscriber == state.subscribers.end() || subscriber->first > waiting->last_subscriber) {
        break;
      }
      told = state.running = subscriber->first;
      auto callback = subscriber->second;
      lock.unlock();
      (*callback)(waiting->change);
      callback.reset();  // objects it holds are destroyed before the end of the call is reported
      lock.lock();
      state.running = 0;
      state.changed.notify_all();
    }
  }
}

}  // namespace tfdude
