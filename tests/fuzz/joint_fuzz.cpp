// Passes any bytes to a participant on the topic of joints.

#include <string_view>
#include <vector>

#include "fuzz/wire.hpp"
#include "partition/partition.hpp"
#include "support/joint_frames.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

void strip(wire::Joints&, std::vector<fastdds::Numbers>&) {}

void demand_same_names(const Bytes& bytes, const wire::Joints& sample) {
  auto joint = sample.positions().begin();
  const auto differs = fastdds::any_joint(bytes.data(), bytes.size(), [&](std::string_view name) {
    return joint == sample.positions().end() || name != (joint++)->id().c_str();
  });
  demand(differs == false && joint == sample.positions().end(), "names are read as the whole is");
}

/// An arm whose elbow a hand follows.
struct Arm : testing::Replica {
  Arm() : Replica("arm"), partition("arm", 1, forest, directory) {
    JointSpec elbow = testing::revolute_named("elbow");
    elbow.coupled = true;
    demand(partition
               .load({{"base", "", {}},
                      testing::moved_by("fore", "base", elbow),
                      testing::moved_by("hand", "fore", testing::following("a", "elbow", -2, 1))},
                     Time{})
               .has_value(),
           "an arm can be loaded");
  }
  Partition partition;
};

void demand_applied(const JointUpdate& update) {
  static Arm arm;
  const auto before = arm.forest.lookup("base", "hand");
  const auto moved = arm.partition.apply(update);
  const auto after = arm.forest.lookup("base", "hand");
  demand(!after || after->pose.matrix().allFinite(), "a pose is finite");
  demand(!after || after->covariance.of_specified().matrix().allFinite(), "a covariance is finite");
  if (moved || !before || !after) return;
  demand(before->pose.matrix() == after->pose.matrix(), "what was refused moves nothing");
}

void run(const Bytes& bytes) {
  const bool well_formed = fastdds::well_formed_joints(bytes.data(), bytes.size());
  const auto sample = received<fastdds::JointsType, wire::Joints>(bytes, well_formed);
  if (!sample) return;
  demand_same_names(bytes, *sample);
  const auto all = round_trip<fastdds::JointsType>(
      *sample, [](const JointUpdate& message) { return fastdds::to_wire(message); },
      [](const wire::Joints& wire) {
        return fastdds::from_wire(wire, [](std::string_view) { return true; });
      },
      strip);
  if (all) demand_applied(*all);
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
