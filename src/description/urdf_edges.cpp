#include "description/urdf_edges.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/base/number.hpp"

namespace tfdude {
namespace {

// The largest position or limit [rad or m], multiplier and offset. Up to it no variance overflows.
constexpr double kLargest = 1e9;

bool is_sane(double value) { return std::abs(value) <= kLargest; }  // false for NaN

// Whether something is said about the position.
bool has_position(const UrdfJoint& said) {
  return said.position || said.stddev || said.sample_stddev;
}

std::optional<JointType> moving_type(const urdf::Joint& joint) {
  switch (joint.type) {
    case urdf::Joint::REVOLUTE:
      return JointType::kRevolute;
    case urdf::Joint::CONTINUOUS:
      return JointType::kContinuous;
    case urdf::Joint::PRISMATIC:
      return JointType::kPrismatic;
    default:
      return std::nullopt;
  }
}

class EdgeReader {
 public:
  EdgeReader(const UrdfTree& tree, const UrdfJoints& joints, const UrdfPart& part,
             const std::vector<std::size_t>& links)
      : tree_(tree),
        joints_(joints),
        part_(part),
        edges_(tree.joints.size()),
        chosen_(tree.joints.size(), false) {
    for (const std::size_t link : links) {
      if (tree.links[link].joint) chosen_[*tree.links[link].joint] = true;
    }
  }

  [[nodiscard]] Result<std::vector<UrdfEdge>> edges() {
    for (const auto& [name, said] : part_.joints) {
      if (tree_.joint_index.count(name) == 0) {
        return fail(Errc::kInvalidInput, part_.file + ": joint " + quote(name) + " does not exist");
      }
    }
    Result<void> ok;
    for (std::size_t i = 0; ok && i < edges_.size(); ++i) ok = read(i);
    for (std::size_t i = 0; ok && i < edges_.size(); ++i) {
      if (auto resolved = resolve(i); chosen_[i]) ok = std::move(resolved);
    }
    for (std::size_t i = 0; ok && i < edges_.size(); ++i) {
      if (auto coupled = couple(i); chosen_[i]) ok = std::move(coupled);
    }
    if (!ok) return tl::unexpected(ok.error());
    return std::move(edges_);
  }

 private:
  using Index = std::size_t;

  [[nodiscard]] const urdf::Joint& urdf_of(Index i) const {
    return *joints_.at(tree_.joints[i].name);
  }
  [[nodiscard]] const UrdfJoint& said_of(Index i) const {
    const auto found = part_.joints.find(tree_.joints[i].name);
    return found == part_.joints.end() ? nothing_ : found->second;
  }

  [[nodiscard]] Result<void> read(Index i);
  [[nodiscard]] Result<void> read_motion(Index i, JointSpec& joint) const;
  [[nodiscard]] Result<void> read_limits(Index i, JointSpec& joint) const;
  [[nodiscard]] Result<void> read_position(Index i, JointSpec& joint) const;
  [[nodiscard]] Result<Mimic> read_mimic(Index i) const;
  [[nodiscard]] Result<void> resolve(Index i);
  [[nodiscard]] Result<void> couple(Index i);

