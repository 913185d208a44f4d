#include "partition/routing.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/stamp.hpp"
#include "math/finite.hpp"
#include "partition/joints.hpp"

namespace tfdude {
namespace {

tl::unexpected<Error> unknown_frame(std::string_view id) {
  return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
}

// Of one that was only heard of, it may not be known since when.
std::string not_reachable_since(const PartitionInfo& info) {
  if (info.since == Time{}) return " is not reachable";
  return " has not been reachable since " + to_string(info.since);
}

Result<void> check_reachable(const Directory& directory, Owner owner) {
  if (owner == kHeldHere || directory.reachable(owner)) return {};
  const PartitionInfo& info = directory.info(owner);
  const bool discovered = !info.host.empty();
  const std::string process =
      discovered ? " (host " + info.host + ", pid " + std::to_string(info.pid) + ")" : "";
  return fail_about_partition(
      Errc::kUnreachable,
      "partition " + quote(info.name) + process + not_reachable_since(info) +
          (discovered ? "" : ", before this process started") + ": it " + why_absent(info),
      info.name);
}

// The owner's part. If it does not exist yet, creates it with this id and an empty body of this
// kind.
template <class Body>
Body& body_for(std::vector<Part>& parts, const Directory& directory, Owner owner,
               const std::string& id) {
  const auto known = std::find_if(parts.begin(), parts.end(),
                                  [owner](const Part& part) { return part.owner == owner; });
  if (known != parts.end()) return std::get<Body>(known->request.body);
  parts.push_back({owner, directory.name(owner), Request{0, id, Body{}}});
  return std::get<Body>(parts.back().request.body);
}

Result<void> check_size(const Part& part, std::size_t items, const char* what) {
  if (part.owner == kHeldHere || items <= kMaxItems) return {};
  return fail(Errc::kInvalidInput, "partition " + quote(part.partition) + " is asked for " +
                                       std::to_string(items) + " " + what +
                                       " at once, of at most " + std::to_string(kMaxItems));
}

Result<WatchPlan> checked(const Directory& directory, WatchPlan plan) {
  if (auto ok = check_reachable(directory, plan.parts); !ok) return tl::unexpected(ok.error());
  for (const Part& part : plan.parts) {
    const std::size_t edges = std::get<WatchRequest>(part.request.body).segments.size();
    if (auto ok = check_size(part, edges, "edges"); !ok) return tl::unexpected(ok.error());
  }
  return plan;
}

// The end of the segment that its owner owns: for a segment that goes up, the lower one.
const std::string& owned_end(const Forest& forest, const Segment& segment) {
  const auto from = forest.info(segment.from);
  return from && from->owner == segment.owner ? segment.from : segment.to;
}

// An owner that moved a frame away, and becomes unreachable before all know of the move, would
// otherwise lose what is below the frame.
Result<void> check_subtree(const Directory& directory, const std::vector<FrameInfo>& frames,
                           const std::string& top) {
  for (const FrameInfo& frame : frames) {
    if (frame.owner == kHeldHere || !directory.owes_change(frame.owner)) continue;
    auto ok = check_reachable(directory, frame.owner);
    if (ok) {
      ok =
          fail(Errc::kTimeout, "partition " + quote(directory.name(frame.owner)) + " is reachable");
    }
    ok.error().message += ", but its last change has not arrived here: which frames are below " +
                          quote(top) + " is not certain";
    return ok;
  }
  return {};
}

}  // namespace

Result<void> check_reachable(const Directory& directory, const std::vector<Part>& parts) {
  for (const Part& part : parts) {
    if (auto ok = check_reachable(directory, part.owner); !ok) return ok;
  }
  return {};
}

Result<Part> route_to(const Directory& directory, Owner owner, Request request) {
  if (auto ok = check_reachable(directory, owner); !ok) return tl::unexpected(ok.error());
  return Part{owner, directory.name(owner), std::move(request)};
}

tl::unexpected<Error> fail_without_partition(const std::string& name) {
  return fail_about_partition(Errc::kUnknownPartition, "no partition " + quote(name), name);
}

Result<Part> route_to_partition(const Directory& directory, Request request) {
  const auto owner = directory.owner(request.id);
  if (!owner) return fail_without_partition(request.id);
  return route_to(directory, *owner, std::move(request));
}

Result<Part> route_add(const Forest& forest, const Directory& directory, const std::string& id,
                       const AddRequest& request, const std::string& partition) {
  if (auto ok = check_new_id(id, "id"); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_value(id, request.X_PC); !ok) return tl::unexpected(ok.error());
  if (forest.exists(id))
    return fail(Errc::kAlreadyExists, "frame " + quote(id) + " exists already");
  const auto parent = forest.info(request.parent);
  if (!request.parent.empty() && !parent) {
    return fail(Errc::kUnknownParent,
                "no frame " + quote(request.parent) + " to be the parent of " + quote(id));
  }
  Owner owner = parent ? parent->owner : kHeldHere;
  if (!partition.empty()) {
    const auto named = directory.owner(partition);
    if (!named) return fail_without_partition(partition);
    owner = *named;
  } else if (request.parent.empty() && directory.name(kHeldHere).empty()) {
    return fail(Errc::kInvalidInput,
                "frame " + quote(id) + " needs a parent or a partition to belong to");
  }
  if (auto ok = check_reachable(directory, owner); !ok) return tl::unexpected(ok.error());
  AddRequest body = request;
  body.lamport_time = directory.latest_lamport_time();
  return Part{owner, directory.name(owner), Request{0, id, std::move(body)}};
}

Result<std::vector<Part>> route_remove(const Forest& forest, const Directory& directory,
                                       const std::string& id) {
  const auto frames = forest.subtree(id);
  if (frames.empty()) return unknown_frame(id);
  if (auto ok = check_subtree(directory, frames, id); !ok) return tl::unexpected(ok.error());
  std::vector<Part> parts;
  for (const FrameInfo& frame : frames) {
    const auto parent = forest.info(frame.parent);
    const bool top = frame.id == id || !parent || parent->owner != frame.owner;
    if (!top) continue;
    auto& body = body_for<RemoveRequest>(parts, directory, frame.owner, frame.id);
    body.tops.push_back(frame.id);
    body.lamport_time = directory.latest_lamport_time();
  }
  if (auto ok = check_reachable(directory, parts.front().owner); !ok)
    return tl::unexpected(ok.error());
  // Partitions that cannot be told now learn of it when they return, from a tombstone of the first
  // part's owner.
  parts.erase(std::remove_if(parts.begin(), parts.end(),
                             [&](const Part& part) {
                               return part.owner != kHeldHere && !directory.reachable(part.owner);
                             }),
              parts.end());
  for (const Part& part : parts) {
    const auto& tops = std::get<RemoveRequest>(part.request.body).tops;
    if (auto ok = check_size(part, tops.size(), "subtrees"); !ok) return tl::unexpected(ok.error());
  }
  return parts;
}

namespace {

// `check` examines each edge, before anything is sent.
template <class Body, class Edge, class Check>
Result<std::vector<Part>> route_edges(const Forest& forest, const Directory& directory,
                                      const std::vector<Edge>& edges, std::optional<Time> stamp,
                                      Check check) {
  if (auto ok = check_stamp(stamp); !ok) return tl::unexpected(std::move(ok.error()));
  std::vector<Part> parts;
  for (const Edge& edge : edges) {
    const auto frame = forest.info(edge.id);
    if (!frame) return unknown_frame(edge.id);
    if (Result<void> ok = check(edge); !ok) return tl::unexpected(ok.error());
    auto& body = body_for<Body>(parts, directory, frame->owner, edge.id);
    body.edges.push_back(edge);
    body.stamp = stamp;
  }
  for (const Part& part : parts) {
    const auto& share = std::get<Body>(part.request.body).edges;
    if (auto ok = check_size(part, share.size(), "edges"); !ok) return tl::unexpected(ok.error());
  }
  return parts;
}

Result<std::vector<Part>> all_reachable(const Directory& directory,
                                        Result<std::vector<Part>> parts) {
  if (!parts) return parts;
  if (auto ok = check_reachable(directory, *parts); !ok) return tl::unexpected(ok.error());
  return parts;
}

}  // namespace

Result<std::vector<Part>> route_update(const Forest& forest, const Directory& directory,
                                       const std::vector<EdgeUpdate>& edges,
                                       std::optional<Time> stamp) {
  return all_reachable(directory, route_publish(forest, directory, edges, stamp));
}

Result<std::vector<Part>> route_update(const Forest& forest, const Directory& directory,
                                       const std::vector<PartialUpdate>& edges,
                                       std::optional<Time> stamp) {
  return all_reachable(
      directory, route_edges<PartialUpdateRequest>(forest, directory, edges, stamp, check_parts));
}

Result<std::vector<Part>> route_publish(const Forest& forest, const Directory& directory,
                                        const std::vector<EdgeUpdate>& edges,
                                        std::optional<Time> stamp) {
  return route_edges<UpdateRequest>(forest, directory, edges, stamp, [](const EdgeUpdate& edge) {
    return check_value(edge.id, edge.X_PC);
  });
}

Result<std::vector<Part>> route_joints(const Directory& directory, const JointUpdate& update) {
  if (auto ok = check_stamp(update.stamp); !ok) return tl::unexpected(std::move(ok.error()));
  std::vector<Part> parts;
  for (const JointValue& joint : update.joints) {
    const auto route = directory.route_joint(joint.name);
    if (!route) return tl::unexpected(route.error());
    if (auto ok = check_value(joint); !ok) return tl::unexpected(ok.error());
    for (const Owner owner : route->owners) {
      auto& body = body_for<JointUpdate>(parts, directory, owner, directory.name(owner));
      body.joints.push_back({route->name, joint.position, joint.variance});
      body.stamp = update.stamp;
    }
  }
  for (const Part& part : parts) {
    const auto& share = std::get<JointUpdate>(part.request.body).joints;
    if (auto ok = check_size(part, share.size(), "joints"); !ok) return tl::unexpected(ok.error());
  }
  return parts;
}

Result<Part> route_move(const Forest& forest, const Directory& directory, const std::string& id,
                        const MoveRequest& request) {
  const auto frame = forest.info(id);
  if (!frame) return unknown_frame(id);
  if (auto ok = check_parts({id, request.X_PC}); !ok) {
    return tl::unexpected(ok.error());
  }
  if (id == request.parent) {
    return fail(Errc::kCycle, "frame " + quote(id) + " cannot be its own parent");
  }
  if (!request.parent.empty() && !forest.exists(request.parent)) {
    return fail(Errc::kUnknownParent,
                "no frame " + quote(request.parent) + " to be the parent of " + quote(id));
  }
  for (auto above = forest.info(request.parent); above; above = forest.info(above->parent)) {
    if (above->id == id) {
      return fail(Errc::kCycle, "frame " + quote(id) + " cannot be moved under " +
                                    quote(request.parent) + ", which lies below it");
    }
  }
  if (auto ok = check_reachable(directory, frame->owner); !ok) return tl::unexpected(ok.error());
  MoveRequest body = request;
  body.lamport_time = directory.latest_lamport_time();
  return Part{frame->owner, directory.name(frame->owner), Request{0, id, std::move(body)}};
}

Result<LookupPlan> route_lookup(const Forest& forest, const Directory& directory,
                                const std::string& a, const std::string& b, const Query& query,
                                std::optional<Time> hint) {
  auto segments = forest.segments(a, b);
  if (!segments) return tl::unexpected(segments.error());
  LookupPlan plan{*std::move(segments), {}, query.at && *query.at < Time{}};
  plan.parts.reserve(plan.segments.size());
  for (const Segment& segment : plan.segments) {
    auto& body =
        body_for<LookupRequest>(plan.parts, directory, segment.owner, owned_end(forest, segment));
    body.segments.push_back({segment.from, segment.to});
    body.query = query;
    if (plan.before_all) body.query.at = Time{};
    body.hint = hint;
  }
  if (auto ok = check_reachable(directory, plan.parts); !ok) return tl::unexpected(ok.error());
  for (const Part& part : plan.parts) {
    const auto& share = std::get<LookupRequest>(part.request.body).segments;
    if (auto ok = check_size(part, share.size(), "segments"); !ok)
      return tl::unexpected(ok.error());
  }
  return plan;
}

Result<WatchPlan> route_watch(const Forest& forest, const Directory& directory,
                              const std::string& a, const std::string& b, bool composed,
                              std::chrono::nanoseconds period) {
  WatchPlan plan;
  const auto body_of = [&](Owner owner, const std::string& id) -> WatchRequest& {
    auto& body = body_for<WatchRequest>(plan.parts, directory, owner, id);
    body.period = period;
    body.composed = composed;
    body.of_samples = !composed;
    return body;
  };
  if (composed) {
    const auto segments = forest.segments(a, b);
    if (!segments) return tl::unexpected(segments.error());
    for (const Segment& segment : *segments) {
      body_of(segment.owner, owned_end(forest, segment))
          .segments.push_back({segment.from, segment.to});
      plan.edges.push_back({segment.to, segment.from, segment.owner, true, 0});
    }
  } else {
    auto edges = forest.edges(a, b);
    if (!edges) return tl::unexpected(std::move(edges.error()));
    for (const FrameInfo& edge : *edges) {
      body_of(edge.owner, edge.id).segments.push_back({edge.parent, edge.id});
    }
    plan.edges = *std::move(edges);
  }
  return checked(directory, std::move(plan));
}

Result<WatchPlan> route_watch_edges(const Forest& forest, const Directory& directory,
                                    const std::vector<std::string>& ids,
                                    std::chrono::nanoseconds period) {
  WatchPlan plan;
  for (const std::string& id : ids) {
    auto edge = forest.info(id);
    if (!edge) return unknown_frame(id);
    if (edge->parent.empty()) {
      return fail(Errc::kInvalidInput, "frame " + quote(id) + " is a root: it has no edge");
    }
    auto& body = body_for<WatchRequest>(plan.parts, directory, edge->owner, id);
    body.period = period;
    body.segments.push_back({edge->parent, id});
    plan.edges.push_back(*std::move(edge));
  }
  return checked(directory, std::move(plan));
}

}  // namespace tfdude
