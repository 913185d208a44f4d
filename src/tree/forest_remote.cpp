#include "tfdude/base/id.hpp"

#include "tree/forest_impl.hpp"

// Frames held elsewhere.
namespace tfdude {

Result<void> Forest::put_remote(std::string_view id, std::string_view parent, Owner owner,
                                std::uint64_t lamport_time) {
  if (auto ok = check_id(id, "id"); !ok) return ok;
  if (auto ok = check_id(parent, "parent"); !parent.empty() && !ok) return ok;
  // A version that counts as held carries a value, and there is none.
  if (owner == kHeldHere) return fail(Errc::kInvalidInput, "owner is this very forest");
  const Writing lock(impl_->mutex_);
  const Impl::Pair pair = impl_->newest_pair(id, parent);
  if (pair.frame != nullptr && pair.frame->held()) {
    return fail(Errc::kAlreadyExists, "frame " + quote(id) + " is held here");
  }
  auto acyclic = impl_->check_no_cycle(pair);
  const Name* name = pair.frame != nullptr ? pair.frame->name : impl_->intern(id);
  const std::uint32_t parent_slot = acyclic ? impl_->parent_slot(pair) : kNoSlot;
  name->hung(lamport_time);
  const Version& old = impl_->frames_.newest(name->slot);
  if (!old.present() || old.owner != owner || old.parent != parent_slot) {
    Version& fresh = impl_->push_remote(name->slot);
    fresh.name = name;
    fresh.owner = owner;
    impl_->relink(fresh, parent_slot);
    impl_->commit_structure();
  }
  return acyclic;
}

void Forest::drop_remote(std::string_view id, Owner owner) {
  const Writing lock(impl_->mutex_);
  const Version* there = impl_->frames_.newest_named(id);
  if (there == nullptr || !there->present() || there->owner != owner || owner == kHeldHere) return;
  impl_->make_absent(there->slot);
  impl_->commit_structure();
}

}  // namespace tfdude
