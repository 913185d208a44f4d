#include "tree/forest_impl.hpp"

// The memory of all histories together.
namespace tfdude {

void Forest::limit_history(std::size_t bytes, std::function<void()> on_full) {
  const Writing lock(impl_->mutex_);
  impl_->max_bytes_ = impl_->full_at_ = bytes;
  impl_->on_full_ = std::move(on_full);
}

std::uint64_t Forest::dropped_samples() const {
  return impl_->dropped_samples_.load(std::memory_order_relaxed);
}

void Forest::Impl::drop_down_to_limit() {
  // If there is nothing to drop, it is not looked for again at once.
  constexpr std::size_t kMuchMore = 64;
  full_at_ = max_bytes_;
  while (reclaimer_.samples().bytes() > full_at_) {
    if (past_ != nullptr && past_->drop_some()) continue;
    if (!drop_oldest_samples()) {
      full_at_ = reclaimer_.samples().bytes() + max_bytes_ / kMuchMore;
      return;
    }
    if (on_full_) std::exchange(on_full_, nullptr)();
  }
}

bool Forest::Impl::drop_oldest_samples() {
  if (drops_until_search_ > 0 && drop_oldest_found()) return true;
  find_oldest_samples();
  return drop_oldest_found();
}

// Drops samples of one edge, until that frees memory.
bool Forest::Impl::drop_oldest_found() {
  constexpr std::uint64_t kLeast = 2;
  while (!oldest_.empty()) {
    const OldestSamples::Entry oldest = oldest_.pop();
    if (!frames_.newest(oldest.slot).held()) continue;
    const HeldVersion& edge = frames_.newest_value(oldest.slot);
    const bool is_same = edge.moving() && edge.history == oldest.history;
    if (!is_same || edge.samples->count() <= kLeast) continue;
    const bool is_oldest = edge.samples->first_stamp() <= oldest.stamp;
    // To remember them would free nothing.
    if (past_ != nullptr && is_oldest) past_->forget_before(oldest.slot);
    const std::size_t bytes = reclaimer_.samples().bytes();
    while (is_oldest && edge.samples->count() > kLeast && reclaimer_.samples().bytes() == bytes) {
      edge.samples->drop_oldest(reclaimer_.samples());
      dropped_samples_.fetch_add(1, std::memory_order_relaxed);
    }
    oldest_.push({edge.samples->first_stamp(), edge.slot, edge.history});
    if (!is_oldest) continue;
    --drops_until_search_;
    return true;
  }
  return false;
}

// Edges that got a history since are included, too. As many drops as frames lie between two
// searches, so a drop takes constant time in the mean.
void Forest::Impl::find_oldest_samples() {
  oldest_.clear();
  for (std::uint32_t slot = 0; slot < frames_.size(); ++slot) {
    if (!frames_.newest(slot).held()) continue;
    const HeldVersion& edge = frames_.newest_value(slot);
    if (!edge.moving() || edge.lacks_sample()) continue;
    oldest_.push({edge.samples->first_stamp(), slot, edge.history});
  }
  drops_until_search_ = frames_.size();
}

}  // namespace tfdude
