#include "simulation/streamer.hpp"

#include <utility>

namespace tfdude::simulation {
namespace {

constexpr Instant kEvery = milliseconds(50);
// So many samples in a row are not all lost once the faults are over.
constexpr std::size_t kRecent = 20;

template <class Message>
class Link final : public Channel<Message> {
 public:
  Link(Process& process, std::string to) : process_(process), to_(std::move(to)) {}
  std::optional<Errc> try_send(const Message& message) override {
    process_.stream(to_, message);
    return std::nullopt;
  }

 private:
  Process& process_;
  const std::string to_;
};

template <class Message, class RouteOf>
class Links final : public SenderLinks<Message> {
 public:
  /// @param route_of  of the edge or joint of this name
  Links(Process& process, RouteOf route_of) : process_(process), route_of_(std::move(route_of)) {}

  std::vector<Destinations> find(const std::vector<std::string>& names) override {
    std::vector<Destinations> found(names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Result<Directory::JointRoute> route = route_of_(names[i]);
      if (!route) {
        found[i].none = route.error().code;
        continue;
      }
      found[i].name = route->name;
      for (const Owner owner : route->owners) {
        const Directory& directory = process_.directory();
        found[i].to.push_back({owner, directory.name(owner), directory.reachable(owner)});
      }
    }
    return found;
  }
  std::unique_ptr<Channel<Message>> connect(const std::string& to) override {
    return std::make_unique<Link<Message>>(process_, to);
  }
  Result<void> apply_here(const Message&) override { return {}; }
  bool out() const override { return false; }

 private:
  Process& process_;
  const RouteOf route_of_;
};

template <class Message, class RouteOf>
std::shared_ptr<SenderLinks<Message>> links_of(Process& process, RouteOf route_of) {
  return std::make_shared<Links<Message, RouteOf>>(process, std::move(route_of));
}

}  // namespace

Streamer::Streamer(std::shared_ptr<Process> process) : process_(std::move(process)) {
  std::vector<std::string> edges;
  std::vector<std::string> joints;
  for (std::size_t i = 0; i < process_->world().plan.owners; ++i) {
    edges.push_back(extra_of(i));
    joints.push_back(spare_joint_of(i));
  }
  Process& own = *process_;
  edges_ = std::make_shared<Stream<Update>>(
      own, edges, links_of<Update>(own, [&own](const std::string& id) {
        const auto frame = own.forest().info(id);
        using Route = Directory::JointRoute;
        return frame ? Result<Route>(Route{id, {frame->owner}})
                     : Result<Route>(fail(Errc::kUnknownFrame, "no frame " + id));
      }));
  joints_ = std::make_shared<Stream<JointUpdate>>(
      own, joints, links_of<JointUpdate>(own, [&own](const std::string& name) {
        return own.directory().route_joint(name);
      }));
}

void Streamer::start() {
  edges_->start();
  joints_->start();
  next();
}

void Streamer::next() {
  const auto value = static_cast<double>(++sent_);
  const Transform X{Pose::trusted(Eigen::Quaterniond::Identity(), {0, 0, value}), {}};
  edges_not_sent_ = edges_->send([&](EdgeUpdate& edge, std::size_t) { edge.X_PC = X; });
  joints_not_sent_ = joints_->send([&](JointValue& joint, std::size_t) { joint.position = value; });
  process_->later("streamer", kEvery, [self = shared_from_this()] { self->next(); });
}

bool Streamer::is_recent(double value) const {
  const auto last = static_cast<double>(sent_);
  return value <= last && value >= last - static_cast<double>(kRecent);
}

void Streamer::check(const Cast& cast) {
  // The last one may be renamed, and others may still know the joints of its former name.
  for (std::size_t i = 0; i < cast.wild; ++i) {
    if (cast.standings[i] != Cast::Standing::kCore || !cast.daemons[i]) continue;
    check_edge(i, cast);
    check_joint(i, cast);
    process_->world().count("streams checked");
  }
}

void Streamer::check_edge(std::size_t owner, const Cast& cast) {
  const bool exists = cast.configured[owner].extra;
  const bool sent = edges_not_sent_.count(owner) == 0;
  const auto X_PC = cast.daemons[owner]->forest().value(extra_of(owner));
  if (sent != exists) {
    process_->world().violation("a stream has another plan",
                                extra_of(owner) + (sent ? " is sent" : " is not sent"));
  } else if (exists && !(X_PC && is_recent(X_PC->pose.translation().z()))) {
    process_->world().violation("a stream does not arrive", extra_of(owner));
  }
}

void Streamer::check_joint(std::size_t owner, const Cast& cast) {
  const bool exists = cast.configured[owner].spare == Configured::Spare::kMoved;
  const bool sent = joints_not_sent_.count(owner) == 0;
  const auto X_PC = cast.daemons[owner]->forest().value(spare_of(owner));
  if (sent != exists) {
    process_->world().violation("a stream has another plan",
                                spare_joint_of(owner) + (sent ? " is sent" : " is not sent"));
  } else if (exists && !(X_PC && is_recent(X_PC->pose.translation().z()))) {
    process_->world().violation("a stream does not arrive", spare_joint_of(owner));
  }
}

}  // namespace tfdude::simulation
