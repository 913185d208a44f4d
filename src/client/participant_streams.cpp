#include <algorithm>

#include "client/participant.hpp"

// What is streamed without waiting.
namespace tfdude {

Destination Participant::destination(Owner owner) const {
  return {owner, directory_.name(owner), owner == kHeldHere || directory_.reachable(owner)};
}

SenderLinks<Update> Participant::links_of_edge_streams() {
  SenderLinks<Update> links;
  links.find = [this](const std::vector<std::string>& ids) {
    std::vector<std::vector<Destination>> found(ids.size());
    const std::lock_guard lock(structure_mutex_);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (const auto frame = forest_.info(ids[i])) found[i].push_back(destination(frame->owner));
    }
    return found;
  };
  links.connect = [this](const std::string& to) { return transport_->update_channel(to); };
  links.apply_here = [this](const Update& update) {
    return forest_.update(update.edges, update.stamp);
  };
  links.out = [this] { return out_.load(std::memory_order_relaxed); };
  links.unknown = Errc::kUnknownFrame;
  return links;
}

SenderLinks<JointUpdate> Participant::links_of_joint_streams() {
  SenderLinks<JointUpdate> links;
  links.find = [this](const std::vector<std::string>& names) {
    std::vector<std::vector<Destination>> found(names.size());
    const std::lock_guard lock(structure_mutex_);
    for (std::size_t i = 0; i < names.size(); ++i) {
      for (const Owner owner : directory_.joint_owners(names[i])) {
        found[i].push_back(destination(owner));
      }
    }
    return found;
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

Result<EdgeStream> Participant::stream(const std::vector<std::string>& edges) {
  return streams_.edges(edges);
}

Result<JointStream> Participant::stream_joints(const std::vector<std::string>& names) {
  return streams_.joints(names);
}

}  // namespace tfdude
