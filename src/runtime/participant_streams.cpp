#include <algorithm>

#include "runtime/participant.hpp"

// What is streamed without waiting.
namespace tfdude {

// @param owners_of  of the name of an edge or joint
template <class OwnersOf>
std::vector<std::vector<Destination>> Participant::destinations(
    const std::vector<std::string>& names, OwnersOf owners_of) {
  std::vector<std::vector<Destination>> found(names.size());
  const std::lock_guard lock(structure_.mutex);
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (const Owner owner : owners_of(names[i])) {
      const bool there = owner == kHeldHere || structure_.directory.reachable(owner);
      found[i].push_back({owner, structure_.directory.name(owner), there});
    }
  }
  return found;
}

SenderLinks<Update> Participant::links_of_edge_streams() {
  SenderLinks<Update> links;
  links.find = [this](const std::vector<std::string>& ids) {
    return destinations(ids, [this](const std::string& id) {
      const auto frame = structure_.forest.info(id);
      return frame ? std::vector<Owner>{frame->owner} : std::vector<Owner>{};
    });
  };
  links.connect = [this](const std::string& to) { return transport_->update_channel(to); };
  links.apply_here = [this](const Update& update) {
    return structure_.forest.update(update.edges, update.stamp);
  };
  links.out = [this] { return out_.load(std::memory_order_relaxed); };
  links.unknown = Errc::kUnknownFrame;
  return links;
}

SenderLinks<JointUpdate> Participant::links_of_joint_streams() {
  SenderLinks<JointUpdate> links;
  links.find = [this](const std::vector<std::string>& names) {
    return destinations(
        names, [this](const std::string& name) { return structure_.directory.joint_owners(name); });
  };
  links.connect = [this](const std::string& to) { return transport_->joint_channel(to); };
  links.apply_here = [this](const JointUpdate& update) -> Result<void> {
    const std::unique_lock lock(joints_mutex_, std::try_to_lock);
    if (!lock.owns_lock()) return fail(Errc::kTimeout, "busy");
    return partition_->apply(update).map([](std::size_t) {});
  };
  links.out = [this] { return out_.load(std::memory_order_relaxed); };
  links.unknown = Errc::kUnknownJoint;
  return links;
}

Result<std::shared_ptr<Sender<Update>>> Participant::stream(const std::vector<std::string>& edges) {
  return streams_.edges(edges);
}

Result<std::shared_ptr<Sender<JointUpdate>>> Participant::stream_joints(
    const std::vector<std::string>& names) {
  return streams_.joints(names);
}

}  // namespace tfdude
