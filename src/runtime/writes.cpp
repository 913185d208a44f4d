#include "runtime/writes.hpp"

#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "base/mutex.hpp"
#include "calls/hand_over_task.hpp"
#include "calls/rewrite_task.hpp"
#include "partition/routing.hpp"

namespace tfdude {
namespace {

// A streamed value has no reply that says that its owner has changed.
constexpr Milliseconds kMaxAge{1000};

// What must be asked for; nothing if all frames are kept here.
template <class Edge>
std::vector<std::string> ids_of(const std::vector<Edge>& edges, const Requests& requests) {
  if (requests.on_demand() == nullptr) return {};
  std::vector<std::string> ids;
  ids.reserve(edges.size());
  for (const Edge& edge : edges) ids.push_back(edge.id);
  return ids;
}

void warn_of_missing(Structure& structure, const std::string& removed) {
  const Lock lock(structure.mutex);
  const std::string* partition = structure.directory.incomplete();
  if (partition == nullptr) return;
  log().warn("partition {} has not sent all of its frames: those below {} stay, without a parent",
             quote(*partition), quote(removed));
}

}  // namespace

Result<void> Writes::add(const std::string& id, const AddRequest& request,
                         const std::string& partition) {
  auto added = requests_.change(
      discovery_.call_deadline(), {request.parent, id}, [&](const Directory& directory) {
        return route_add(structure_.forest, directory, id, request, partition);
      });
  if (added) return added;
  return tl::unexpected(member_.unless_unsaved(std::move(added.error()), id));
}

Result<void> Writes::remove(const std::string& id) {
  if (auto ok = requests_.check_keeps_all("remove frame " + quote(id)); !ok) return ok;
  const Deadline deadline = discovery_.call_deadline();
  // All frames below it are removed by name. Those that a partition has announced and not sent
  // stay, like those of one that is lost.
  if (auto all = discovery_.await_known(deadline); !all) return all;
  bool asked = false;
  auto removed = requests_.change(deadline, {}, [&](const Directory& directory) {
    auto parts = route_remove(structure_.forest, directory, id);
    asked = asked || parts;
    return parts;
  });
  // Missing at a second attempt: the removal has succeeded.
  if (removed) {
    warn_of_missing(structure_, id);
    return removed;
  }
  const bool is_missing = is_elsewhere(removed.error());
  if (is_missing && asked && !structure_.forest.exists(id)) return {};
  return tl::unexpected(member_.unless_unsaved(std::move(removed.error()), id));
}

Result<void> Writes::move(const std::string& id, const MoveRequest& request) {
  return move(id, request, discovery_.call_deadline());
}

Result<void> Writes::move(const std::string& id, const MoveRequest& request,
                          const Deadline& deadline) {
  return requests_.change(deadline, {id, request.parent}, [&](const Directory& directory) {
    return route_move(structure_.forest, directory, id, request);
  });
}

Result<void> Writes::hand_over(const std::string& id, const std::string& partition,
                               const std::optional<std::string>& parent,
                               const PartialTransform& X_PC) {
  const Deadline deadline = discovery_.call_deadline();
  HandOverTask task(structure_.forest, id, partition, parent, X_PC, deadline.at());
  auto done = requests_.run(task, deadline);
  return done && task.had_it() && parent ? move(id, {*parent, X_PC}, deadline) : done;
}

template <class Edge>
Result<void> Writes::ask_to_update(const std::vector<Edge>& edges, std::optional<Time> stamp) {
  return requests_.change(discovery_.call_deadline(), ids_of(edges, requests_),
                          [&](const Directory& directory) {
                            return route_update(structure_.forest, directory, edges, stamp);
                          });
}

Result<void> Writes::update(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = structure_.forest.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  return ask_to_update(edges, stamp);
}

Result<void> Writes::update_partial(const std::vector<PartialUpdate>& edges,
                                    std::optional<Time> stamp) {
  return edges.empty() ? Result<void>() : ask_to_update(edges, stamp);
}

Result<void> Writes::publish(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = structure_.forest.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  const Deadline deadline = discovery_.call_deadline();
  auto parts =
      requests_.find(deadline, ids_of(edges, requests_), kMaxAge, [&](const Directory& directory) {
        return route_publish(structure_.forest, directory, edges, stamp);
      });
  if (!parts) return tl::unexpected(std::move(parts.error()));
  std::vector<Update> shares;
  for (Part& part : *parts) {
    shares.push_back({std::move(std::get<UpdateRequest>(part.request.body).edges), stamp});
  }
  const auto share_of = [&](std::size_t i) -> const Update& { return shares[i]; };
  return requests_.publish(*parts, deadline, share_of, [this](const Update& own) {
    return structure_.forest.update(own.edges, own.stamp);
  });
}

Result<void> Writes::rewrite(const std::string& id, const TimeInterval& interval,
                             const std::vector<EdgeSample>& samples) {
  auto rewritten = structure_.forest.rewrite(id, interval, samples);
  if (rewritten || !is_elsewhere(rewritten.error())) return rewritten;
  RewriteTask task(structure_.forest, id, rewrites_.fetch_add(1), interval, samples);
  return requests_.run(task, discovery_.call_deadline());
}

Result<void> Writes::correlate(const std::string& id, const Correlation& correlation) {
  return requests_.change(
      discovery_.call_deadline(), {id}, [&](const Directory& directory) -> Result<Part> {
        const auto frame = structure_.forest.info(id);
        if (!frame) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
        if (auto ok = check_common_errors(correlation.common_errors); !ok) {
          return fail_at("frame " + quote(id), ok.error());
        }
        return route_to(directory, frame->owner, Request{0, id, CorrelateRequest{correlation}});
      });
}

Result<void> Writes::forget(const std::string& partition) {
  const Deadline deadline = discovery_.call_deadline();
  // All reachable participants must be told.
  if (auto all = discovery_.await(deadline); !all) return all;
  auto told = requests_.tell(
      deadline, [&](const Directory& directory) { return route_forget(directory, partition); });
  return told ? member_.forget(partition) : told;
}

Result<std::vector<Part>> Writes::route_forget(const Directory& directory,
                                               const std::string& partition) {
  if (!directory.owner(partition)) return fail_without_partition(partition);
  if (auto ok = directory.check_not_there(partition); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  const ForgetRequest body{partition, directory.latest_incarnation(partition)};
  std::vector<Part> all;
  for (const Owner one : directory.reachable_owners()) {
    all.push_back({one, directory.name(one), Request{0, directory.name(one), body}});
  }
  if (member_.partition() != nullptr) {
    all.push_back({kHeldHere, member_.name(), Request{0, member_.name(), body}});
  }
  // A client cannot tell the partition itself, should it return.
  if (all.empty()) {
    return fail(Errc::kUnreachable, "no partition is reachable that could remember that " +
                                        quote(partition) + " is forgotten");
  }
  return all;
}

}  // namespace tfdude
