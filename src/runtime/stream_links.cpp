#include "runtime/stream_links.hpp"

#include "base/mutex.hpp"

namespace tfdude {
namespace {

// @param owners_of  returns the owners of an edge or joint, from the directory
template <class OwnersOf>
std::vector<std::vector<Destination>> destinations(Structure& structure,
                                                   const std::vector<std::string>& names,
                                                   OwnersOf owners_of) {
  std::vector<std::vector<Destination>> found(names.size());
  const Lock lock(structure.mutex);
  for (std::size_t i = 0; i < names.size(); ++i) {
    for (const Owner owner : owners_of(structure.directory, names[i])) {
      const bool there = owner == kHeldHere || structure.directory.reachable(owner);
      found[i].push_back({owner, structure.directory.name(owner), there});
    }
  }
  return found;
}

}  // namespace

SenderLinks<Update> edge_links(Structure& structure, Transport& transport, MemberRunner& member) {
  SenderLinks<Update> links;
  links.find = [&structure](const std::vector<std::string>& ids) {
    return destinations(structure, ids, [&structure](const Directory&, const std::string& id) {
      const auto frame = structure.forest.info(id);
      return frame ? std::vector<Owner>{frame->owner} : std::vector<Owner>{};
    });
  };
  links.connect = [&transport](const std::string& to) { return transport.update_channel(to); };
  links.apply_here = [&structure](const Update& update) {
    return structure.forest.update(update.edges, update.stamp);
  };
  links.out = [&member] { return member.out(); };
  links.unknown = Errc::kUnknownFrame;
  return links;
}

SenderLinks<JointUpdate> joint_links(Structure& structure, Transport& transport,
                                     MemberRunner& member) {
  SenderLinks<JointUpdate> links;
  links.find = [&structure](const std::vector<std::string>& names) {
    return destinations(structure, names, [](const Directory& directory, const std::string& name) {
      return directory.joint_owners(name);
    });
  };
  links.connect = [&transport](const std::string& to) { return transport.joint_channel(to); };
  links.apply_here = [&member](const JointUpdate& update) {
    return member.try_apply(update).map([](std::size_t) {});
  };
  links.out = [&member] { return member.out(); };
  links.unknown = Errc::kUnknownJoint;
  return links;
}

}  // namespace tfdude
