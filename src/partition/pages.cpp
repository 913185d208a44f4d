#include "partition/pages.hpp"

#include <algorithm>

namespace tfdude {
namespace {

// A page is also published again before so many pages have been published after it, and as many as
// there are. With up to 32,768 pages, 1.9 million frames, that is not more than a HEARTBEAT may
// span (rtps_check.hpp).
constexpr std::uint32_t kMostRepeatWithin = 32'768;

}  // namespace

// Rather a page that is published anyway.
std::uint32_t Pages::page_with_room() {
  if (changed_.count(changed_latest_) != 0 && with_room_.count(changed_latest_) != 0) {
    return changed_latest_;
  }
  if (with_room_.empty()) {
    with_room_.insert(count());
    pages_.emplace_back();
  }
  return *with_room_.begin();
}

void Pages::changed(std::uint32_t number, const std::string& id) {
  if (pages_[number].size() >= room_of(number)) {
    with_room_.erase(number);
  } else {
    with_room_.insert(number);
  }
  changed_.insert(number);
  changed_latest_ = number;
  if (watching_) touched_.insert(id);
}

void Pages::put(const std::string& id, const std::string& parent, std::uint64_t lamport_time) {
  forget_tombstone(id);
  const auto [known, is_new] = frames_.try_emplace(id);
  Frame& frame = known->second;
  frame.place = {parent, lamport_time};
  if (is_new) {
    frame.page = page_with_room();
    pages_[frame.page].frames.push_back(&*known);
  }
  changed(frame.page, id);
}

void Pages::erase(const std::string& id) {
  const auto known = frames_.find(id);
  if (known == frames_.end()) return;
  const std::uint32_t number = known->second.page;
  auto& frames = pages_[number].frames;
  std::swap(*std::find(frames.begin(), frames.end(), &*known), frames.back());
  frames.pop_back();
  changed(number, id);
  frames_.erase(known);
}

void Pages::put_joint(const std::string& id, const PageJoint& joint) {
  joints_[id] = joint;
  changed(frames_.at(id).page, id);
}

std::optional<PageJoint> Pages::erase_joint(const std::string& id) {
  const auto there = joints_.find(id);
  if (there == joints_.end()) return std::nullopt;
  PageJoint joint = std::move(there->second);
  joints_.erase(there);
  changed(frames_.at(id).page, id);
  return joint;
}

std::vector<std::string> Pages::leave(const Tombstone& tombstone) {
  forget_tombstone(tombstone.id);
  const std::uint32_t number = page_with_room();
  page_of_tombstone_.emplace(tombstone.id, number);
  pages_[number].tombstones[tombstone.id] = tombstone;
  changed(number, tombstone.id);
  oldest_tombstones_.emplace_back(tombstone.id, tombstone.lamport_time);
  std::vector<std::string> dropped;
  while (page_of_tombstone_.size() > kMaxTombstones ||
         oldest_tombstones_.size() > 2 * kMaxTombstones) {
    const auto [id, lamport_time] = std::move(oldest_tombstones_.front());
    oldest_tombstones_.pop_front();
    const auto there = this->tombstone(id);
    if (!there || there->lamport_time != lamport_time) continue;
    forget_tombstone(id);
    dropped.push_back(id);
  }
  return dropped;
}

void Pages::forget_tombstone(const std::string& id) {
  const auto known = page_of_tombstone_.find(id);
  if (known == page_of_tombstone_.end()) return;
  const std::uint32_t number = known->second;
  page_of_tombstone_.erase(known);
  pages_[number].tombstones.erase(id);
  changed(number, id);
}

std::optional<Pages::Place> Pages::place(const std::string& id) const {
  const auto known = frames_.find(id);
  if (known == frames_.end()) return std::nullopt;
  return known->second.place;
}

std::optional<Tombstone> Pages::tombstone(const std::string& id) const {
  const auto known = page_of_tombstone_.find(id);
  if (known == page_of_tombstone_.end()) return std::nullopt;
  return pages_[known->second].tombstones.at(id);
}

void Pages::overtake(std::uint64_t incarnation) {
  incarnation_ = incarnation;
  resume(incarnation);
  for (std::uint32_t number = 0; number < count(); ++number) changed_.insert(number);
  changed_last_.clear();
  published_ = false;
  close_epoch();
}

void Pages::note_epochs() {
  for (const std::uint32_t number : changed_) {
    const auto before =
        std::find_if(changed_last_.begin(), changed_last_.end(),
                     [number](const PageEpoch& one) { return one.number == number; });
    if (before != changed_last_.end()) changed_last_.erase(before);
    changed_last_.push_front({number, epoch_});
    // One more than a page lists, as it need not list itself.
    if (changed_last_.size() > kOthers + 1) changed_last_.pop_back();
  }
}

// Of pages that are published together, the last one lists the others; those before list only it.
void Pages::list_others(Page& page) const {
  const std::uint32_t last = *changed_.rbegin();
  if (page.number != last) {
    page.others.push_back({last, epoch_});
    return;
  }
  for (const PageEpoch& one : changed_last_) {
    if (one.number != last && page.others.size() < kOthers) page.others.push_back(one);
  }
}

// One after the other, so that none is left out.
void Pages::repeat_old_pages() {
  if (pages_.empty()) return;
  since_repeat_ += static_cast<std::uint32_t>(changed_.size());
  const std::uint32_t period =
      std::max({kRepeatWithin / count(), std::min(kMostRepeatWithin / count(), 8U), 1U});
  while (since_repeat_ >= period) {
    since_repeat_ -= period;
    repeat_next_ = (repeat_next_ + 1) % count();
    changed_.insert(repeat_next_);
  }
}

std::vector<Page> Pages::take_changed() {
  repeat_old_pages();
  note_epochs();
  std::vector<Page> changed;
  changed.reserve(changed_.size());
  for (const std::uint32_t number : changed_) {
    Page page{partition_, number, incarnation_, epoch_, {}, {}, {}, {}};
    const Sheet& sheet = pages_[number];
    page.entries.reserve(sheet.frames.size());
    for (const Frames::value_type* frame : sheet.frames) {
      const auto& [id, there] = *frame;
      page.entries.push_back({id, there.place.parent, there.place.lamport_time});
      if (const auto joint = joints_.find(id); joint != joints_.end()) {
        page.joints.push_back(joint->second);
      }
    }
    for (const auto& [id, tombstone] : sheet.tombstones) page.tombstones.push_back(tombstone);
    list_others(page);
    changed.push_back(std::move(page));
  }
  if (!published_) changed_last_.clear();
  published_ = published_ || !changed.empty();
  changed_.clear();
  return changed;
}

}  // namespace tfdude
