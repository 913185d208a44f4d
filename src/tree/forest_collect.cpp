#include <algorithm>

#include "tree/forest_impl.hpp"

// What commits have superseded, given back once no reader can see it.
namespace tfdude {

void Forest::Impl::collect() {
  // The store of the last commit once more, now in the order of the readers' announcements (epoch.hpp).
  committed_.fetch_add(0, std::memory_order_seq_cst);
  const std::uint64_t tag = epoch::retire_tag();
  for (Version* version : superseded_) {
    if (version->held()) {
      held_pool_.retire(version, tag);
    } else {
      remote_pool_.retire(version, tag);
    }
  }
  superseded_.clear();
  for (std::unique_ptr<Ring>& ring : superseded_rings_) {
    ring->retire_tag = tag;
    retired_rings_.push_back(std::move(ring));
  }
  superseded_rings_.clear();
  for (std::unique_ptr<EdgeTies>& ties : superseded_ties_) {
    if (ties == nullptr) continue;
    ties->retire_tag = tag;
    retired_ties_.push_back(std::move(ties));
  }
  superseded_ties_.clear();
  const std::uint64_t below = epoch::safe_below();
  held_pool_.collect(below);
  remote_pool_.collect(below);
  ids_.collect(tag, below);
  const auto drop_unseen = [below](auto& retired) {
    const auto unseen = [below](const auto& one) { return one->retire_tag < below; };
    retired.erase(std::remove_if(retired.begin(), retired.end(), unseen), retired.end());
  };
  drop_unseen(retired_rings_);
  drop_unseen(retired_ties_);
}

}  // namespace tfdude
