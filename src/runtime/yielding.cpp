#include "runtime/yielding.hpp"

#include <set>
#include <string>
#include <vector>

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

// Whether everything that reachable participants had changed at the time of the call is known here
// now.
bool Yielding::catch_up() {
  const Deadline deadline(context_.options.timeout);
  std::vector<Part> parts;
  {
    const Lock lock(context_.structure.mutex);
    for (const Owner owner : context_.structure.directory.reachable_owners()) {
      const std::string& name = context_.structure.directory.name(owner);
      parts.push_back({owner, name, Request{0, name, RemoveRequest{}}});
    }
  }
  const std::vector<Reply> replies = context_.requests.ask(parts, deadline);
  bool current = true;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool answered = std::holds_alternative<Done>(replies[i].body);
    if (answered) context_.requests.await_change(parts[i], replies[i], deadline);
    const Lock lock(context_.structure.mutex);
    const Owner owner = parts[i].owner;
    const bool is_here = answered && context_.structure.directory.epoch(owner) >= replies[i].epoch;
    current = current && (is_here || !context_.structure.directory.reachable(owner));
  }
  return current;
}

}  // namespace tfdude
