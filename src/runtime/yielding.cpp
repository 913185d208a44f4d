#include "runtime/yielding.hpp"

#include <set>

#include "base/mutex.hpp"

namespace tfdude {
namespace {

// Minimum interval at which others are asked whether an apparent conflict is real.
constexpr Milliseconds kYieldEvery{100};

}  // namespace

void Yielding::start() {
  thread_.emplace(kYieldEvery, [this] { yield(); });
}

void Yielding::stop() {
  if (thread_) thread_->stop();
}

void Yielding::yield() {
  const std::set<PendingYield> due =
      member_.with_rules([](const Member& member) { return member.pending_yields(); });
  if (due.empty()) return;
  const bool current = catch_up();
  member_.yield(due, current);
}

bool Yielding::catch_up() {
  CatchUpTask task;
  if (!requests_.run(task, Deadline(timeout_))) return false;
  const Lock lock(structure_.mutex);
  return task.caught_up(structure_.directory);
}

}  // namespace tfdude
