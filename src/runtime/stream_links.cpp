#include "runtime/stream_links.hpp"

#include "base/mutex.hpp"
#include "runtime/member_runner.hpp"

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

class EdgeLinks final : public SenderLinks<Update> {
 public:
  explicit EdgeLinks(const Context& context) : context_(context) {}

  std::vector<Destinations> find(const std::vector<std::string>& ids) override {
    const auto route_of = [&](const Directory&, const std::string& id) -> Result<Route> {
      const auto frame = context_.structure.forest.info(id);
      if (!frame) return fail(Errc::kUnknownFrame, "no frame");
      return Route{id, {frame->owner}};
    };
    return destinations(context_.structure, ids, route_of);
  }
  std::unique_ptr<Channel<Update>> connect(const std::string& partition) override {
    return context_.transport.update_channel(partition);
  }
  Result<void> apply_here(const Update& update) override {
    return context_.structure.forest.update(update.edges, update.stamp);
  }
  [[nodiscard]] bool out() const override { return context_.member.out(); }

 private:
  const Context context_;
};

class JointLinks final : public SenderLinks<JointUpdate> {
 public:
  explicit JointLinks(const Context& context) : context_(context) {}

  std::vector<Destinations> find(const std::vector<std::string>& names) override {
    const auto route_of = [](const Directory& directory, const std::string& name) {
      return directory.route_joint(name);
    };
    return destinations(context_.structure, names, route_of);
  }
  std::unique_ptr<Channel<JointUpdate>> connect(const std::string& partition) override {
    return context_.transport.joint_channel(partition);
  }
  Result<void> apply_here(const JointUpdate& update) override {
    return context_.member.try_apply(update).map([](std::size_t) {});
  }
  [[nodiscard]] bool out() const override { return context_.member.out(); }

 private:
  const Context context_;
};

}  // namespace

std::shared_ptr<SenderLinks<Update>> edge_links(const Context& context) {
  return std::make_shared<EdgeLinks>(context);
}

std::shared_ptr<SenderLinks<JointUpdate>> joint_links(const Context& context) {
  return std::make_shared<JointLinks>(context);
}

}  // namespace tfdude
