#include "runtime/stream_links.hpp"

#include "base/mutex.hpp"

namespace tfdude {
namespace {

using Route = Directory::JointRoute;

// @param route_of  returns the owners of an edge or joint, from the directory
template <class RouteOf>
std::vector<Destinations> destinations(Structure& structure, const std::vector<std::string>& names,
                                       RouteOf route_of) {
  std::vector<Destinations> found(names.size());
  const Lock lock(structure.mutex);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Result<Route> route = route_of(structure.directory, names[i]);
    if (!route) {
      found[i].none = route.error().code;
      continue;
    }
    found[i].name = route->name;
    for (const Owner owner : route->owners) {
      const bool there = owner == kHeldHere || structure.directory.reachable(owner);
      found[i].to.push_back({owner, structure.directory.name(owner), there});
    }
  }
  return found;
}

}  // namespace

SenderLinks<Update> edge_links(Structure& structure, Transport& transport, MemberRunner& member) {
  SenderLinks<Update> links;
  links.find = [&structure](const std::vector<std::string>& ids) {
    const auto route_of = [&](const Directory&, const std::string& id) -> Result<Route> {
      const auto frame = structure.forest.info(id);
      if (!frame) return fail(Errc::kUnknownFrame, "no frame");
      return Route{id, {frame->owner}};
    };
    return destinations(structure, ids, route_of);
  };
  links.connect = [&transport](const std::string& to) { return transport.update_channel(to); };
  links.apply_here = [&structure](const Update& update) {
    return structure.forest.update(update.edges, update.stamp);
  };
  links.out = [&member] { return member.out(); };
  return links;
}

SenderLinks<JointUpdate> joint_links(Structure& structure, Transport& transport,
                                     MemberRunner& member) {
  SenderLinks<JointUpdate> links;
  links.find = [&structure](const std::vector<std::string>& names) {
    return destinations(structure, names, [](const Directory& directory, const std::string& name) {
      return directory.route_joint(name);
    });
  };
  links.connect = [&transport](const std::string& to) { return transport.joint_channel(to); };
  links.apply_here = [&member](const JointUpdate& update) {
    return member.try_apply(update).map([](std::size_t) {});
  };
  links.out = [&member] { return member.out(); };
  return links;
}

}  // namespace tfdude
