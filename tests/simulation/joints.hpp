#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tfdude/types/frame.hpp"

#include "faults/model.hpp"
#include "simulation/plan.hpp"

// The joints of a run: each author moves one, which another one follows, mostly of another
// partition.
namespace tfdude::simulation {

/// A frame that a joint moves.
struct MovedFrame {
  std::string frame;
  std::string joint;
  std::size_t owner = 0;
  double slope = 1;
  double offset = 0;
  /// Its position if the author's joint is at this one.
  [[nodiscard]] double position(double of_leader) const { return slope * of_leader + offset; }
  /// The value of its edge then.
  [[nodiscard]] Transform value(double of_leader) const;
};

/// The frame of an author's joint, and that of its follower.
[[nodiscard]] std::vector<MovedFrame> frames_moved_by(std::size_t author, std::size_t owners);

/// A frame that a joint of its own moves along z, from 0 on.
[[nodiscard]] FrameSpec moved_by(const std::string& joint, const std::string& frame,
                                 const std::string& parent);

/// What the configuration of an owner says about joints.
[[nodiscard]] std::vector<FrameSpec> joint_frames_of(std::size_t owner, const Plan& plan);

}  // namespace tfdude::simulation
