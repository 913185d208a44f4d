#include "simulation/invariants.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "simulation/operation.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {
namespace {

// For a call whose process hung when it should have ended.
constexpr milliseconds kLookAgain{100};

std::string name_of(const Process& one) {
  return "process " + std::to_string(one.id()) +
         (one.partition().empty() ? std::string() : " of " + one.partition());
}

}  // namespace

void Invariants::after(Process& one) {
  if (one.ended()) return;
  Known& known = known_[one.id()];
  if (std::exchange(known.inputs, one.inputs()) == one.inputs()) return;
  if (one.serves_or_claims()) check_incarnation(one, known);
  check_heard(one, known);
  const std::uint64_t structure = one.forest().structure_version();
  if (std::exchange(known.structure, structure) != structure) check_structure(one);
}

void Invariants::check_incarnation(Process& one, Known& known) {
  const std::uint64_t now = one.member().presence().incarnation;
  if (now == known.incarnation) return;
  if (now < known.incarnation) {
    violation_("an incarnation goes back", name_of(one) + " was " +
                                               std::to_string(known.incarnation) + " and is " +
                                               std::to_string(now));
  }
  known.incarnation = now;
  const auto [first, fresh] = numbers_.try_emplace({one.partition(), now}, one.id());
  if (!fresh && first->second != one.id()) {
    violation_("two processes have one incarnation",
               name_of(one) + " and process " + std::to_string(first->second));
  }
}

void Invariants::check_heard(Process& one, Known& known) {
  const Directory& directory = one.directory();
  std::map<std::string, Heard> others;
  for (const Owner owner : directory.reachable_owners()) {
    const std::string& name = directory.name(owner);
    Heard now{directory.latest_incarnation(name), directory.epoch(owner)};
    const auto before = known.others.find(name);
    if (before != known.others.end()) {
      const Heard& then = before->second;
      const bool same = now.incarnation == then.incarnation;
      const bool falls = now.epoch < then.epoch;
      if (now.incarnation < then.incarnation || (same && falls && !then.may_fall)) {
        violation_("what is known of a partition goes back",
                   name_of(one) + " knew " + name + " as " + std::to_string(then.incarnation) +
                       " in epoch " + std::to_string(then.epoch) + ", and now as " +
                       std::to_string(now.incarnation) + " in epoch " + std::to_string(now.epoch));
      }
      now.may_fall = !same || (then.may_fall && !falls);
    }
    others.emplace(name, now);
  }
  known.others = std::move(others);
}

void Invariants::check_structure(Process& one) {
  const auto frames = one.forest().frames();
  std::unordered_map<std::string_view, const FrameInfo*> by_id;
  for (const FrameInfo& frame : frames) by_id.emplace(frame.id, &frame);
  std::size_t held = 0;
  for (const FrameInfo& frame : frames) {
    held += frame.owner == kHeldHere ? 1 : 0;
    std::size_t steps = 0;
    for (auto at = by_id.find(frame.id); at != by_id.end(); at = by_id.find(at->second->parent)) {
      if (++steps <= frames.size()) continue;
      violation_("a cycle of frames", name_of(one) + " sees " + frame.id + " below itself");
      return;
    }
  }
  const Partition* own = one.member().partition();
  if (own == nullptr || !one.member().given_up().empty() || own->frame_count() == held) return;
  violation_("an owner's pages are not its frames",
             name_of(one) + " holds " + std::to_string(held) + " frames, and publishes " +
                 std::to_string(own->frame_count()));
}

void Invariants::publishes(const Process& one, const Sample& sample) {
  const auto* page = std::get_if<Page>(&sample);
  if (page == nullptr) return;
  std::uint64_t& before = known_[one.id()].published[page->number];
  if (page->epoch <= before) {
    violation_("an epoch goes back",
               name_of(one) + " publishes page " + std::to_string(page->number) + " in epoch " +
                   std::to_string(page->epoch) + " after " + std::to_string(before));
  }
  before = page->epoch;
  if (one.stored_epoch() >= page->epoch) return;
  violation_("something is published that is not stored",
             name_of(one) + " publishes epoch " + std::to_string(page->epoch) +
                 ", and has stored " + std::to_string(one.stored_epoch()));
}

void Invariants::replies(const Process& one, const Reply& reply) {
  if (std::holds_alternative<Error>(reply.body) || one.stored_epoch() >= reply.epoch) return;
  violation_("something is acknowledged that is not stored",
             name_of(one) + " acknowledges epoch " + std::to_string(reply.epoch) +
                 ", and has stored " + std::to_string(one.stored_epoch()));
}

void Invariants::called(const std::shared_ptr<Process>& caller,
                        const std::shared_ptr<Operation>& call, const std::string& what,
                        Instant must_end) {
  calls_.emplace(must_end, Call{caller, call, what});
}

void Invariants::after(Instant now) {
  while (!calls_.empty() && calls_.begin()->first < now) {
    const auto late = calls_.extract(calls_.begin()).mapped();
    const auto caller = late.caller.lock();
    const auto call = late.call.lock();
    if (!caller || caller->ended() || !call || call->over()) continue;
    if (caller->hung_since(now - kLookAgain)) {
      calls_.emplace(now + kLookAgain, late);
    } else {
      violation_("a call does not end", name_of(*caller) + ": " + late.what);
    }
  }
}

}  // namespace tfdude::simulation
