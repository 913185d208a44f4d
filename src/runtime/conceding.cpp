#include "runtime/conceding.hpp"

#include <set>
#include <string>
#include <vector>

namespace tfdude {
namespace {

// How often at most the others are asked whether what seems to be a conflict is one.
constexpr Milliseconds kConcedeEvery{100};

}  // namespace

void Conceding::start() {
  thread_.emplace(kConcedeEvery, [this] { concede(); });
}

void Conceding::stop() {
  if (thread_) thread_->stop();
}

void Conceding::concede() {
  const std::set<Concession> due =
      member_.with_rules([](const Member& member) { return member.concessions(); });
  if (due.empty()) return;
  const bool current = catch_up();
  member_.concede(due, current);
}

// Whether all that those who are reachable had changed when this was called is known here now.
bool Conceding::catch_up() {
  const Deadline deadline(timeout_);
  std::vector<Part> parts;
  {
    const std::lock_guard lock(structure_.mutex);
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
    const std::lock_guard lock(structure_.mutex);
    const Owner owner = parts[i].owner;
    const bool is_here = answered && structure_.directory.epoch(owner) >= replies[i].epoch;
    current = current && (is_here || !structure_.directory.reachable(owner));
  }
  return current;
}

}  // namespace tfdude
