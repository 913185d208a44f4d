#include <algorithm>

#include "tfdude/base/id.hpp"

#include "math/finite.hpp"
#include "tree/forest_impl.hpp"

// Frames that go to another owner, with all that is known of them.
namespace tfdude {
namespace {

HandedState state_of(const HeldVersion& edge) {
  if (!edge.moving()) return HandedState::kStatic;
  if (edge.unsampled()) return HandedState::kUnsampled;
  return edge.lacks_sample() ? HandedState::kCleared : HandedState::kSampled;
}

HandedSample handed_sample(const SampleHistory& samples, std::uint64_t number,
                           const Sample& sample) {
  HandedSample told{time_of(sample.stamp), sample.value()};
  told.made_up = samples.made_up(number);
  if (const SharedRevision* revision = sample.revision()) {
    told.revision = SampleRevision{revision->given, revision->correlation(), revision->row};
    told.is_row = sample.commit == samples.observed();
  }
  return told;
}

void add_samples(const HeldVersion& edge, std::optional<Time> after, std::size_t most,
                 HandedEdge& told) {
  const SampleHistory& samples = *edge.samples;
  const std::uint64_t first = after ? samples.place_of(nanoseconds(*after)) : samples.oldest();
  for (std::uint64_t number = first; number <= edge.number; ++number) {
    const Sample* sample = samples.sample(number);
    if (sample == nullptr || (after && sample->stamp <= nanoseconds(*after))) continue;
    if (told.samples.size() == most) {
      told.continues = true;
      return;
    }
    told.samples.push_back(handed_sample(samples, number, *sample));
  }
}

Result<void> check_sample(const HandedSample& sample, std::optional<Time> before) {
  const bool follows = nanoseconds(sample.stamp) >= 0 && (!before || *before < sample.stamp);
  if (!follows) return fail(Errc::kInvalidInput, "the stamps of its samples do not increase");
  const auto& revision = sample.revision;
  if (!is_finite(sample.X_PC) || (revision && !is_finite(revision->given))) {
    return fail(Errc::kInvalidInput, "a sample is not finite");
  }
  return revision ? check_common_errors(revision->correlation.common_errors) : Result<void>();
}

// Whether its samples are those of its state.
bool fits(const HandedEdge& edge) {
  const std::size_t count = edge.samples.size();
  if (edge.state != HandedState::kSampled) return count == 0 && !edge.left_behind;
  return count > 0 && (!edge.left_behind || count == 1);
}

}  // namespace

Result<void> Forest::Impl::is_not_frozen(std::uint32_t slot) const {
  if (frozen_.count(slot) == 0) return {};
  return fail(Errc::kNotOwner, "frame " + quote(frames_.newest(slot).name->text) +
                                   " is being handed over to another partition");
}

void Forest::freeze(const std::vector<std::string>& ids) {
  const Writing lock(impl_->mutex_);
  for (const std::string& id : ids) {
    if (const auto slot = impl_->frames_.held_slot(id)) impl_->frozen_.try_emplace(*slot);
  }
}

bool Forest::Impl::thaw(std::uint32_t slot) {
  const auto known = frozen_.find(slot);
  if (known == frozen_.end()) return false;
  const auto from = known->second;
  frozen_.erase(known);
  const HeldVersion& edge = frames_.newest_value(slot);
  if (!from || !is_cleared(edge, *from)) return false;
  clear_history(edge);
  return true;
}

void Forest::thaw(const std::vector<std::string>& ids) {
  const Writing lock(impl_->mutex_);
  bool cleared = false;
  for (const std::string& id : ids) {
    const auto slot = impl_->frames_.held_slot(id);
    if (slot && impl_->thaw(*slot)) cleared = true;
  }
  if (cleared) impl_->commit();
}

void Forest::thaw(const std::vector<HandedFrame>& frames) {
  const Writing lock(impl_->mutex_);
  bool cleared = false;
  for (const HandedFrame& frame : frames) {
    const auto slot = impl_->frames_.held_slot(frame.id);
    if (!slot) continue;
    if (impl_->thaw(*slot)) cleared = true;
    impl_->frames_.newest(*slot).name->hung(frame.lamport_time);
  }
  if (cleared) impl_->commit();
}

bool Forest::is_frozen(std::string_view id) const {
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  return slot && impl_->frozen_.count(*slot) != 0;
}

Result<HandedEdge> Forest::handed(std::string_view id, std::optional<Time> after,
                                  std::size_t most) const {
  const epoch::Guard guard;
  const std::uint64_t commit = impl_->frames_.snapshot();
  const Version* version = impl_->frames_.present(id, commit);
  if (version == nullptr || !version->held()) {
    return fail(Errc::kNotOwner, "frame " + quote(id) + " is not owned by this partition");
  }
  const auto& edge = static_cast<const HeldVersion&>(*version);
  FrameInfo info = impl_->frames_.info_of(edge, commit);
  HandedEdge told;
  told.id = id;
  told.parent = std::move(info.parent);
  told.lamport_time = info.lamport_time;
  told.state = state_of(edge);
  told.X_PC = edge.X_PC;
  if (edge.correlation != nullptr) {
    told.said = edge.correlation->said();
    if (edge.correlation->revised()) told.now = edge.correlation->now();
  }
  if (edge.samples == nullptr) return told;
  told.timing = edge.samples->timing();
  told.left_behind = edge.samples->left_behind;
  if (told.state == HandedState::kSampled) add_samples(edge, after, most, told);
  return told;
}

Result<void> Forest::Impl::check_handed(const HandedEdge& edge) const {
  const std::string who = "frame " + quote(edge.id);
  if (auto ok = check_id(edge.id, "id"); !ok) return ok;
  if (auto ok = check_id(edge.parent, "parent"); !edge.parent.empty() && !ok) return ok;
  const Pair pair = newest_pair(edge.id, edge.parent);
  if (pair.frame != nullptr && pair.frame->held()) {
    return fail(Errc::kAlreadyExists, who + " is held here");
  }
  if (auto ok = check_no_cycle(pair); !ok) return ok;
  if (!is_finite(edge.X_PC)) return fail(Errc::kInvalidInput, who + ": its value is not finite");
  auto ok = edge.timing ? check_timing(*edge.timing) : Result<void>();
  if (ok) ok = check_common_errors(edge.said.common_errors);
  if (ok && edge.now) ok = check_common_errors(edge.now->common_errors);
  std::optional<Time> before;
  for (const HandedSample& sample : edge.samples) {
    if (ok) ok = check_sample(sample, std::exchange(before, sample.stamp));
  }
  const bool has_room =
      edge.timing ? edge.samples.size() <= edge.timing->count : edge.state == HandedState::kStatic;
  if (ok && !(has_room && fits(edge))) {
    ok = fail(Errc::kInvalidInput, "its samples do not fit what is said of it");
  }
  return ok ? ok : fail_at(who, ok.error());
}

// Of samples that were left out of later observations, and only of those, the commit is another
// than that of the last one.
SampleHistory* Forest::Impl::adopted_history(const HandedEdge& edge, std::uint64_t commit) {
  if (!edge.timing) return nullptr;
  // What is remembered is not handed over, nor for how long.
  EdgeTiming timing = *edge.timing;
  timing.believed = default_timing_.believed;
  SampleHistory* samples = SampleHistory::create(*arena_, timing).release();
  for (const HandedSample& told : edge.samples) {
    if (samples->full()) {
      // No reader has seen it.
      SampleHistory* grown = samples->grown().release();
      SampleHistory::destroy(samples);
      samples = grown;
    }
    const SampleRevision* revision = told.revision ? &*told.revision : nullptr;
    const bool left_out = revision != nullptr && !told.is_row;
    samples->append(nanoseconds(told.stamp), left_out ? commit - 1 : commit,
                    {told.X_PC, nullptr, revision}, reclaimer_.samples());
    if (told.made_up) samples->set_made_up(samples->next() - 1);
  }
  samples->set_observed(commit);
  samples->rewritten = commit;
  samples->left_behind = edge.left_behind;
  return samples;
}

void Forest::Impl::adopt(const HandedEdge& edge) {
  const Pair pair = newest_pair(edge.id, edge.parent);
  const auto acyclic = check_no_cycle(pair);
  const Name* name = pair.frame != nullptr ? pair.frame->name : intern(edge.id);
  const std::uint32_t parent = acyclic ? parent_slot(pair) : kNoSlot;
  HeldVersion& fresh = push_held(name->slot, edge.X_PC);
  fresh.name = name;
  fresh.samples = adopted_history(edge, fresh.commit);
  if (edge.state == HandedState::kUnsampled) fresh.stamp = kUnsampled;
  if (edge.state == HandedState::kCleared) fresh.stamp = kNoSample;
  if (edge.state == HandedState::kSampled) {
    fresh.stamp = nanoseconds(edge.samples.back().stamp);
    fresh.number = fresh.samples->next() - 1;
  } else {
    fresh.number = 0;
  }
  if (edge.now) {
    correlate(fresh, edge.said, *edge.now);
  } else if (!edge.said.empty()) {
    correlate(fresh, edge.said);
  }
  name->hung(edge.lamport_time);
  relink(fresh, parent);
  // Where the clock has jumped back before, they are samples that were on their way then.
  const auto now = clock_.is_there() && clock_.has_jumped() ? clock_.read() : std::nullopt;
  const bool of_before = now && fresh.moving() && clock_.is_of_before(fresh.stamp, *now);
  frozen_[name->slot] = of_before ? now : std::nullopt;
}

Result<void> Forest::adopt(const std::vector<HandedEdge>& edges) {
  const Writing lock(impl_->mutex_);
  for (const HandedEdge& edge : edges) {
    if (auto ok = impl_->check_handed(edge); !ok) return ok;
  }
  for (const HandedEdge& edge : edges) impl_->adopt(edge);
  impl_->keep_to_limit();
  impl_->commit_structure();
  return {};
}

void Forest::Impl::hand_to(Owner owner, const HandedFrame& frame) {
  const Pair pair = newest_pair(frame.id, frame.parent);
  if (pair.frame == nullptr || !pair.frame->held()) return;
  const std::uint32_t slot = pair.frame->slot;
  const auto acyclic = check_no_cycle(pair);
  const std::uint32_t parent = acyclic ? parent_slot(pair) : kNoSlot;
  give_back(frames_.newest_value(slot).samples);
  reclaimer_.supersede(frames_.newest_value(slot).correlation);
  frozen_.erase(slot);
  Version& fresh = push_remote(slot);
  fresh.owner = owner;
  fresh.name->hung(frame.lamport_time);
  relink(fresh, parent);
}

void Forest::hand_to(Owner owner, const std::vector<HandedFrame>& frames) {
  const Writing lock(impl_->mutex_);
  for (const HandedFrame& frame : frames) impl_->hand_to(owner, frame);
  impl_->commit_structure();
}

}  // namespace tfdude
