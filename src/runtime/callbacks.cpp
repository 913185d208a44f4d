#include "runtime/callbacks.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/acting_thread.hpp"
#include "base/log.hpp"
#include "base/mutex.hpp"
#include "base/thread_name.hpp"

namespace tfdude {

struct Callbacks::Line::Waiting {
  std::deque<Call> calls;
  bool in_turn = false;  // among the lines whose next call is due, or will be
  bool running = false;
  std::thread::id runner;
  bool closed = false;
};

struct Callbacks::State {
  static void run(const std::shared_ptr<State>& state);

  /// Lets the line's next call run at this time. @return whether to look after the lines
  [[nodiscard]] static bool add(const std::shared_ptr<State>& state, Line& line,
                                Clock::time_point due) TFDUDE_REQUIRES(state->mutex);
  static void add_thread(const std::shared_ptr<State>& state) TFDUDE_REQUIRES(state->mutex);
  /// Whether lines wait, nobody is there to run them, and nobody looks after them.
  [[nodiscard]] bool must_look() TFDUDE_REQUIRES(mutex);
  /// Runs the first call of the line that is due first. @return whether the thread goes on
  [[nodiscard]] bool run_first() TFDUDE_REQUIRES(mutex);
  /// The calls that are dropped, to be destroyed without the lock.
  [[nodiscard]] std::vector<std::deque<Call>> drop() TFDUDE_REQUIRES(mutex);

