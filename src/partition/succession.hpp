#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tree/forest.hpp"

namespace tfdude {

struct FrameClaim;

/// Decides which of several partitions' claims to one frame holds, from which partitions are
/// present, and which were present while another was not:
///
/// 1. Claims of partitions that are gone do not count if another claim does.
/// 2. A claim does not count against that of a partition that has survived its owner (Absences),
///    unless the owner says the same of that partition.
/// 3. Of the remaining claims the oldest is in force; ties: the alphabetically first partition.
///
/// So the result depends on the reports and on which partitions are present, not on any order. Not
/// thread-safe.
class Succession {
 public:
  enum class Standing : std::uint8_t {
    kThere,
    kSilent,  ///< perhaps only for a moment: its claims count, but nothing is yielded to it
    kGone,
  };

  Owner add_owner(std::string name);
  [[nodiscard]] const std::string& name(Owner owner) const { return owners_[owner].name; }

  /// @return whether it has changed
  bool set_standing(Owner owner, Standing standing);
  [[nodiscard]] Standing standing(Owner owner) const { return owners_[owner].standing; }

  /// Sets which partitions a partition claims to have survived. @return whether it has changed
  bool set_survived(Owner owner, std::set<Owner> survived);

  /// Whether claims of the second do not count against those of the first.
  [[nodiscard]] bool reported_survivor(Owner first, Owner second) const;
  [[nodiscard]] bool is_gone(Owner owner) const { return standing(owner) == Standing::kGone; }
  /// By both rules, of two partitions alone.
  [[nodiscard]] bool survived(Owner first, Owner second) const;

  /// @param claims  to one frame, by different owners; at least one
  /// @return the claim that holds
  [[nodiscard]] const FrameClaim& winning_claim(const std::vector<const FrameClaim*>& claims) const;

 private:
  struct Known {
    std::string name;
    Standing standing = Standing::kThere;
    std::set<Owner> survived;
  };
  [[nodiscard]] bool older(const FrameClaim& a, const FrameClaim& b) const;

  std::vector<Known> owners_;
};

}  // namespace tfdude
