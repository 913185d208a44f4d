#include "tree/reclaimer.hpp"

#include <algorithm>

#include "tree/epoch.hpp"

namespace tfdude {

template <class T, class Pointer>
void Reclaimer::Waiting<T, Pointer>::collect(std::uint64_t tag, std::uint64_t safe_below) {
  for (Pointer& one : superseded) {
    if (one == nullptr) continue;
    one->retire_tag = tag;
    retired.push_back(std::move(one));
  }
  superseded.clear();
  const auto is_unseen = [safe_below](const auto& one) { return one->retire_tag < safe_below; };
  retired.erase(std::remove_if(retired.begin(), retired.end(), is_unseen), retired.end());
}

void Reclaimer::collect(Frames& frames) {
  frames.order_commit();
  const std::uint64_t tag = epoch::retire_tag();
  superseded_ = 0;
  const std::uint64_t below = epoch::safe_below();
  held_pool_.collect(tag, below);
  remote_pool_.collect(tag, below);
  samples_.collect(tag, below);
  histories_.collect(tag, below);
  correlations_.collect(tag, below);
  frames.collect_names(tag, below);
}

}  // namespace tfdude