  Mutex mutex;
  Condition changed;
  Condition ended;  // a call
  std::multimap<Clock::time_point, std::shared_ptr<Line>> due TFDUDE_GUARDED_BY(mutex);
  // When a call last started, or a thread was added.
  Clock::time_point moved TFDUDE_GUARDED_BY(mutex) = Clock::time_point::min();
  std::size_t idle TFDUDE_GUARDED_BY(mutex) = 0;  // threads that run no call
  bool looked_after TFDUDE_GUARDED_BY(mutex) = false;
  bool stopping TFDUDE_GUARDED_BY(mutex) = false;
  Loop::Job* look = nullptr;  // until the end
  std::map<std::thread::id, std::thread> threads TFDUDE_GUARDED_BY(mutex);
  std::vector<std::thread> left TFDUDE_GUARDED_BY(mutex);  // to be joined
};

// ---- lines

Callbacks::Line::Line(std::shared_ptr<State> state, Milliseconds gather)
    : state_(std::move(state)), gather_(gather), waiting_(std::make_unique<Waiting>()) {}

Callbacks::Line::~Line() = default;

void Callbacks::Line::post(Call call) {
  prepare(std::move(call));
  go();
}

void Callbacks::Line::prepare(Call call) {
  const Lock lock(state_->mutex);
  if (!waiting_->closed && !state_->stopping) waiting_->calls.push_back(std::move(call));
}

void Callbacks::Line::go() {
  bool look = false;
  {
    const Lock lock(state_->mutex);
    if (waiting_->calls.empty() || waiting_->in_turn || waiting_->running) return;
    look = State::add(state_, *this, Clock::now() + gather_);
  }
  if (look) state_->look->ask_by(Clock::now() + kPatience);
}

std::shared_ptr<Callbacks::Line> Callbacks::Line::another() const {
  return std::make_shared<Line>(state_, Milliseconds(0));
}

void Callbacks::Line::close() {
  std::deque<Call> dropped;  // destroyed without the lock
  Lock lock(state_->mutex);
  waiting_->closed = true;
  dropped.swap(waiting_->calls);
  if (waiting_->runner != acting_thread()) {
    state_->ended.wait(lock,
                       [this]() TFDUDE_REQUIRES(state_->mutex) { return !waiting_->running; });
  }
  lock.unlock();
}

bool Callbacks::Line::closed() const {
  const Lock lock(state_->mutex);
  return waiting_->closed;
}

// ---- threads

bool Callbacks::State::add(const std::shared_ptr<State>& state, Line& line, Clock::time_point due) {
  if (state->stopping) return false;
  line.waiting_->in_turn = true;
  if (state->due.empty()) state->moved = Clock::now();
  const auto added = state->due.emplace(due, line.shared_from_this());
  if (state->threads.empty()) add_thread(state);
  if (added == state->due.begin()) state->changed.notify_one();
  return state->must_look();
}

void Callbacks::State::add_thread(const std::shared_ptr<State>& state) {
  for (std::thread& one : std::exchange(state->left, {})) one.join();
  state->moved = Clock::now();
  try {
    std::thread added([state] { run(state); });
    const auto id = added.get_id();
    state->threads.emplace(id, std::move(added));
    ++state->idle;
  } catch (const std::system_error& error) {
    log().warn("no thread for a callback, which waits for another: {}", error.what());
  }
}

bool Callbacks::State::must_look() {
  return !due.empty() && idle == 0 && !std::exchange(looked_after, true);
}

void Callbacks::State::run(const std::shared_ptr<State>& state) {
  name_this_thread("tfdude-callback");
  Lock lock(state->mutex);
  while (!state->stopping) {
    const auto now = Clock::now();
    const auto first = state->due.empty() ? Clock::time_point::max() : state->due.begin()->first;
    if (first <= now) {
      if (!state->run_first()) return;
    } else if (state->due.empty()) {
      state->changed.wait(lock);
    } else {
      state->changed.wait_until(lock, first);
    }
  }
}

bool Callbacks::State::run_first() {
  const auto line = std::move(due.begin()->second);
  due.erase(due.begin());
  Line::Waiting& waiting = *line->waiting_;
  waiting.in_turn = false;
  if (waiting.calls.empty()) return true;
  Call call = std::move(waiting.calls.front());
  waiting.calls.pop_front();
  waiting.running = true;
  waiting.runner = acting_thread();
  moved = Clock::now();
  --idle;
  const bool looks = must_look();
  mutex.unlock();
  if (looks) look->ask_by(Clock::now() + kPatience);
  call();
  call = nullptr;  // what it holds is destroyed without the lock, and before its end is reported
  mutex.lock();
  ++idle;
  waiting.running = false;
  waiting.runner = {};
  ended.notify_all();
  if (stopping) {
    auto dropped = std::exchange(waiting.calls, {});
    mutex.unlock();
    dropped.clear();
    mutex.lock();
    return false;
  }
  const auto now = Clock::now();
  if (!waiting.calls.empty()) {
    waiting.in_turn = true;
    due.emplace(now, line);
  }
  if (idle == 1 || (!due.empty() && due.begin()->first <= now)) return true;
  --idle;
  const auto self = threads.find(acting_thread());
  left.push_back(std::move(self->second));
  threads.erase(self);
  return false;
}

std::vector<std::deque<Callbacks::Call>> Callbacks::State::drop() {
  std::vector<std::deque<Call>> dropped;
  for (auto& [time, line] : due) dropped.push_back(std::exchange(line->waiting_->calls, {}));
  due.clear();
  return dropped;
}

// ---- all lines

Callbacks::Callbacks(Loop& loop)
    : state_(std::make_shared<State>()), look_(loop, [this] { return look_after(); }) {
  state_->look = &look_;
}

std::shared_ptr<Callbacks::Line> Callbacks::line(Milliseconds gather) {
  return std::make_shared<Line>(state_, gather);
}

Callbacks::Clock::time_point Callbacks::look_after() {
  const Lock lock(state_->mutex);
  state_->looked_after = false;
  if (state_->stopping || state_->idle > 0 || state_->due.empty()) return Loop::kNever;
  const auto first = state_->due.begin()->first;
  const auto at = std::min(std::max(first, state_->moved) + kPatience, first + kPatienceWithBusy);
  if (Clock::now() >= at) State::add_thread(state_);
  if (state_->idle > 0) return Loop::kNever;
  state_->looked_after = true;
  return std::max(at, Clock::now() + kPatience);
}

void Callbacks::stop() {
  std::map<std::thread::id, std::thread> threads;
  std::vector<std::thread> left;
  std::vector<std::deque<Call>> dropped;
  {
    const Lock lock(state_->mutex);
    state_->stopping = true;
    threads.swap(state_->threads);
    left.swap(state_->left);
    dropped = state_->drop();
  }
  state_->changed.notify_all();
  dropped.clear();
  for (auto& [id, thread] : threads) {
    if (id == acting_thread()) {
      thread.detach();  // it ends with the call that calls this
    } else {
      thread.join();
    }
  }
  for (std::thread& thread : left) thread.join();
  look_.stop();
}

}  // namespace tfdude
