#include "simulation/joints.hpp"

#include "faults/frames.hpp"

namespace tfdude::simulation {
namespace {

Joint along_z() { return prismatic_joint({}, {0, 0, 1}); }

FrameSpec spec_of(const MovedFrame& moved, const std::string& leader) {
  JointSpec joint;
  joint.name = moved.joint;
  joint.type = JointType::kPrismatic;
  joint.joint = along_z();
  joint.coupled = true;
  if (moved.joint != leader) joint.mimic = Mimic{leader, moved.slope, moved.offset};
  joint.position = moved.position(0);
  return {moved.frame, faults::base_of(moved.owner), moved.value(0), {}, {}, joint};
}

}  // namespace

Transform MovedFrame::value(double of_leader) const {
  return joint_transform(along_z(), position(of_leader), 0);
}

std::vector<MovedFrame> frames_moved_by(std::size_t author, std::size_t owners) {
  const std::string name = std::to_string(author);
  return {{"lead_" + name, "j" + name, author % owners},
          {"follow_" + name, "k" + name, (author + 1) % owners, -2, 0.5}};
}

FrameSpec moved_by(const std::string& joint, const std::string& frame, const std::string& parent) {
  JointSpec spec;
  spec.name = joint;
  spec.type = JointType::kPrismatic;
  spec.joint = along_z();
  return {frame, parent, joint_transform(along_z(), 0, 0), {}, {}, spec};
}

std::vector<FrameSpec> joint_frames_of(std::size_t owner, const Plan& plan) {
  std::vector<FrameSpec> frames;
  for (std::size_t author = 0; author < plan.clients; ++author) {
    const auto moved = frames_moved_by(author, plan.owners - 1);
    for (const MovedFrame& one : moved) {
      if (one.owner == owner) frames.push_back(spec_of(one, moved.front().joint));
    }
  }
  return frames;
}

}  // namespace tfdude::simulation
