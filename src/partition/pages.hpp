#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "partition/messages.hpp"

namespace tfdude {

/// An owner's structure, split into the pages that it publishes. Not thread-safe.
class Pages {
 public:
  /// The most frames and tombstones on a page: one of long ids stays below 64 KiB, one of usual ids
  /// has about 2 KiB.
  static constexpr std::size_t kPageSize = 60;

  /// The frames and tombstones that a page has room for. The first pages have little room, since
  /// each change sends a whole page; later ones have more, since whoever joins reads all pages.
  [[nodiscard]] static constexpr std::size_t room_of(std::uint32_t number) {
    return std::min<std::size_t>(8 + number, kPageSize);
  }

  /// Tombstones kept; the oldest are dropped first.
  static constexpr std::size_t kMaxTombstones = 1024;

  /// How many previously changed pages a page lists. A page that was replaced by a later version
  /// before its delivery arrives late. If more pages than these changed meanwhile, this is not
  /// noticed. Pages that did not change since the first publication are not listed; a presence has
  /// their number.
  static constexpr std::size_t kOthers = 16;

  /// A page is published again, unchanged, before so many pages have been published after it, or
  /// eight times as many as there are, if that is more (fewer times with many pages). DDS
  /// numbers what an owner publishes, and keeps only the latest of each page. A reader that misses
  /// one is told which numbers are gone. Fast DDS walks these one by one: 570,000 took 70 ms, in
  /// which nothing else was received.
  static constexpr std::uint32_t kRepeatWithin = 4096;

  struct Place {
    std::string parent;
    std::uint64_t lamport_time = 0;
  };

  Pages(std::string partition, std::uint64_t incarnation)
      : partition_(std::move(partition)), incarnation_(incarnation), epoch_(incarnation) {}

  [[nodiscard]] std::uint64_t incarnation() const { return incarnation_; }

  /// Sets the place of a frame, and removes its tombstone, if it has one. O(log frames).
  void put(const std::string& id, const std::string& parent, std::uint64_t lamport_time);

  /// Its joint must have been erased before.
  void erase(const std::string& id);

  /// Sets the joint that moves a frame; the frame must have been put.
  void put_joint(const std::string& id, const PageJoint& joint);
  [[nodiscard]] bool has_joint(const std::string& id) const { return joints_.count(id) != 0; }
  /// @return the previous joint
  std::optional<PageJoint> erase_joint(const std::string& id);

  /// Sets the tombstone of a frame, instead of an earlier one.
  /// @return the frames whose tombstones were dropped for it
  std::vector<std::string> leave(const Tombstone& tombstone);
  void forget_tombstone(const std::string& id);

  [[nodiscard]] std::optional<Place> place(const std::string& id) const;
  [[nodiscard]] std::optional<Tombstone> tombstone(const std::string& id) const;

  /// Continues counting from here, if that is ahead.
  void resume(std::uint64_t epoch) { epoch_ = epoch > epoch_ ? epoch : epoch_; }

  /// Continues as a later incarnation: all pages are published again.
  void overtake(std::uint64_t incarnation);

  /// Ends a change of the structure, of any number of frames; returns the epoch that shows it.
  /// Epochs start at the incarnation, so that they increase over all processes of a partition.
  std::uint64_t close_epoch() { return ++epoch_; }
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  /// The epoch for which others wait; 0 without pages, as there is nothing to wait for.
  [[nodiscard]] std::uint64_t shown_epoch() const { return pages_.empty() ? 0 : epoch_; }

  /// The pages to publish since the last call, in publishing order.
  [[nodiscard]] std::vector<Page> take_changed();
  /// They were not published: the next take_changed() returns them again, with their state of then.
  void still_changed(const std::vector<Page>& pages) {
    for (const Page& page : pages) changed_.insert(page.number);
  }

  /// The ids whose place or tombstone has changed since the last call; empty before watch_ids().
  [[nodiscard]] std::set<std::string> take_touched() { return std::exchange(touched_, {}); }
  void watch_ids() { watching_ = true; }
  [[nodiscard]] bool is_touched(const std::string& id) const { return touched_.count(id) != 0; }

  [[nodiscard]] std::size_t frame_count() const { return frames_.size(); }
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(pages_.size()); }

 private:
  struct Frame {
    Place place;
    std::uint32_t page = 0;
  };
  using Frames = std::unordered_map<std::string, Frame>;
  struct Sheet {
    std::vector<const Frames::value_type*> frames;
    std::map<std::string, Tombstone> tombstones;
    [[nodiscard]] std::size_t size() const { return frames.size() + tombstones.size(); }
  };

  std::uint32_t page_with_room();
  void repeat_old_pages();
  void changed(std::uint32_t number, const std::string& id);
  void note_epochs();
  void list_others(Page& page) const;

  std::string partition_;
  std::uint64_t incarnation_;
  std::uint64_t epoch_;
  std::vector<Sheet> pages_;
  Frames frames_;
  std::unordered_map<std::string, std::uint32_t> page_of_tombstone_;
  std::map<std::string, PageJoint> joints_;  // by frame
  // In order of creation; entries may be outdated.
  std::deque<std::pair<std::string, std::uint64_t>> oldest_tombstones_;
  std::set<std::uint32_t> with_room_;
  std::set<std::uint32_t> changed_;
  std::uint32_t changed_latest_ = 0;
  std::uint32_t since_repeat_ = 0;  // number of pages published
  std::uint32_t repeat_next_ = 0;
  bool published_ = false;              // as this incarnation
  std::deque<PageEpoch> changed_last_;  // the latest first
  bool watching_ = false;
  std::set<std::string> touched_;
};

}  // namespace tfdude
