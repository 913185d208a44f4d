#include "simulation/invariants.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>

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
  std::vector<Heard> others;
  for (const Owner owner : directory.reachable_owners()) {
    const std::string& name = directory.name(owner);
    Heard now{directory.latest_incarnation(name), directory.epoch(owner)};
    if (owner < known.others.size() && known.others[owner].incarnation != 0) {
      const Heard& then = known.others[owner];
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
    others.resize(owner + 1);
    others[owner] = now;
  }
  known.others = std::move(others);
}

void Invariants::check_structure(Process& one) {
  const auto frames = one.forest().frames();
  std::unordered_map<std::string_view, std::size_t> by_id;
  by_id.reserve(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) by_id.emplace(frames[i].id, i);
  std::vector<std::size_t> seen_from(frames.size(), frames.size());
  std::size_t held = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].owner == kHeldHere) ++held;
    // Up to the root, or to a frame from which an earlier walk has reached it.
    for (std::size_t at = i; seen_from[at] == frames.size();) {
      seen_from[at] = i;
      const auto parent = by_id.find(frames[at].parent);
      if (parent == by_id.end()) break;
      at = parent->second;
      if (seen_from[at] != i) continue;
      violation_("a cycle of frames", name_of(one) + " sees " + frames[i].id + " below itself");
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

void Invariants::answered(const Process& one, const Request& request, const Reply& reply) {
  if (std::holds_alternative<Error>(reply.body)) return;
  const auto frame = one.forest().info(request.id);
  bool seen = true;
  if (const auto* add = std::get_if<AddRequest>(&request.body)) {
    seen = frame && frame->parent == add->parent;
  } else if (const auto* move = std::get_if<MoveRequest>(&request.body)) {
    seen = frame && frame->parent == move->parent;
  } else if (const auto* removed = std::get_if<RemoveRequest>(&request.body)) {
    seen = std::none_of(removed->tops.begin(), removed->tops.end(),
                        [&](const std::string& top) { return one.forest().exists(top); });
  }
  if (!seen) violation_("a node does not see its change", name_of(one) + ": " + request.id);
}

void Invariants::streamed(const Process& one, const Update& update) {
  if (update.stamp) return;
  for (const EdgeUpdate& edge : update.edges) {
    if (!one.forest().holds(edge.id)) continue;
    const auto X_PC = one.forest().value(edge.id);
    if (X_PC && X_PC->pose.matrix() == edge.X_PC.pose.matrix()) continue;
    violation_("a streamed value is not applied", name_of(one) + ": " + edge.id);
  }
}

void Invariants::called(const std::shared_ptr<Process>& caller, std::function<bool()> over,
                        const std::string& what, Instant must_end) {
  calls_.emplace(must_end, Call{caller, std::move(over), what});
}

void Invariants::after(Instant now) {
  while (!calls_.empty() && calls_.begin()->first < now) {
    const auto late = calls_.extract(calls_.begin()).mapped();
    const auto caller = late.caller.lock();
    if (!caller || caller->ended() || late.over()) continue;
    if (caller->hung_since(now - kLookAgain)) {
      calls_.emplace(now + kLookAgain, late);
    } else {
      violation_("a call does not end", name_of(*caller) + ": " + late.what);
    }
  }
}

}  // namespace tfdude::simulation
