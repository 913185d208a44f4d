#include <algorithm>
#include <atomic>

#include "tfdude/base/id.hpp"

#include "math/finite.hpp"
#include "tree/forest_impl.hpp"

namespace tfdude {
namespace {

// Unique in the process, so that a handle of one forest's frame is valid in no other.
std::uint32_t next_generation() {
  static std::atomic<std::uint32_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

const Correlation* correlation_of(const EdgeUpdate&) { return nullptr; }
const Correlation* correlation_of(const HandleUpdate&) { return nullptr; }
const Correlation* correlation_of(const CorrelatedUpdate& update) { return update.correlation; }

const JointState* state_of(const EdgeUpdate&) { return nullptr; }
const JointState* state_of(const HandleUpdate&) { return nullptr; }
const JointState* state_of(const CorrelatedUpdate& update) {
  return update.state.joint != nullptr ? &update.state : nullptr;
}

template <class Update>
Result<void> check_said(const Update& update) {
  const Correlation* said = correlation_of(update);
  return said != nullptr ? check_common_errors(said->common_errors) : Result<void>();
}

}  // namespace

Forest::Impl::Pair Forest::Impl::newest_pair(std::string_view id, std::string_view parent) const {
  return {id, parent, frames_.newest_named(id),
          parent.empty() ? nullptr : frames_.newest_named(parent)};
}

Result<void> Forest::Impl::check_no_cycle(const Pair& pair) const {
  if (pair.id == pair.parent) {
    return fail(Errc::kCycle, "frame " + quote(pair.id) + " cannot be its own parent");
  }
  const Version* above = pair.above;
  while (pair.frame != nullptr && above != nullptr && above != pair.frame) {
    above = above->parent == kNoSlot ? nullptr : &frames_.newest(above->parent);
  }
  if (pair.frame != nullptr && above == pair.frame) {
    return fail(Errc::kCycle, "frame " + quote(pair.id) + " cannot be moved under " +
                                  quote(pair.parent) + ", which lies below it");
  }
  return {};
}

const Name* Forest::Impl::intern(std::string_view id) {
  if (free_slots_.empty()) {
    Version* nobody = reclaimer_.take<Version>();
    *nobody = Version{};
    free_slots_.push_back(frames_.add_slot(nobody));
  }
  const std::uint32_t slot = free_slots_.back();
  free_slots_.pop_back();
  return frames_.add_name(id, slot);
}

std::uint32_t Forest::Impl::parent_slot(const Pair& pair) {
  if (pair.above != nullptr) return pair.above->slot;
  if (pair.parent.empty()) return kNoSlot;
  const Name* name = intern(pair.parent);
  push_remote(name->slot).name = name;
  return name->slot;
}

template <class T>
T& Forest::Impl::push(std::uint32_t slot) {
  Head& head = frames_.head(slot);
  Version* old = head.load(std::memory_order_relaxed);
  T* fresh = reclaimer_.take<T>();
  fresh->commit = frames_.commit_being_made();
  fresh->older = old;
  fresh->name = old->name;
  fresh->above = old->above;
  fresh->parent = old->parent;
  fresh->depth = old->depth;
  fresh->owner = old->owner;
  fresh->slot = slot;
  fresh->generation = old->generation;
  reclaimer_.supersede(old);
  // Readers skip the fresh version by its number until commit(), so it may be filled in later.
  head.store(fresh, std::memory_order_release);
  return *fresh;
}

HeldVersion& Forest::Impl::push_held(std::uint32_t slot, const Transform& X_PC) {
  const Version& old = frames_.newest(slot);
  HeldVersion& fresh = push<HeldVersion>(slot);
  fresh.owner = kHeldHere;
  fresh.X_PC = X_PC;
  if (old.held()) {
    const auto& before = static_cast<const HeldVersion&>(old);
    fresh.stamp = before.stamp;
    fresh.number = before.number;
    fresh.samples = before.samples;
    fresh.correlation = before.correlation;
    fresh.history = before.history;
  } else {
    fresh.stamp = kAlways;
    fresh.samples = nullptr;
    fresh.correlation = nullptr;
    fresh.history = fresh.commit;
  }
  return fresh;
}

Version& Forest::Impl::push_remote(std::uint32_t slot) { return push<Version>(slot); }

void Forest::Impl::hang(Version& fresh, std::uint32_t parent) const {
  fresh.parent = parent;
  fresh.above = parent == kNoSlot ? nullptr : &frames_.head(parent);
  fresh.depth = parent == kNoSlot ? 0 : frames_.newest(parent).depth + 1;
}

void Forest::Impl::relink(Version& fresh, std::uint32_t parent) {
  const std::uint32_t old_parent = fresh.parent;
  if (!fresh.present()) fresh.generation = next_generation();
  if (old_parent != kNoSlot) graph_.unlink(old_parent, fresh.slot);
  graph_.ensure(fresh.slot);
  if (parent != kNoSlot) {
    graph_.ensure(parent);
    graph_.link(parent, fresh.slot);
  }
  hang(fresh, parent);
  renew_depths(fresh.slot);
  if (old_parent != kNoSlot) release_if_unused(old_parent);
}

void Forest::Impl::make_absent(std::uint32_t slot) {
  if (frames_.newest(slot).held()) {
    give_back(frames_.newest_value(slot).samples);
    reclaimer_.supersede(frames_.newest_value(slot).correlation);
  }
  Version& fresh = push_remote(slot);
  const std::uint32_t parent = fresh.parent;
  if (parent != kNoSlot) graph_.unlink(parent, slot);
  hang(fresh, kNoSlot);
  fresh.depth = Version::kAbsent;
  renew_depths(slot);
  if (parent != kNoSlot) release_if_unused(parent);
  if (graph_.is_leaf(slot)) release(fresh);
}

void Forest::Impl::renew_depths(std::uint32_t top) {
  if (graph_.is_leaf(top)) return;
  // The caller holds the lock while the graph calls this.
  const auto stale = [this](std::uint32_t child) TFDUDE_UNCHECKED_LOCKS {
    const Version& version = frames_.newest(child);
    if (version.depth == frames_.newest(version.parent).depth + 1) return false;
    Version& fresh = version.held()
                         ? push_held(child, static_cast<const HeldVersion&>(version).X_PC)
                         : push_remote(child);
    fresh.depth = frames_.newest(version.parent).depth + 1;
    return true;
  };
  (void)graph_.subtree(top, stale);
}

// Releases a name without a frame and without frames below it.
void Forest::Impl::release(Version& fresh) {
  released_names_.push_back(fresh.name);
  fresh.name = nullptr;
}

void Forest::Impl::release_if_unused(std::uint32_t slot) {
  const Version& version = frames_.newest(slot);
  if (!version.present() && version.name != nullptr && graph_.is_leaf(slot)) {
    release(push_remote(slot));
  }
}

void Forest::Impl::commit() {
  show_commit();
  tell_commit();
}

void Forest::Impl::commit_structure() {
  show_commit();
  structure_version_.fetch_add(1, std::memory_order_release);
  tell_commit();
}

void Forest::Impl::show_commit() {
  frames_.show_commit();
  // Only now: a reader of the previous commit may still reach a name through the version it sees.
  for (const Name* name : released_names_) {
    free_slots_.push_back(name->slot);
    frames_.drop_name(name);
  }
  released_names_.clear();
  if (reclaimer_.is_due()) reclaimer_.collect(frames_);
}

Result<void> Forest::add(std::string_view id, std::string_view parent, const Transform& X_PC,
                         MissingParent rule, std::uint64_t lamport_time) {
  if (auto ok = check_id(id, "id"); !ok) return ok;
  if (auto ok = check_id(parent, "parent"); !parent.empty() && !ok) return ok;
  if (!is_finite(X_PC)) return check_value(id, X_PC);
  const Writing lock(impl_->mutex_);
  const Impl::Pair pair = impl_->newest_pair(id, parent);
  if (pair.frame != nullptr && pair.frame->present()) {
    return fail(Errc::kAlreadyExists, "frame " + quote(id) + " exists already");
  }
  const bool parent_there = parent.empty() || (pair.above != nullptr && pair.above->present());
  if (!parent_there && rule == MissingParent::kRefuse) {
    return fail(Errc::kUnknownParent,
                "no frame " + quote(parent) + " to be the parent of " + quote(id));
  }
  if (auto ok = impl_->check_no_cycle(pair); !ok) return ok;
  const Name* name = pair.frame != nullptr ? pair.frame->name : impl_->intern(id);
  const std::uint32_t parent_slot = impl_->parent_slot(pair);
  HeldVersion& fresh = impl_->push_held(name->slot, X_PC);
  fresh.name = name;
  name->hung(lamport_time);
  impl_->relink(fresh, parent_slot);
  impl_->commit_structure();
  return {};
}

Result<std::vector<std::string>> Forest::remove(std::string_view id) {
  const Writing lock(impl_->mutex_);
  const auto top = impl_->frames_.held_slot(id);
  if (!top) return tl::unexpected(top.error());
  const auto slots = impl_->graph_.subtree(
      *top, [&](std::uint32_t child) { return impl_->frames_.newest(child).held(); });
  std::vector<std::string> removed;
  removed.reserve(slots.size());
  for (const std::uint32_t slot : slots) removed.push_back(impl_->frames_.newest(slot).name->text);
  for (auto slot = slots.rbegin(); slot != slots.rend(); ++slot) impl_->make_absent(*slot);
  impl_->commit_structure();
  return removed;
}

Result<void> Forest::release(std::string_view id) {
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  if (!slot) return tl::unexpected(slot.error());
  impl_->make_absent(*slot);
  impl_->commit_structure();
  return {};
}

Result<void> Forest::Impl::update_one(const HeldVersion& edge, const Transform& X_PC,
                                      std::optional<Time> stamp) {
  if (!is_finite(X_PC)) return check_value(edge.name->text, X_PC);
  const std::uint32_t slot = edge.slot;
  if (stamp || may_be_moving(edge)) {
    const auto at = stamp_for(&slot, 1, stamp);
    if (!at) return tl::unexpected(at.error());
    if (auto ok = check_sample(edge, *at); !ok) return ok;
    push_value(slot, {X_PC}, *at);
  } else {
    end_revision(push_held(slot, X_PC));
  }
  commit();
  return {};
}

Result<void> Forest::update(std::string_view id, const Transform& X_PC, std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  if (!slot) return tl::unexpected(slot.error());
  return impl_->update_one(impl_->frames_.newest_value(*slot), X_PC, stamp);
}

Result<void> Forest::update(Handle frame, const Transform& X_PC, std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  const Version* version = impl_->frames_.newest_held(frame);
  if (version == nullptr) return tl::unexpected(impl_->frames_.held_slot(frame).error());
  return impl_->update_one(static_cast<const HeldVersion&>(*version), X_PC, stamp);
}

template <class Update, class Frame>
Result<void> Forest::Impl::update_all(const std::vector<Update>& edges, Frame frame,
                                      std::optional<Time> stamp) {
  to_update_.clear();
  for (const Update& edge : edges) {
    const auto slot = frames_.held_slot(edge.*frame);
    if (!slot) return tl::unexpected(slot.error());
    if (!is_finite(edge.X_PC)) return check_value(frames_.newest(*slot).name->text, edge.X_PC);
    if (auto ok = check_said(edge); !ok) {
      return fail_at("frame " + quote(frames_.newest(*slot).name->text), ok.error());
    }
    to_update_.push_back(*slot);
  }
  const auto at = stamp_for(to_update_.data(), to_update_.size(), stamp);
  if (!at) return tl::unexpected(at.error());
  // Checks all of them, as each counts what it rejects.
  Result<void> fits;
  for (const std::uint32_t slot : to_update_) {
    auto ok = check_sample(frames_.newest_value(slot), *at);
    if (!ok && fits) fits = std::move(ok);
  }
  if (!fits) return fits;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    push_value(to_update_[i], {edges[i].X_PC, state_of(edges[i])}, *at);
    if (const Correlation* said = correlation_of(edges[i])) say_correlation(to_update_[i], *said);
  }
  commit();
  return {};
}

Result<void> Forest::update(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  return impl_->update_all(edges, &EdgeUpdate::id, stamp);
}

Result<void> Forest::update(const std::vector<HandleUpdate>& edges, std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  return impl_->update_all(edges, &HandleUpdate::frame, stamp);
}

Result<void> Forest::update_partial(const std::vector<PartialUpdate>& edges,
                                    std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  const auto whole = impl_->completed(edges);
  if (!whole) return tl::unexpected(whole.error());
  return impl_->update_all(*whole, &EdgeUpdate::id, stamp);
}

Result<void> Forest::update_correlated(const std::vector<CorrelatedUpdate>& edges,
                                       std::optional<Time> stamp) {
  const Writing lock(impl_->mutex_);
  return impl_->update_all(edges, &CorrelatedUpdate::frame, stamp);
}

Result<void> Forest::move(std::string_view id, std::string_view parent,
                          const PartialTransform& X_PC, std::uint64_t lamport_time) {
  if (auto ok = check_id(parent, "parent"); !parent.empty() && !ok) return ok;
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  if (!slot) return tl::unexpected(slot.error());
  const Impl::Pair pair = impl_->newest_pair(id, parent);
  if (!parent.empty() && (pair.above == nullptr || !pair.above->present())) {
    return fail(Errc::kUnknownParent,
                "no frame " + quote(parent) + " to be the parent of " + quote(id));
  }
  if (auto ok = impl_->check_no_cycle(pair); !ok) return ok;
  const auto& old = static_cast<const HeldVersion&>(*pair.frame);
  const auto value = with_parts(Impl::whole(old), id, X_PC);
  if (!value) return tl::unexpected(value.error());
  if (!is_finite(*value)) return check_value(id, *value);
  const std::uint32_t parent_slot = impl_->parent_slot(pair);
  old.name->hung(lamport_time);
  HeldVersion& fresh = impl_->push_held(*slot, X_PC.empty() ? old.X_PC : *value);
  impl_->forget_history(fresh);
  if (!X_PC.empty()) impl_->end_revision(fresh);
  impl_->relink(fresh, parent_slot);
  impl_->commit_structure();
  return {};
}

}  // namespace tfdude
