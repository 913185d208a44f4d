#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "fuzz/demand.hpp"
#include "fuzz/forest_checks.hpp"
#include "partition/directory.hpp"

// The result that claims of partitions must have, in the simplest implementation: it keeps
// everything, and computes the result again each time.
namespace tfdude::fuzz {

struct PlainClaim {
  std::string parent;
  std::uint64_t lamport_time = 0;
  std::uint32_t page = 0;
};

/// A frame with the partition whose claim to it is in force.
struct PlainFrame {
  std::string owner;
  std::string parent;
  std::uint64_t lamport_time = 0;
};
using Picture = std::map<std::string, PlainFrame>;

[[nodiscard]] inline bool older(const PlainFrame& a, const PlainFrame& b) {
  return std::tie(a.lamport_time, a.owner) < std::tie(b.lamport_time, b.owner);
}

/// The frames of each cycle.
[[nodiscard]] inline std::vector<std::set<std::string>> cycles_of(const Picture& picture) {
  std::vector<std::set<std::string>> cycles;
  std::set<std::string> known;
  for (const auto& [id, frame] : picture) {
    std::set<std::string> line;
    auto at = picture.find(id);
    while (at != picture.end() && line.insert(at->first).second) {
      at = picture.find(at->second.parent);
    }
    if (at == picture.end() || at->first != id || !known.insert(id).second) continue;
    known.insert(line.begin(), line.end());
    cycles.push_back(line);
  }
  return cycles;
}

[[nodiscard]] inline std::string youngest_of(const std::set<std::string>& cycle,
                                             const Picture& picture) {
  return *std::max_element(cycle.begin(), cycle.end(),
                           [&](const std::string& a, const std::string& b) {
                             return std::make_pair(picture.at(a).lamport_time, a) <
                                    std::make_pair(picture.at(b).lamport_time, b);
                           });
}

[[nodiscard]] inline Picture without_cycles(const Picture& picture) {
  Picture cut = picture;
  for (const auto& cycle : cycles_of(picture)) cut[youngest_of(cycle, picture)].parent.clear();
  return cut;
}

/// The messages of one process of a partition so far.
struct PlainLife {
  std::uint64_t incarnation = 0;
  std::uint64_t epoch = 0;
  std::uint64_t latest = 0;
  std::optional<std::uint32_t> page_count;
  std::map<std::uint32_t, Page> pages;
  std::map<std::string, PlainClaim> claims;

  void apply(const Page& page) {
    pages[page.number] = page;
    epoch = std::max(epoch, page.epoch);
    for (auto claim = claims.begin(); claim != claims.end();) {
      const bool listed = std::any_of(page.entries.begin(), page.entries.end(),
                                      [&](const PageEntry& e) { return e.id == claim->first; });
      const bool gone = claim->second.page == page.number && !listed;
      claim = gone ? claims.erase(claim) : std::next(claim);
    }
    for (const Tombstone& tombstone : page.tombstones)
      latest = std::max(latest, tombstone.lamport_time);
    for (const PageEntry& entry : page.entries) {
      latest = std::max(latest, entry.lamport_time);
      const auto there = claims.find(entry.id);
      // The frame has moved to another page since.
      if (there != claims.end() && there->second.page != page.number &&
          there->second.lamport_time > entry.lamport_time) {
        continue;
      }
      claims[entry.id] = {entry.parent, entry.lamport_time, page.number};
    }
  }

  [[nodiscard]] bool complete() const { return page_count && pages.size() >= *page_count; }
};

/// A partition with its processes: the one whose structure is in force, and the one that is going
/// to replace it.
class PlainPartition {
 public:
  [[nodiscard]] const PlainLife& life() const { return life_; }

  /// @param tells  whether the participant tells others which partitions it misses
  /// @return the tombstones that are new by it
  std::vector<Tombstone> apply(const Page& page, bool tells) {
    const bool current = !life_.pages.empty() && page.incarnation == life_.incarnation;
    if (!current && drops(page.incarnation, tells)) return {};
    reachable_ = reachable_ || page.incarnation > latest_;
    PlainLife* said = life_of(page.incarnation);
    if (said == nullptr) return {};
    said->apply(page);
    return said == &life_ ? page.tombstones : replace_if_complete();
  }

  std::vector<Tombstone> apply(const Presence& presence, bool tells) {
    if (!presence.serving || drops(presence.incarnation, tells)) return {};
    reachable_ = true;
    PlainLife* said = life_of(presence.incarnation);
    if (said == nullptr) return {};
    said->page_count = presence.pages;
    return said == &life_ ? std::vector<Tombstone>() : replace_if_complete();
  }

  void lose(std::uint64_t incarnation) { reachable_ = reachable_ && incarnation != latest_; }

