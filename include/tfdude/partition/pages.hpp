#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "tfdude/partition/messages.hpp"

namespace tfdude {

/// An owner's structure, split into the pages that it publishes. Not thread-safe.
class Pages {
 public:
  /// Frames a page: a page of long ids stays below 64 KiB, and of usual ones is about 2 KiB.
  static constexpr std::size_t kPageSize = 60;

  Pages(std::string partition, std::uint64_t incarnation)
      : partition_(std::move(partition)), incarnation_(incarnation) {}

  /// Notes a frame's parent. O(log frames).
  void put(const std::string& id, const std::string& parent);
  void erase(const std::string& id);

  /// Closes a change of structure, of as many frames as it has; the epoch that shows it.
  std::uint64_t close_epoch() { return ++epoch_; }
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }

  /// The pages to publish since the last call, in the order in which to publish them.
  [[nodiscard]] std::vector<Page> take_changed();

  [[nodiscard]] std::size_t frame_count() const { return page_of_.size(); }
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(pages_.size()); }

 private:
  using Frames = std::map<std::string, std::string>;  // id to parent

  std::string partition_;
  std::uint64_t incarnation_;
  std::uint64_t epoch_ = 0;
  std::uint64_t published_epoch_ = 0;
  std::vector<Frames> pages_;
  std::unordered_map<std::string, std::uint32_t> page_of_;
  std::set<std::uint32_t> with_room_;
  std::set<std::uint32_t> changed_;
};

}  // namespace tfdude
