#include "runtime/callbacks.hpp"

#include <deque>
#include <map>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "base/mutex.hpp"

namespace tfdude {

struct Callbacks::State {
  Mutex mutex;
  Condition changed;
  std::deque<Job> jobs TFDUDE_GUARDED_BY(mutex);
  // When a job was last started, or a thread added.
  Clock::time_point moved TFDUDE_GUARDED_BY(mutex) = Clock::time_point::min();
  std::size_t idle TFDUDE_GUARDED_BY(mutex) = 0;
  bool stopping TFDUDE_GUARDED_BY(mutex) = false;
  std::map<std::thread::id, std::thread> threads TFDUDE_GUARDED_BY(mutex);
  std::vector<std::thread> ended TFDUDE_GUARDED_BY(mutex);  // to be joined
};

Callbacks::Callbacks() : state_(std::make_shared<State>()) {}

// Called under the lock, which the header cannot name, as it does not know the state.
void Callbacks::add_thread(const std::shared_ptr<State>& state) TFDUDE_UNCHECKED_LOCKS {
  for (std::thread& one : std::exchange(state->ended, {})) one.join();
  state->moved = Clock::now();
  try {
    std::thread added([state] { run(state); });
    const auto id = added.get_id();
    state->threads.emplace(id, std::move(added));
  } catch (const std::system_error& error) {
    log().warn("no thread for a callback, which waits for another: {}", error.what());
  }
}

void Callbacks::post(Job job) {
  {
    const Lock lock(state_->mutex);
    if (state_->stopping) return;
    if (state_->jobs.empty()) state_->moved = Clock::now();
    state_->jobs.push_back(std::move(job));
    if (state_->threads.empty()) add_thread(state_);
  }
  state_->changed.notify_one();
}

std::optional<Callbacks::Clock::time_point> Callbacks::look_after(Clock::time_point now) {
  const Lock lock(state_->mutex);
  if (state_->stopping || state_->jobs.empty()) return std::nullopt;
  if (now >= state_->moved + kPatience) add_thread(state_);
  return state_->moved + kPatience;
}

void Callbacks::run(const std::shared_ptr<State>& state) {
  Lock lock(state->mutex);
  while (true) {
    ++state->idle;
    state->changed.wait(lock, [&]() TFDUDE_REQUIRES(state->mutex) {
      return state->stopping || !state->jobs.empty();
    });
    --state->idle;
    if (state->stopping) return;
    Job job = std::move(state->jobs.front());
    state->jobs.pop_front();
    state->moved = Clock::now();
    lock.unlock();
    job();
    job = nullptr;  // objects it holds are destroyed without the lock, and before stop() returns
    lock.lock();
    if (state->stopping) return;
    if (state->idle > 0 && state->jobs.empty()) {
      const auto self = state->threads.find(std::this_thread::get_id());
      state->ended.push_back(std::move(self->second));
      state->threads.erase(self);
      return;
    }
  }
}

void Callbacks::stop() {
  std::map<std::thread::id, std::thread> threads;
  std::vector<std::thread> ended;
  std::deque<Job> dropped;  // destroyed without the lock, too
  {
    const Lock lock(state_->mutex);
    state_->stopping = true;
    threads.swap(state_->threads);
    ended.swap(state_->ended);
    dropped.swap(state_->jobs);
  }
  state_->changed.notify_all();
  dropped.clear();
  for (auto& [id, thread] : threads) {
    if (id == std::this_thread::get_id()) {
      thread.detach();  // it ends with the job that calls this
    } else {
      thread.join();
    }
  }
  for (std::thread& thread : ended) thread.join();
}

}  // namespace tfdude