 private:
  // An earlier process than the one known is dropped, and continues with a later number as soon as
  // it is told so. A participant that cannot tell it believes it once the known one is lost.
  [[nodiscard]] bool drops(std::uint64_t incarnation, bool tells) {
    if (incarnation >= latest_) return false;
    if (tells || reachable_) return true;
    latest_ = 0;
    next_.reset();
    return false;
  }

  // Null for one that has been overtaken by a later.
  PlainLife* life_of(std::uint64_t incarnation) {
    latest_ = std::max(latest_, incarnation);
    if (incarnation == life_.incarnation) return &life_;
    if (life_.pages.empty()) {
      life_ = PlainLife{};
      life_.incarnation = incarnation;
      return &life_;
    }
    if (next_ && incarnation < next_->incarnation) return nullptr;
    if (!next_ || incarnation > next_->incarnation) {
      next_ = PlainLife{};
      next_->incarnation = incarnation;
    }
    return &*next_;
  }

  std::vector<Tombstone> replace_if_complete() {
    if (!next_->complete()) return {};
    life_ = PlainLife{};
    life_.incarnation = next_->incarnation;
    life_.page_count = next_->page_count;
    std::vector<Tombstone> tombstones;
    for (const auto& [number, page] : next_->pages) {
      life_.apply(page);
      tombstones.insert(tombstones.end(), page.tombstones.begin(), page.tombstones.end());
    }
    next_.reset();
    return tombstones;
  }

  PlainLife life_;
  std::optional<PlainLife> next_;
  std::uint64_t latest_ = 0;
  bool reachable_ = false;
};

/// The messages of all partitions to one participant.
class PlainClaims {
 public:
  /// @param tells  whether it has a partition, so that others hear which partitions it misses
  explicit PlainClaims(bool tells) : tells_(tells) {}

  /// A page or a presence. @return the tombstones that are new by it
  template <class Said>
  std::vector<Tombstone> apply(const Said& said) {
    return partitions_[said.partition].apply(said, tells_);
  }

  void lose(const std::string& partition, std::uint64_t incarnation) {
    partitions_[partition].lose(incarnation);
  }

  [[nodiscard]] std::vector<Page> pages() const {
    std::vector<Page> all;
    for (const auto& [name, partition] : partitions_) {
      for (const auto& [number, page] : partition.life().pages) all.push_back(page);
    }
    return all;
  }

  /// The greatest Lamport time that came with what holds.
  [[nodiscard]] std::uint64_t latest() const {
    std::uint64_t latest = 0;
    for (const auto& [name, partition] : partitions_) {
      latest = std::max(latest, partition.life().latest);
    }
    return latest;
  }

  /// The oldest claim to each frame, whether or not they make cycles.
  [[nodiscard]] Picture oldest() const {
    Picture picture;
    for (const auto& [name, partition] : partitions_) {
      for (const auto& [id, claim] : partition.life().claims) {
        const PlainFrame frame{name, claim.parent, claim.lamport_time};
        const auto [there, fresh] = picture.emplace(id, frame);
        if (!fresh && older(frame, there->second)) there->second = frame;
      }
    }
    return picture;
  }

  [[nodiscard]] const PlainLife* life(const std::string& partition) const {
    const auto there = partitions_.find(partition);
    return there != partitions_.end() ? &there->second.life() : nullptr;
  }

  /// Checks that a directory that heard all messages in this order knows the epochs of all
  /// partitions.
  void demand_counted(const Directory& directory) const {
    for (const auto& [name, partition] : partitions_) {
      const auto owner = directory.owner(name);
      if (!owner && partition.life().pages.empty()) continue;
      demand(owner && *owner != kHeldHere, "who said something is known");
      demand(directory.epoch(*owner) == partition.life().epoch,
             "an epoch is that of the last page");
      demand(directory.info(*owner).frames == partition.life().claims.size(),
             "frames are counted once");
    }
  }

 private:
  bool tells_;
  std::map<std::string, PlainPartition> partitions_;
};

/// Checks that a forest shows this result.
inline void demand_shows(const Forest& forest, const Directory& directory, const Picture& picture) {
  const Frames frames = frames_of(forest);
  for (const auto& [id, frame] : picture) demand(frames.count(id) != 0, "what is claimed is there");
  for (const auto& [id, frame] : frames) {
    const auto expected = picture.find(id);
    demand(expected != picture.end(), "what nobody claims is not there");
    demand(directory.name(frame.owner) == expected->second.owner, "the oldest claim holds");
    demand(frame.parent == expected->second.parent,
           "a frame hangs where it is claimed to, but for the youngest in a cycle");
    demand(frame.lamport_time == expected->second.lamport_time,
           "a frame is as old as it is claimed to be");
  }
}

}  // namespace tfdude::fuzz
