#include "runtime/yielding.hpp"

#include <set>
#include <string>
#include <vector>

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

// Whether everything that reachable participants had changed at the time of the call is known here
// now.
bool Yielding::catch_up() {
  const Deadline deadline(timeout_);
  std::vector<Part> parts;
  {
    const Lock lock(structure_.mutex);
    for (const Owner owner : structure_.directory.reachable_owners()) {
      const std::string& name = structure_.directory.name(owner);
      parts.push_back({owner, name, Request{0, name, RemoveRequest{}}});
    }
  }
  const std::vector<Reply> replies = requests_.ask(parts, deadline);
  bool current = true;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool answered = std::holds_alternative<Done>(replies[i].body);
    if (answered) requests_.await_change(parts[i], replies[i], deadline);
    const Lock lock(structure_.mutex);
    const Owner owner = parts[i].owner;
    const bool is_here = answered && structure_.directory.epoch(owner) >= replies[i].epoch;
    current = current && (is_here || !structure_.directory.reachable(owner));
  }
  return current;
}

}  // namespace tfdude
