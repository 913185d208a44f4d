#include "tfdude/partition/pages.hpp"

namespace tfdude {

void Pages::put(const std::string& id, const std::string& parent) {
  const auto known = page_of_.find(id);
  std::uint32_t number = 0;
  if (known != page_of_.end()) {
    number = known->second;
  } else {
    if (with_room_.empty()) {
      with_room_.insert(count());
      pages_.emplace_back();
    }
    number = *with_room_.begin();
    page_of_.emplace(id, number);
  }
  Frames& page = pages_[number];
  page[id] = parent;
  if (page.size() >= kPageSize) with_room_.erase(number);
  changed_.insert(number);
}

void Pages::erase(const std::string& id) {
  const auto known = page_of_.find(id);
  if (known == page_of_.end()) return;
  const std::uint32_t number = known->second;
  pages_[number].erase(id);
  page_of_.erase(known);
  with_room_.insert(number);
  changed_.insert(number);
}

std::vector<Page> Pages::take_changed() {
  std::vector<Page> changed;
  changed.reserve(changed_.size());
  for (const std::uint32_t number : changed_) {
    Page page{partition_, number, incarnation_, published_epoch_, {}};
    page.entries.reserve(pages_[number].size());
    for (const auto& [id, parent] : pages_[number]) page.entries.push_back({id, parent});
    changed.push_back(std::move(page));
  }
  // Only the last page completes the epoch.
  if (!changed.empty()) changed.back().epoch = published_epoch_ = epoch_;
  changed_.clear();
  return changed;
}

}  // namespace tfdude
