#include "runtime/renewal_loop.hpp"

#include <algorithm>
#include <utility>

namespace tfdude {

RenewalLoop::RenewalLoop(Milliseconds renew_every, Milliseconds retry_after, Round round)
    : renew_every_(renew_every),
      retry_after_(retry_after),
      round_(std::move(round)),
      thread_([this] { run(); }) {}

void RenewalLoop::ask() {
  {
    const Lock lock(mutex_);
    asked_ = true;
  }
  changed_.notify_one();
}

void RenewalLoop::lack() {
  {
    const Lock lock(mutex_);
    if (std::exchange(lacking_, true)) return;
  }
  changed_.notify_one();
}

void RenewalLoop::stop() {
  {
    const Lock lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void RenewalLoop::wait(Lock& lock, Clock::time_point renew_at) {
  while (!stopping_ && !asked_) {
    const auto wake_at = lacking_ ? std::min(renew_at, last_round_ + retry_after_) : renew_at;
    if (Clock::now() >= wake_at) return;
    changed_.wait_until(lock, wake_at);
  }
}

void RenewalLoop::run() {
  auto renew_at = Clock::now() + renew_every_;
  Lock lock(mutex_);
  while (true) {
    wait(lock, renew_at);
    if (stopping_) return;
    // Before the round sees what is watched: what comes later is asked for again.
    asked_ = false;
    lacking_ = false;
    last_round_ = Clock::now();
    lock.unlock();
    const bool renew = Clock::now() >= renew_at;
    if (renew) renew_at = Clock::now() + renew_every_;
    const bool all_well = round_(renew);
    lock.lock();
    lacking_ = lacking_ || !all_well;
  }
}

}  // namespace tfdude
