#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "simulation/actor.hpp"
#include "simulation/author.hpp"
#include "simulation/follower.hpp"
#include "simulation/plan.hpp"
#include "simulation/process.hpp"
#include "simulation/sampler.hpp"

namespace tfdude::simulation {

/// What the configuration of a daemon says besides its base, and the joints of authors.
struct Configured {
  enum class Spare { kAbsent, kFixed, kMoved };
  bool extra = false;            ///< whether there is one more frame
  std::size_t extra_parent = 0;  ///< see extra_parent_of()
  Spare spare = Spare::kAbsent;  ///< whether there is another one, and a joint moves it
  bool handed = false;           ///< whether it has taken a frame of the last owner over

  /// The next configuration: some frame or joint appears or vanishes, or has another parent.
  void change(std::size_t how);
};

class Streamer;

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
        configured(plan.owners) {
    configured[wild].handed = true;
  }

  std::vector<std::shared_ptr<Process>> daemons;  ///< by owner; null: it is down
  std::vector<Standing> standings;                ///< by owner, in the end
  const std::size_t wild;              ///< the last owner, which may be renamed and replaced
  int renamed = 0;                     ///< how often
  std::vector<Configured> configured;  ///< by owner
  std::vector<std::shared_ptr<Actor>> actors;  // also those of the next three lists
  std::vector<std::shared_ptr<Author>> authors;
  std::vector<std::shared_ptr<Follower>> followers;
  std::vector<std::shared_ptr<Sampler>> samplers;
  std::vector<std::shared_ptr<Streamer>> streamers;

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

/// The frame that a configuration may have besides the base, and its parents.
[[nodiscard]] std::string extra_of(std::size_t owner);
[[nodiscard]] std::string extra_parent_of(std::size_t owner, const Configured& configured,
                                          std::size_t owners);
/// A frame of the last owner, which another one may take over.
inline constexpr const char* kHanded = "handed";
/// Another one, and the joint that may move it.
[[nodiscard]] std::string spare_of(std::size_t owner);
[[nodiscard]] std::string spare_joint_of(std::size_t owner);

}  // namespace tfdude::simulation
