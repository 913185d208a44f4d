#include "base/loop.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string>
#include <system_error>
#include <utility>

#include "base/log.hpp"
#include "base/thread_name.hpp"

namespace tfdude {
namespace {

// All loops count together.
void log_no_thread(const Error& error) {
  static std::atomic<std::uint64_t> times{0};
  if (is_logged(++times)) log().error("{}: what it should do waits", error.message);
}

}  // namespace

Result<void> Loop::begin() {
  const Lock lock(mutex_);
  return begin_thread();
}

Result<void> Loop::begin_thread() {
  if (stopping_ || thread_.joinable()) return {};
  try {
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error& error) {
    return fail(Errc::kTransport, std::string("no thread '") + name_ + "': " + error.what());
  }
  return {};
}

void Loop::stop() {
  std::thread ending;
  {
    const Lock lock(mutex_);
    stopping_ = true;
    ending = std::move(thread_);
  }
  changed_.notify_one();
  if (ending.joinable()) ending.join();
}

// The lock prevents a notification between the thread's check and its sleep.
void Loop::wake() {
  {
    const Lock lock(mutex_);
    if (stopping_) return;
    if (const auto begun = begin_thread(); !begun) {
      log_no_thread(begun.error());
      keep_asked();
    }
  }
  changed_.notify_one();
}

// A job that was asked for wakes the loop only with its first request.
void Loop::keep_asked() {
  for (Job* job : jobs_) {
    if (job->asked_.exchange(false)) job->due_ = Clock::now();
  }
}

void Loop::run() {
  name_this_thread(name_);
  Lock lock(mutex_);
  while (!stopping_) {
    auto wake_at = kNever;
    if (Job* due = next_due(Clock::now(), wake_at)) {
      run(*due);
    } else if (wake_at == kNever) {
      changed_.wait(lock);
    } else {
      changed_.wait_until(lock, wake_at);
    }
  }
}

Loop::Job* Loop::next_due(Clock::time_point now, Clock::time_point& wake_at) {
  for (Job* job : jobs_) {
    const auto due = job->pending() ? std::min(job->due_, job->rests_until_) : job->due_;
    if (due <= now) return job;
    wake_at = std::min(wake_at, due);
  }
  return nullptr;
}

void Loop::run(Job& job) {
  const auto turn = std::find(jobs_.begin(), jobs_.end(), &job);
  std::rotate(turn, turn + 1, jobs_.end());
  running_ = &job;
  job.due_ = kNever;
  mutex_.unlock();
  // Before the run, so that changes during it are not missed.
  job.asked_.store(false);
  const auto again = job.run_();
  mutex_.lock();
  running_ = nullptr;
  job.due_ = std::min(job.due_, again);
  job.rests_until_ = Clock::now() + job.rest_;
  ended_.notify_all();
}

Loop::Job::Job(Loop& loop, Run run, std::chrono::nanoseconds rest)
    : loop_(loop), run_(std::move(run)), rest_(rest) {
  const Lock lock(loop_.mutex_);
  loop_.jobs_.push_back(this);
}

void Loop::Job::ask_by(Clock::time_point time) {
  {
    const Lock lock(loop_.mutex_);
    if (time >= due_) return;
    due_ = time;
  }
  loop_.wake();
}

void Loop::Job::stop() {
  Lock lock(loop_.mutex_);
  auto& jobs = loop_.jobs_;
  jobs.erase(std::remove(jobs.begin(), jobs.end(), this), jobs.end());
  loop_.ended_.wait(lock,
                    [this]() TFDUDE_REQUIRES(loop_.mutex_) { return loop_.running_ != this; });
}

}  // namespace tfdude
