#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tree/forest.hpp"

namespace tfdude {

struct FrameClaim;

/// Which of several partitions' claims to one frame holds, by who is there and who was there while another was not:
///
/// 1. Claims of partitions that are gone do not count where one of a partition counts that is not.
/// 2. A claim does not count beside one of a partition that says it has outlived its owner (Absences), unless that
///    says the same of it.
/// 3. Of the claims left the oldest holds, of the same age that of the lesser name.
///
/// So it depends on what was said and on who is there, not on any order. Not thread-safe.
class Succession {
 public:
  enum class Standing : std::uint8_t {
    kThere,
    kSilent,  ///< perhaps only for a moment: its claims count, but nothing is given up for them
    kGone,
  };

  Owner add_owner(std::string name);
  [[nodiscard]] const std::string& name(Owner owner) const { return owners_[owner].name; }

  /// @return whether that is new
  bool set_standing(Owner owner, Standing standing);
  [[nodiscard]] Standing standing(Owner owner) const { return owners_[owner].standing; }

  /// Whom a partition says that it has outlived. @return whether that is new
  bool set_outlived(Owner owner, std::set<Owner> outlived);

  /// Whether the claims of the second do not count beside those of the first.
  [[nodiscard]] bool outlived(Owner first, Owner second) const;

  /// @param claims  to one frame, by different owners; at least one
  /// @return the one that holds
  [[nodiscard]] const FrameClaim& heir(const std::vector<const FrameClaim*>& claims) const;

 private:
  struct Known {
    std::string name;
    Standing standing = Standing::kThere;
    std::set<Owner> outlived;
  };
  [[nodiscard]] bool older(const FrameClaim& a, const FrameClaim& b) const;

  std::vector<Known> owners_;
};

}  // namespace tfdude
