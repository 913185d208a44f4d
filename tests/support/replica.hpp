#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "partition/directory.hpp"

namespace tfdude::testing {

/// The knowledge of one participant: its forest, and the directory that writes others' structure
/// into it.
struct Replica {
  /// @param own  the partition that it serves; empty: none
  explicit Replica(const std::string& own = {}) : directory(forest, own) {
    EdgeTiming timing;
    timing.max_ahead = std::chrono::nanoseconds::max();  // because the clock does not advance
    (void)forest.set_default_timing(timing);
  }
  Replica(const Replica&) = delete;
  Replica& operator=(const Replica&) = delete;

  /// "id < parent @ partition, attached" of each frame, sorted. Owners appear by name, because
  /// their numbers depend on the order of discovery.
  [[nodiscard]] std::vector<std::string> structure() const {
    std::vector<std::string> lines;
    for (const FrameInfo& frame : forest.frames()) {
      lines.push_back(frame.id + " < " + frame.parent + " @ " + directory.name(frame.owner) +
                      (frame.attached ? ", attached" : ""));
    }
    std::sort(lines.begin(), lines.end());
    return lines;
  }

  /// Takes all of a partition's pages, as a late joiner would.
  void apply(const std::vector<Page>& pages) {
    for (const Page& page : pages) directory.apply(page);
  }

  Forest forest{[] { return Time(std::chrono::seconds(1)); }};  // the clock does not advance
  Directory directory;
};

/// Empty if both are equal; otherwise the elements that one of them lacks. Both must be sorted.
[[nodiscard]] inline std::string lines_diff(const std::vector<std::string>& actual,
                                            const std::vector<std::string>& expected) {
  std::vector<std::string> lacks;
  std::vector<std::string> extra;
  std::set_difference(expected.begin(), expected.end(), actual.begin(), actual.end(),
                      std::back_inserter(lacks));
  std::set_difference(actual.begin(), actual.end(), expected.begin(), expected.end(),
                      std::back_inserter(extra));
  std::string text;
  for (const std::string& line : lacks) text += "\nlacks " + line;
  for (const std::string& line : extra) text += "\nhas   " + line;
  return text;
}

[[nodiscard]] inline Presence presence_of(const std::string& partition, std::uint64_t incarnation,
                                          std::uint32_t pages) {
  return {partition, incarnation, "host-of-" + partition, 4711, pages, true};
}

}  // namespace tfdude::testing
