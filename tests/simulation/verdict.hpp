#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "simulation/author.hpp"
#include "simulation/follower.hpp"
#include "simulation/invariants.hpp"
#include "simulation/plan.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {

/// The participants of a run.
struct Cast {
  explicit Cast(const Plan& plan)
      : daemons(plan.owners), wild(plan.owners - 1), has_extra(plan.owners, false) {}

  std::vector<std::shared_ptr<Process>> daemons;  ///< by owner; null: it is down
  const std::size_t wild;       ///< the last owner, which may be renamed and replaced
  int renamed = 0;              ///< how often
  std::vector<bool> has_extra;  ///< by owner, whether its configuration has one more frame
  std::vector<std::shared_ptr<Author>> authors;
  std::vector<std::shared_ptr<Follower>> followers;

  [[nodiscard]] std::string name_of_daemon(std::size_t owner) const;
  [[nodiscard]] bool serves(const std::string& partition) const {
    return find_daemon(partition) != nullptr;
  }
  [[nodiscard]] Process* find_daemon(const std::string& partition) const;
};

/// The frame that a configuration may have besides the base.
[[nodiscard]] std::string extra_of(std::size_t owner);

/// Checks what must be true after the remaining participants have had time to agree.
class Verdict {
 public:
  struct Calls {
    Violation violation;
    std::function<void(const std::string&, std::size_t)> count;
    std::function<void(Instant)> wait;
  };

  /// @param named  how many frames anybody has tried to add
  Verdict(const Plan& plan, const Cast& cast, std::size_t named, Calls calls)
      : plan_(plan), cast_(cast), named_(named), calls_(std::move(calls)) {}

  void check();

 private:
  void violation(const std::string& kind, const std::string& what);
  [[nodiscard]] bool passes_over_one(Process& client) const;
  void check_replica(Process& one, const std::vector<std::string>& expected);
  void check_follower(Follower& follower);
  void check_owners(Process& one);
  [[nodiscard]] bool is_left_over(const FrameInfo& frame, Process& seen_by) const;
  void check_author(Author& author);
  void check_kept(Process& one);
  void check_kept_by_owner(Process& owner);

  const Plan& plan_;
  const Cast& cast_;
  const std::size_t named_;
  const Calls calls_;
  bool agreed_ = true;
};

}  // namespace tfdude::simulation
