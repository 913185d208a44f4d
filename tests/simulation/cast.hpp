#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "simulation/author.hpp"
#include "simulation/follower.hpp"
#include "simulation/plan.hpp"
#include "simulation/process.hpp"
#include "simulation/sampler.hpp"

namespace tfdude::simulation {

/// The participants of a run.
struct Cast {
  /// What a daemon's lasting faults leave of it.
  enum class Standing {
    kCore,   ///< all is well
    kAside,  ///< others hear it, but it cannot do all that they agree on
    kOut,    ///< others do not hear it
  };

  explicit Cast(const Plan& plan)
      : daemons(plan.owners),
        standings(plan.owners, Standing::kCore),
        wild(plan.owners - 1),
        has_extra(plan.owners, false) {}

  std::vector<std::shared_ptr<Process>> daemons;  ///< by owner; null: it is down
  std::vector<Standing> standings;                ///< by owner, in the end
  const std::size_t wild;       ///< the last owner, which may be renamed and replaced
  int renamed = 0;              ///< how often
  std::vector<bool> has_extra;  ///< by owner, whether its configuration has one more frame
  std::vector<std::shared_ptr<Author>> authors;
  std::vector<std::shared_ptr<Follower>> followers;
  std::vector<std::shared_ptr<Sampler>> samplers;

  [[nodiscard]] std::string name_of_daemon(std::size_t owner) const;
  /// Null: no running daemon is to serve it.
  [[nodiscard]] Process* find_daemon(const std::string& partition) const;
  /// The standing of whoever is to serve it.
  [[nodiscard]] Standing standing(const std::string& partition) const;
  /// Whether others hear whoever serves it.
  [[nodiscard]] bool serves(const std::string& partition) const {
    return standing(partition) != Standing::kOut;
  }
};

/// The frame that a configuration may have besides the base.
[[nodiscard]] std::string extra_of(std::size_t owner);

}  // namespace tfdude::simulation
