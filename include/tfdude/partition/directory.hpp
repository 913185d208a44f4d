#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/partition/messages.hpp"
#include "tfdude/tree/forest.hpp"

namespace tfdude {

/// What is known of one partition.
struct PartitionInfo {
  std::string name;
  std::string host;
  std::uint32_t pid = 0;
  std::size_t frames = 0;
  bool reachable = false;
  Time since{};  ///< reachable or not since then, by the caller's clock
};

/// A participant's replica of the structure: which partition owns which frame. Writes what the owners
/// publish into the participant's forest and names the forest's owner numbers. What it holds is a function
/// of the pages, not of the order in which they came. Not thread-safe; the forest it writes to is.
class Directory {
 public:
  /// @param own  the name of the partition that this process serves; empty: none
  Directory(Forest& forest, std::string own);

  /// A partition is served. A later incarnation replaces an earlier one.
  void apply(const Presence& presence, Time now);

  /// A piece of a partition's structure.
  void apply(const Page& page);

  /// The partition's participant has gone; its structure is kept.
  /// @return false where this is not news
  bool lost(std::string_view partition, std::uint64_t incarnation, Time now);

  /// This process released a frame that it held: another's claim to it may show now.
  void released(const std::string& id);

  /// This process moved a frame that it holds: another's frame may hang below it now.
  void moved() { mend(); }

  /// The number under which the forest knows a partition; kHeldHere for the own one.
  [[nodiscard]] std::optional<Owner> owner(std::string_view partition) const;
  [[nodiscard]] const std::string& name(Owner owner) const { return partitions_[owner].info.name; }
  [[nodiscard]] bool reachable(Owner owner) const { return partitions_[owner].info.reachable; }
  [[nodiscard]] const PartitionInfo& info(Owner owner) const { return partitions_[owner].info; }

  /// Up to which epoch this partition's structure is here.
  [[nodiscard]] std::uint64_t epoch(Owner owner) const { return partitions_[owner].epoch; }

  /// Whether all pages of all reachable partitions have come.
  [[nodiscard]] bool complete() const;

  /// The other partitions and, where there is one, the own; sorted by name.
  [[nodiscard]] std::vector<PartitionInfo> partitions() const;

  /// The live incarnation of a partition, if one is known.
  [[nodiscard]] std::optional<Presence> serving(std::string_view partition) const;

 private:
  struct Known {
    PartitionInfo info;
    std::uint64_t incarnation = 0;
    std::uint64_t epoch = 0;
    std::uint32_t page_count = 0;
    std::map<std::uint32_t, std::vector<PageEntry>> pages;
    // How many pages list an id: a frame that changes its page may come before it goes.
    std::unordered_map<std::string, std::size_t> listed;
  };
  struct Claim {
    Owner owner = kHeldHere;
    std::string parent;
  };

  Known& known(const std::string& partition, Owner& owner);
  bool advance(Known& partition, Owner owner, std::uint64_t incarnation);
  void leave_page(Known& partition, Owner owner, const std::string& id, bool stays);
  void claim(const PageEntry& entry, Owner owner);
  void unclaim(const std::string& id, Owner owner);
  void promote(const std::string& id);
  void shadow(const std::string& id, Claim claim);
  void put(const std::string& id, const Claim& claim);
  void mend();

  Forest& forest_;
  std::vector<Known> partitions_;  // by Owner; the first is the own
  std::unordered_map<std::string, Owner> owners_;
  // Frames that several partitions claim: all claims but the one in force, that of the least name.
  std::unordered_map<std::string, std::vector<Claim>> shadowed_;
  // Claims in force whose parent lies below the frame, which is kept as a root: a conflict of two owners,
  // as a rule only until another page comes.
  std::map<std::string, Claim> cut_;
};

}  // namespace tfdude
