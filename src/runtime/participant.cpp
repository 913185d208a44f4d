#include "runtime/participant.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"

namespace tfdude {
Participant::Participant(TransportPtr transport, std::string partition, const Options& options)
    : options_(options),
      partition_name_(std::move(partition)),
      structure_(wall_clock, partition_name_),
      member_(structure_.forest, structure_.directory, partition_name_),
      transport_(std::move(transport)),
      discovery_(structure_, *transport_, options.discovery, options.timeout),
      requests_(structure_, discovery_, *transport_, links_of_requests()),
      lookups_(structure_.forest, requests_.calls(), hints_, links_of_lookups()),
      streams_(links_of_edge_streams(), links_of_joint_streams()) {}

Requests::Own Participant::links_of_requests() {
  return {[this](const Request& request) { return answer_here(request); },
          [this](const Deadline& deadline) {
            if (commits_ && commits_->pending()) (void)commits_->flush(deadline.at());
          },
          [this](const Request& request, const Deadline& deadline) {
            return await_stored(request, deadline);
          },
          [this] { return still_in(); }};
}

Participant::~Participant() {
  // Callbacks may use all of the rest.
  lookups_.stop();
  events_->stop();
  streams_.stop();
  {
    const std::lock_guard lock(pushing_mutex_);
    leaving_ = true;
  }
  // Both are used by the transport's threads until that has stopped.
  if (watches_ != nullptr) watches_->stop();
  if (pusher_ != nullptr) pusher_->stop();
  if (gone_look_) gone_look_->stop();
  if (conceder_) conceder_->stop();
  if (commits_) commits_->stop();
  if (auto flushed = flush(std::min(options_.linger, options_.timeout)); !flushed) {
    log().warn("leaving: {}", flushed.error().message);
  }
  say_goodbye();
  transport_->stop();
}

Time Participant::wall_clock() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

Result<void> Participant::still_in() {
  if (!out_.load(std::memory_order_relaxed)) return {};
  const std::lock_guard lock(structure_.mutex);
  return fail(Errc::kPartitionTaken, member_.given_up());
}

Result<void> Participant::start() { return transport_->start(*this); }

Result<void> Participant::add(const std::string& id, const AddRequest& request,
                              const std::string& partition) {
  const Deadline deadline = call_deadline();
  auto added = requests_.retry_on_stale_route(
      deadline,
      [&] { return route_add(structure_.forest, structure_.directory, id, request, partition); },
      [&](Part& part) {
        std::vector<Part> parts{std::move(part)};
        return requests_.change(parts, deadline);
      });
  if (added) return added;
  return tl::unexpected(unless_unsaved(std::move(added.error()), id));
}

Result<void> Participant::remove(const std::string& id) {
  const Deadline deadline = call_deadline();
  // All below it are told by name, so all must be known.
  if (auto all = await_discovery(deadline); !all) return all;
  bool asked = false;
  auto removed = requests_.retry_on_stale_route(
      deadline, [&] { return route_remove(structure_.forest, structure_.directory, id); },
      [&](std::vector<Part>& parts) {
        asked = true;
        return requests_.change(parts, deadline);
      });
  // Gone by the time of a second attempt: what was asked for has come to be.
  if (removed) return removed;
  const bool is_missing = is_elsewhere(removed.error());
  if (is_missing && asked && !structure_.forest.exists(id)) return {};
  return tl::unexpected(unless_unsaved(std::move(removed.error()), id));
}

Result<void> Participant::move(const std::string& id, const MoveRequest& request) {
  const Deadline deadline = call_deadline();
  return requests_.retry_on_stale_route(
      deadline, [&] { return route_move(structure_.forest, structure_.directory, id, request); },
      [&](Part& part) {
        std::vector<Part> parts{std::move(part)};
        return requests_.change(parts, deadline);
      });
}

Result<void> Participant::update(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = structure_.forest.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  const Deadline deadline = call_deadline();
  return requests_.retry_on_stale_route(
      deadline, [&] { return route_update(structure_.forest, structure_.directory, edges, stamp); },
      [&](std::vector<Part>& parts) { return requests_.change(parts, deadline); });
}

Result<void> Participant::update_partial(const std::vector<PartialUpdate>& edges,
                                         std::optional<Time> stamp) {
  if (edges.empty()) return {};
  const Deadline deadline = call_deadline();
  return requests_.retry_on_stale_route(
      deadline, [&] { return route_update(structure_.forest, structure_.directory, edges, stamp); },
      [&](std::vector<Part>& parts) { return requests_.change(parts, deadline); });
}

Result<void> Participant::publish(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = structure_.forest.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  const Deadline deadline = call_deadline();
  auto parts = requests_.planned(deadline, [&] {
    return route_publish(structure_.forest, structure_.directory, edges, stamp);
  });
  if (!parts) return tl::unexpected(std::move(parts.error()));
  Result<void> outcome;
  for (Part& part : *parts) {
    const Update share{std::move(std::get<UpdateRequest>(part.request.body).edges), stamp};
    auto sent = publish_to(part, share, deadline);
    if (!sent && outcome) outcome = std::move(sent);
  }
  return outcome;
}

// Whoever is there gets its share, and the error of who is not is told.
Result<void> Participant::publish_to(const Part& part, const Update& share,
                                     const Deadline& deadline) {
  if (part.owner == kHeldHere) return structure_.forest.update(share.edges, share.stamp);
  {
    const std::lock_guard lock(structure_.mutex);
    if (auto ok = check_reachable(structure_.directory, {part}); !ok) return ok;
  }
  return transport_->send(part.partition, share, deadline.at());
}

Result<void> Participant::flush(Milliseconds wait) {
  return transport_->flush(Deadline(wait).at());
}

Result<std::vector<PathSegment>> Participant::path(std::string_view a, std::string_view b) {
  return requests_.planned(call_deadline(), [&]() -> Result<std::vector<PathSegment>> {
    auto segments = structure_.forest.segments(a, b);
    if (!segments) return tl::unexpected(std::move(segments.error()));
    std::vector<PathSegment> path;
    for (Segment& segment : *segments) {
      path.push_back({structure_.directory.name(segment.owner), std::move(segment.from),
                      std::move(segment.to)});
    }
    return path;
  });
}

Result<FrameInfo> Participant::info(const std::string& id, const Deadline& deadline) {
  return requests_.after_discovery(deadline, [&]() -> Result<FrameInfo> {
    auto info = structure_.forest.info(id);
    if (!info) return fail(Errc::kUnknownFrame, "no frame " + quote(id));
    return *std::move(info);
  });
}

Result<Handle> Participant::find(std::string_view id) {
  return requests_.after_discovery(call_deadline(), [&]() -> Result<Handle> {
    const auto handle = structure_.forest.find(id);
    if (!handle) return fail(Errc::kUnknownFrame, "no frame " + quote(id));
    return *handle;
  });
}

Result<std::vector<Frame>> Participant::frames() {
  if (auto all = await_discovery(call_deadline()); !all)
    return tl::unexpected(std::move(all.error()));
  std::vector<FrameInfo> infos = structure_.forest.frames();
  std::vector<Frame> frames;
  frames.reserve(infos.size());
  const std::lock_guard lock(structure_.mutex);
  for (FrameInfo& info : infos) {
    frames.push_back({std::move(info.id), std::move(info.parent),
                      structure_.directory.name(info.owner), info.attached});
  }
  std::sort(frames.begin(), frames.end(),
            [](const Frame& a, const Frame& b) { return a.id < b.id; });
  return frames;
}

std::size_t Participant::own_frames() {
  const std::lock_guard lock(structure_.mutex);
  return partition_ != nullptr ? partition_->frame_count() : 0;
}

Result<std::vector<PartitionInfo>> Participant::partitions() {
  if (auto all = await_discovery(call_deadline()); !all)
    return tl::unexpected(std::move(all.error()));
  const std::lock_guard lock(structure_.mutex);
  auto all = structure_.directory.partitions();
  if (partition_ == nullptr) return all;
  for (PartitionInfo& info : all) {
    if (info.name != partition_->name()) continue;
    info.host = member_.presence().host;
    info.pid = member_.presence().pid;
    info.frames = partition_->frame_count();
  }
  return all;
}

}  // namespace tfdude
