#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tfdude/partition/directory.hpp"

#include "fuzz/demand.hpp"
#include "fuzz/forest_checks.hpp"

namespace tfdude::fuzz {

/// What partitions have said that they own, in the plainest way: the pages of each one's last life.
class PlainClaims {
 public:
  void apply(const Page& page) {
    Life& life = lives_[page.partition];
    if (!life.advance(page.incarnation)) return;
    life.pages[page.number] = page;
    life.epoch = std::max(life.epoch, page.epoch);
  }

  void apply(const Presence& presence) {
    if (presence.serving) (void)lives_[presence.partition].advance(presence.incarnation);
  }

  [[nodiscard]] std::vector<Page> pages() const {
    std::vector<Page> all;
    for (const auto& [name, life] : lives_) {
      for (const auto& [number, page] : life.pages) all.push_back(page);
    }
    return all;
  }

  /// The parents that a partition lists for a frame: as a rule one, as it changes its page for a moment two.
  [[nodiscard]] std::set<std::string> parents(const std::string& partition,
                                              const std::string& id) const {
    std::set<std::string> parents;
    for (const auto& [number, page] : lives_.at(partition).pages) {
      for (const PageEntry& entry : page.entries) {
        if (entry.id == id) parents.insert(entry.parent);
      }
    }
    return parents;
  }

  /// That a directory has made of it what it is to: each frame has its owner and its parent. What the process
  /// holds itself is its own, whatever others say.
  void demand_followed(const Forest& forest, const Directory& directory) const {
    const Frames frames = frames_of(forest);
    for (const auto& [name, life] : lives_) {
      for (const std::string& id : life.ids()) {
        demand(frames.count(id) != 0, "what is claimed is there");
      }
    }
    for (const auto& [id, frame] : frames) {
      if (frame.owner != kHeldHere) demand_rightful(frames, frame, directory.name(frame.owner));
    }
  }

  /// That a directory which heard all of it, in this order, knows who said how much.
  void demand_counted(const Directory& directory) const {
    for (const auto& [name, life] : lives_) {
      const auto owner = directory.owner(name);
      demand(owner && *owner != kHeldHere, "who said something is known");
      demand(directory.epoch(*owner) == life.epoch, "an epoch is that of the last page");
      demand(directory.info(*owner).frames == life.ids().size(), "frames are counted once");
    }
  }

 private:
  struct Life {
    bool advance(std::uint64_t to) {
      if (to < incarnation) return false;
      if (to > incarnation) *this = Life{to, 0, {}};
      return true;
    }

    [[nodiscard]] std::set<std::string> ids() const {
      std::set<std::string> ids;
      for (const auto& [number, page] : pages) {
        for (const PageEntry& entry : page.entries) ids.insert(entry.id);
      }
      return ids;
    }

    std::uint64_t incarnation = 0;
    std::uint64_t epoch = 0;
    std::map<std::uint32_t, Page> pages;
  };

  void demand_rightful(const Frames& frames, const FrameInfo& frame,
                       const std::string& owner) const {
    const auto least = std::find_if(lives_.begin(), lives_.end(), [&](const auto& life) {
      return !parents(life.first, frame.id).empty();
    });
    demand(least != lives_.end() && least->first == owner, "the claim of the least name holds");
    const auto claimed = parents(owner, frame.id);
    if (claimed.count(frame.parent) != 0) return;
    const bool closes_cycle =
        std::any_of(claimed.begin(), claimed.end(), [&](const std::string& parent) {
          const auto line = line_of(frames, parent);
          return parent == frame.id || std::count(line.begin(), line.end(), frame.id) != 0;
        });
    demand(frame.parent.empty() && closes_cycle, "only what closes a cycle is cut off");
  }

  std::map<std::string, Life> lives_;  // by name: the least first
};

}  // namespace tfdude::fuzz
