#pragma once

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
  /// Frames and tombstones a page: a page of long ids stays below 64 KiB, and of usual ones is about 2 KiB.
  static constexpr std::size_t kPageSize = 60;

  /// Tombstones kept; the oldest go first.
  static constexpr std::size_t kMaxTombstones = 1024;

  /// Of how many that were changed before it a page tells. A page that a later one has replaced on its way is late; if
  /// more than these were changed meanwhile, nobody knows.
  static constexpr std::size_t kOthers = 16;

  struct Place {
    std::string parent;
    std::uint64_t lamport_time = 0;
  };

  Pages(std::string partition, std::uint64_t incarnation)
      : partition_(std::move(partition)), incarnation_(incarnation), epoch_(incarnation) {}

  [[nodiscard]] std::uint64_t incarnation() const { return incarnation_; }

  /// Where a frame hangs, in place of its tombstone, if it has one. O(log frames).
  void put(const std::string& id, const std::string& parent, std::uint64_t lamport_time);

  /// Its joint was let go before.
  void erase(const std::string& id);

  /// Which joint moves a frame that was put.
  void put_joint(const std::string& id, const PageJoint& joint);
  /// @return the one that there was
  std::optional<PageJoint> erase_joint(const std::string& id);

  /// Leaves the tombstone of a frame, in place of an earlier one.
  void leave(const Tombstone& tombstone);

  [[nodiscard]] std::optional<Place> place(const std::string& id) const;
  [[nodiscard]] std::optional<Tombstone> tombstone(const std::string& id) const;

  /// Goes on counting from here, if that is ahead.
  void resume(std::uint64_t epoch) { epoch_ = epoch > epoch_ ? epoch : epoch_; }

  /// Goes on as a later incarnation: all pages are published again.
  void overtake(std::uint64_t incarnation);

  /// Closes a change of structure, of as many frames as it has; the epoch that shows it. It begins with the
  /// incarnation, so that it grows over all of a partition's lives.
  std::uint64_t close_epoch() { return ++epoch_; }
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }

  /// The pages to publish since the last call, in the order in which to publish them.
  [[nodiscard]] std::vector<Page> take_changed();
  /// They were not published: they will be taken again, as they are then.
  void still_changed(const std::vector<Page>& pages) {
    for (const Page& page : pages) changed_.insert(page.number);
  }

  /// The ids whose place or tombstone has changed since the last call; none before watch_ids().
  [[nodiscard]] std::set<std::string> take_touched() { return std::exchange(touched_, {}); }
  void watch_ids() { watching_ = true; }
  [[nodiscard]] bool is_touched(const std::string& id) const { return touched_.count(id) != 0; }

  [[nodiscard]] std::size_t frame_count() const { return page_of_.size(); }
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(pages_.size()); }

 private:
  struct Sheet {
    std::map<std::string, Place> frames;
    std::map<std::string, Tombstone> tombstones;
    [[nodiscard]] std::size_t size() const { return frames.size() + tombstones.size(); }
  };
  using PageOf = std::unordered_map<std::string, std::uint32_t>;

  std::uint32_t page_with_room();
  void changed(std::uint32_t number, const std::string& id);
  void note_epochs();
  void forget_tombstone(const std::string& id);

  std::string partition_;
  std::uint64_t incarnation_;
  std::uint64_t epoch_;
  std::vector<Sheet> pages_;
  PageOf page_of_;
  PageOf page_of_tombstone_;
  std::map<std::string, PageJoint> joints_;  // by frame
  // In the order in which they were left; what stands here no longer was replaced since.
  std::deque<std::pair<std::string, std::uint64_t>> oldest_tombstones_;
  std::set<std::uint32_t> with_room_;
  std::set<std::uint32_t> changed_;
  std::deque<PageEpoch> changed_last_;  // the latest first
  bool watching_ = false;
  std::set<std::string> touched_;
};

}  // namespace tfdude
