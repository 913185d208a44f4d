#include "runtime/yielding.hpp"

#include <set>

#include "base/mutex.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"

namespace tfdude {
namespace {

// Minimum interval at which others are asked whether an apparent conflict is real.
constexpr Milliseconds kYieldEvery{100};

}  // namespace

Yielding::Yielding(const Context& context)
    : context_(context),
      yields_(
          context.threads.asking,
          [this] {
            yield();
            return Loop::kNever;
          },
          kYieldEvery) {}

void Yielding::yield() {
  const std::set<PendingYield> due =
      context_.member.with_rules([](const Member& member) { return member.pending_yields(); });
  if (due.empty()) return;
  const bool current = catch_up();
  context_.member.yield(due, current);
}

bool Yielding::catch_up() {
  CatchUpTask task;
  if (!context_.requests.run(task, Deadline(context_.options.timeout))) return false;
  const Lock lock(context_.structure.mutex);
  return task.caught_up(context_.structure.directory);
}

}  // namespace tfdude
