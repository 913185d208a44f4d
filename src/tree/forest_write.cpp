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
    auto* nobody = reclaimer_.take<Version>();
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

void Forest::Impl::hang(Version& fresh, std::uint32_t parent) const {
  fresh.parent = parent;
  fresh.above = parent == kNoSlot ? nullptr : &frames_.head(parent);
  fresh.depth = parent == kNoSlot ? 0 : frames_.newest(parent).depth + 1;
}

void Forest::Impl::relink(Version& fresh, std::uint32_t parent) {
  const std::uint32_t old_parent = fresh.parent;
  if (!fresh.present()) fresh.generation = next_generation();
  fresh.attachment = next_generation();
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
    frozen_.erase(slot);
  }
  Version& fresh = push_remote(slot);
  fresh.attachment = 0;
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

Result<std::vector<std::string>> Forest::remove(std::string_view id, std::uint64_t before) {
  const Writing lock(impl_->mutex_);
  const auto top = impl_->frames_.held_slot(id);
  if (!top) return tl::unexpected(top.error());
  const auto slots = impl_->graph_.subtree(*top, [&](std::uint32_t child) {
    const Version& version = impl_->frames_.newest(child);
    return version.held() && version.name->lamport_time.load(std::memory_order_relaxed) < before;
  });
  for (const std::uint32_t slot : slots) {
    if (auto ok = impl_->check_not_frozen(slot); !ok) return tl::unexpected(std::move(ok.error()));
  }
  std::vector<std::string> removed;
  removed.reserve(slots.size());
  for (const std::uint32_t slot : slots) {
    removed.emplace_back(impl_->frames_.newest(slot).name->text);
  }
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

Result<void> Forest::move(std::string_view id, std::string_view parent,
                          const PartialTransform& X_PC, std::uint64_t lamport_time) {
  if (auto ok = check_id(parent, "parent"); !parent.empty() && !ok) return ok;
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->slot_to_change(id);
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

Result<void> Forest::attach(std::string_view id, std::string_view parent) {
  if (auto ok = check_id(parent, "parent"); !ok) return ok;
  const Writing lock(impl_->mutex_);
  const auto slot = impl_->frames_.held_slot(id);
  if (!slot) return tl::unexpected(slot.error());
  const Impl::Pair pair = impl_->newest_pair(id, parent);
  if (auto ok = impl_->check_no_cycle(pair); !ok) return ok;
  const std::uint32_t parent_slot = impl_->parent_slot(pair);
  HeldVersion& fresh = impl_->push_held(*slot, impl_->frames_.newest_value(*slot).X_PC);
  impl_->relink(fresh, parent_slot);
  impl_->commit_structure();
  return {};
}

}  // namespace tfdude