  const UrdfTree& tree_;
  const UrdfJoints& joints_;
  const UrdfPart& part_;
  const UrdfJoint nothing_;
  std::vector<UrdfEdge> edges_;
  // The joints of the part. Broken mimics of other joints are no error here: the owner of such a
  // joint reports them.
  std::vector<bool> chosen_;
};

// Reads everything that does not depend on other joints.
Result<void> EdgeReader::read(Index i) {
  const urdf::Joint& urdf = urdf_of(i);
  const urdf::Pose& origin = urdf.parent_to_joint_origin_transform;
  const urdf::Rotation& q = origin.rotation;
  const auto rotation = tree_.joints[i].rotation.value_or(Eigen::Quaterniond(q.w, q.x, q.y, q.z));
  const auto pose =
      Pose::create(rotation, {origin.position.x, origin.position.y, origin.position.z});
  if (!pose) return tree_.joint_error(i, "origin: " + pose.error().message);
  edges_[i].X_PJ.pose = *pose;
  const UrdfJoint& said = said_of(i);
  const auto type = moving_type(urdf);
  edges_[i].X_PJ.covariance = said.origin.value_or(type ? StatedCovariance::exact() : part_.fixed);
  if (!type) {
    if (!has_position(said)) return {};
    return tree_.joint_error(i, "has no position: it does not move by one number");
  }
  JointSpec joint;
  joint.name = part_.prefix + urdf.name;
  if (auto ok = check_new_id(joint.name, "name"); !ok)
    return tree_.joint_error(i, ok.error().message);
  joint.type = *type;
  joint.strict = part_.strict_limits;
  auto ok = read_motion(i, joint).and_then([&] { return read_limits(i, joint); }).and_then([&] {
    return read_position(i, joint);
  });
  edges_[i].joint = std::move(joint);
  return ok;
}

Result<void> EdgeReader::read_motion(Index i, JointSpec& joint) const {
  const urdf::Vector3& xyz = urdf_of(i).axis;
  const Eigen::Vector3d given(xyz.x, xyz.y, xyz.z);
  const Eigen::Vector3d axis = given.stableNormalized();
  if (!(std::abs(axis.norm() - 1.0) < 1e-9)) {
    return tree_.joint_error(i, "axis: has no direction");
  }
  const bool slides = joint.type == JointType::kPrismatic;
  joint.joint =
      slides ? prismatic_joint(edges_[i].X_PJ, axis) : revolute_joint(edges_[i].X_PJ, axis);
  return {};
}

Result<void> EdgeReader::read_limits(Index i, JointSpec& joint) const {
  const auto& limits = urdf_of(i).limits;
  if (!limits) return {};
  joint.limits = JointLimits{limits->lower, limits->upper};
  const std::string both = number_text(limits->lower) + " and " + number_text(limits->upper);
  if (!(limits->lower <= limits->upper)) {
    return tree_.joint_error(i, "limits " + both + ": the lower limit is above the upper one");
  }
  // A limit beyond every valid position is no limit.
  joint.limits->lower = std::max(limits->lower, -kLargest);
  joint.limits->upper = std::min(limits->upper, kLargest);
  if (joint.limits->lower <= -kLargest && joint.limits->upper >= kLargest) joint.limits.reset();
  if (!joint.limits || joint.limits->lower <= joint.limits->upper) return {};
  return tree_.joint_error(i, "limits " + both + " are beyond 1e9");
}

Result<void> EdgeReader::read_position(Index i, JointSpec& joint) const {
  const UrdfJoint& said = said_of(i);
  if (urdf_of(i).mimic) {
    if (!has_position(said)) return {};
    return tree_.joint_error(
        i, "has no position of its own: it mimics " + quote(urdf_of(i).mimic->joint_name));
  }
  joint.position = said.position.value_or(rest_position(joint.limits));
  if (!is_sane(joint.position)) {
    return tree_.joint_error(i, "position " + number_text(joint.position) + " is beyond 1e9");
  }
  const auto& limits = joint.limits;
  if (limits && !limits->contain(joint.position)) {
    return tree_.joint_error(i, "position " + number_text(joint.position) +
                                    " is outside its limits " + number_text(limits->lower) +
                                    " and " + number_text(limits->upper));
  }
  for (const auto& stddev : {said.stddev, said.sample_stddev}) {
    if (!stddev || (*stddev >= 0 && is_sane(*stddev))) continue;
    return tree_.joint_error(i, "stddev " + number_text(*stddev) + " is not within 0 and 1e9");
  }
  if (said.stddev) joint.variance = *said.stddev * *said.stddev;
  if (said.sample_stddev) joint.sample_variance = *said.sample_stddev * *said.sample_stddev;
  return {};
}

// The mimic as the file has it: its joint may itself mimic another one.
Result<Mimic> EdgeReader::read_mimic(Index i) const {
  const urdf::JointMimic& mimic = *urdf_of(i).mimic;
  const std::string what = "mimics " + quote(mimic.joint_name);
  const auto other = tree_.joint_index.find(mimic.joint_name);
  if (other == tree_.joint_index.end())
    return tree_.joint_error(i, what + ", which does not exist");
  if (!moving_type(urdf_of(other->second))) {
    return tree_.joint_error(i, what + ", which does not move by one number");
  }
  return Mimic{mimic.joint_name, mimic.multiplier, mimic.offset};
}

// Follows the chain of mimics to the joint that mimics none. Then goes back along the chain and
// makes each joint mimic that last joint directly.
Result<void> EdgeReader::resolve(Index i) {
  std::vector<Index> chain;
  std::vector<Mimic> links;
  Index last = i;
  const auto open = [&] {
    return edges_[last].joint && urdf_of(last).mimic && !edges_[last].joint->mimic;
  };
  while (open()) {
    auto mimic = read_mimic(last);
    if (!mimic) return tl::unexpected(mimic.error());
    chain.push_back(last);
    last = tree_.joint_index.at(mimic->joint);
    links.push_back(*std::move(mimic));
    if (chain.size() > edges_.size() || last == i) {
      return tree_.joint_error(i, chain.size() == 1 ? "mimics itself" : "mimics in a circle");
    }
  }
  while (!chain.empty()) {
    Mimic mimic = std::move(links.back());
    if (const auto& further = edges_[last].joint->mimic) {
      mimic.offset += mimic.multiplier * further->offset;
      mimic.multiplier *= further->multiplier;
      mimic.joint = further->joint;
    }
    last = chain.back();
    if (!is_sane(mimic.multiplier) || !is_sane(mimic.offset)) {
      return tree_.joint_error(last, "mimic: its multiplier or offset is beyond 1e9");
    }
    edges_[last].joint->mimic = std::move(mimic);
    chain.pop_back();
    links.pop_back();
  }
  return {};
}

// Both joints of a mimic share an error source. The follower's position and variance are computed
// from the other joint.
Result<void> EdgeReader::couple(Index i) {
  auto& joint = edges_[i].joint;
  if (!joint || !joint->mimic) return {};
  Mimic& mimic = *joint->mimic;
  JointSpec& other = *edges_[tree_.joint_index.at(mimic.joint)].joint;
  mimic.joint = other.name;
  other.coupled = true;
  joint->coupled = true;
  mimic.of_continuous = other.type == JointType::kContinuous;
  joint->position = mimic.position(other.position);
  joint->variance = mimic.variance(other.variance);
  joint->sample_variance = mimic.variance(other.sample_variance);
  if (auto ok = check_joint(*joint); !ok) return tree_.joint_error(i, ok.error().message);
  const double variance = std::max(joint->variance.value_or(0), joint->sample_variance.value_or(0));
  if (is_sane(joint->position) && variance <= kMaxVariance) return {};
  return tree_.joint_error(i, "mimic: its position or the variance of that is too large");
}

}  // namespace

Result<std::vector<UrdfEdge>> read_urdf_edges(const UrdfTree& tree, const UrdfJoints& joints,
                                              const UrdfPart& part,
                                              const std::vector<std::size_t>& links) {
  return EdgeReader(tree, joints, part, links).edges();
}

}  // namespace tfdude
