#include "runtime/events.hpp"

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "base/acting_thread.hpp"
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
  /// Reports all changes in the queue.
  void report();
  void report(const Waiting& one) TFDUDE_REQUIRES(mutex);
  /// The next change to report; empty if there is none.
  [[nodiscard]] std::optional<Waiting> next() TFDUDE_REQUIRES(mutex);

  Mutex mutex;
  Condition told;
  std::map<std::uint64_t, std::shared_ptr<const Callback>> subscribers TFDUDE_GUARDED_BY(mutex);
  std::uint64_t last_subscriber TFDUDE_GUARDED_BY(mutex) = 0;
  std::uint64_t running TFDUDE_GUARDED_BY(mutex) = 0;  // the subscriber being called
  std::thread::id teller TFDUDE_GUARDED_BY(mutex);
  std::deque<Waiting> waiting TFDUDE_GUARDED_BY(mutex);
  std::size_t missed TFDUDE_GUARDED_BY(mutex) = 0;
  bool reporting TFDUDE_GUARDED_BY(mutex) = false;  // or about to
  bool stopping TFDUDE_GUARDED_BY(mutex) = false;
};

Events::Events(Callbacks& callbacks) : state_(std::make_shared<State>()), line_(callbacks.line()) {}

Events::~Events() { stop(); }

std::uint64_t Events::subscribe(Callback callback) {
  const Lock lock(state_->mutex);
  const std::uint64_t subscriber = ++state_->last_subscriber;
  if (state_->stopping) return subscriber;
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
  if (state_->teller != acting_thread()) {
    state_->told.wait(
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
    if (std::exchange(state_->reporting, true)) return;
  }
  line_->post([state = state_] { state->report(); });
}

void Events::stop() {
  std::map<std::uint64_t, std::shared_ptr<const Callback>> dropped;  // destroyed without the lock
  {
    const Lock lock(state_->mutex);
    state_->stopping = true;
    dropped.swap(state_->subscribers);
    state_->waiting.clear();
  }
  line_->close();
}

std::optional<Waiting> Events::State::next() {
  if (stopping || (waiting.empty() && missed == 0)) return std::nullopt;
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

void Events::State::report() {
  const Lock lock(mutex);
  teller = acting_thread();
  while (const auto one = next()) report(*one);
  reporting = false;
  teller = {};
}

void Events::State::report(const Waiting& one) {
  for (std::uint64_t last = 0;;) {
    const auto subscriber = subscribers.upper_bound(last);
    if (subscriber == subscribers.end() || subscriber->first > one.last_subscriber) return;
    last = running = subscriber->first;
    auto callback = subscriber->second;
    mutex.unlock();
    (*callback)(one.change);
    callback.reset();  // objects it holds are destroyed before the end of the call is reported
    mutex.lock();
    running = 0;
    told.notify_all();
  }
}

}  // namespace tfdude
