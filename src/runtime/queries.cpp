#include "runtime/queries.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/mutex.hpp"
#include "runtime/wall_clock.hpp"

namespace tfdude {
namespace {

// Sorted, as the frames are.
template <class Condition>
std::vector<std::string> ids_of(const std::vector<Frame>& frames, Condition condition) {
  std::vector<std::string> ids;
  for (const Frame& frame : frames) {
    if (condition(frame)) ids.push_back(frame.id);
  }
  return ids;
}

}  // namespace

Result<std::vector<PathSegment>> Queries::path(std::string_view a, std::string_view b,
                                               const Deadline& deadline) {
  const auto route = [&](const Directory& directory) -> Result<std::vector<PathSegment>> {
    auto segments = structure_.forest.segments(a, b);
    if (!segments) return tl::unexpected(std::move(segments.error()));
    std::vector<PathSegment> path;
    for (Segment& segment : *segments) {
      path.push_back({directory.name(segment.owner), std::move(segment.from), std::move(segment.to),
                      segment.owner == kHeldHere ? std::optional<ClockKind>(structure_.clock.kind())
                                                 : directory.info(segment.owner).clock});
    }
    return path;
  };
  return requests_.find(deadline, {std::string(a), std::string(b)}, Task::kFresh, route);
}

Result<Handle> Queries::find(std::string_view id) {
  const auto find = [&](const Directory&) -> Result<Handle> {
    const auto handle = structure_.forest.find(id);
    if (!handle) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
    return *handle;
  };
  return requests_.find(discovery_.call_deadline(), {std::string(id)}, Task::kFresh, find);
}

Result<FrameInfo> Queries::info(const std::string& id, const Deadline& deadline) {
  const auto find = [&](const Directory&) -> Result<FrameInfo> {
    auto info = structure_.forest.info(id);
    if (!info) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
    return *std::move(info);
  };
  auto info = requests_.find(deadline, {id}, Task::kFresh, find);
  if (info || info.error().code != Errc::kUnknownFrame || requests_.on_demand() != nullptr) {
    return info;
  }
  for (KnownFrame& frame : frames_before({{id}}, deadline)) {
    if (frame.id != id) continue;
    const Lock lock(structure_.mutex);
    const auto owner = structure_.directory.owner(frame.partition);
    if (owner) return FrameInfo{std::move(frame.id), std::move(frame.parent), *owner, true};
  }
  return info;
}

// Each is listed after its parent.
Result<std::vector<Frame>> Queries::followed(const Deadline& deadline) {
  auto known = requests_.on_demand()->followed(deadline);
  if (!known) return tl::unexpected(std::move(known.error()));
  std::set<std::string> there;
  std::vector<Frame> frames;
  for (KnownFrame& frame : *known) {
    const bool attached = there.count(frame.parent) != 0;
    there.insert(frame.id);
    frames.push_back(
        {std::move(frame.id), std::move(frame.parent), std::move(frame.partition), attached});
  }
  std::sort(frames.begin(), frames.end(),
            [](const Frame& a, const Frame& b) { return a.id < b.id; });
  return frames;
}

bool Queries::knows_all() {
  const Lock lock(structure_.mutex);
  return !structure_.directory.only_heard_of();
}

std::vector<KnownFrame> Queries::frames_before(const FramesRequest& wanted,
                                               const Deadline& deadline) {
  if (knows_all()) return {};
  std::vector<Part> owners;
  {
    const Lock lock(structure_.mutex);
    for (const Owner owner : structure_.directory.reachable_owners()) {
      const std::string& name = structure_.directory.name(owner);
      owners.push_back({owner, name, Request{0, name, wanted}});
    }
  }
  // Those that have started since do not know them.
  std::vector<KnownFrame> all;
  for (Reply& reply : requests_.ask(owners, deadline)) {
    auto* known = std::get_if<std::vector<KnownFrame>>(&reply.body);
    if (known != nullptr) merge(all, std::move(*known));
  }
  return all;
}

Result<std::vector<Frame>> Queries::frames(const Deadline& deadline) {
  if (requests_.on_demand() != nullptr) return followed(deadline);
  if (auto all = discovery_.await_known(deadline); !all)
    return tl::unexpected(std::move(all.error()));
  std::vector<KnownFrame> before = frames_before({{}, {std::string(1, kAnyName)}}, deadline);
  std::vector<FrameInfo> infos = structure_.forest.frames();
  std::vector<Frame> frames;
  frames.reserve(infos.size());
  std::set<std::string> lost;
  const Lock lock(structure_.mutex);
  for (KnownFrame& frame : before) {
    const auto owner = structure_.directory.owner(frame.partition);
    const bool there = !owner || structure_.directory.reachable(*owner);
    if (there || structure_.forest.exists(frame.id)) continue;
    lost.insert(frame.id);
    frames.push_back({std::move(frame.id), std::move(frame.parent), std::move(frame.partition)});
  }
  for (Frame& frame : frames) {
    frame.attached = structure_.forest.exists(frame.parent) || lost.count(frame.parent) != 0;
  }
  for (FrameInfo& info : infos) {
    const bool attached = info.attached || lost.count(info.parent) != 0;
    frames.push_back({std::move(info.id), std::move(info.parent),
                      structure_.directory.name(info.owner), attached});
  }
  std::sort(frames.begin(), frames.end(),
            [](const Frame& a, const Frame& b) { return a.id < b.id; });
  return frames;
}

bool Queries::others_know_missed(const std::vector<Frame>& all) {
  const Lock lock(structure_.mutex);
  const auto missed = structure_.directory.only_heard_of();
  return !missed || std::any_of(all.begin(), all.end(), [&](const Frame& frame) {
    return frame.partition == missed->name;
  });
}

Result<std::vector<std::string>> Queries::children(std::string_view id) {
  if (auto ok = requests_.check_keeps_all("list children of frame " + quote(id)); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  const Deadline deadline = discovery_.call_deadline();
  if (auto known = discovery_.await_known(deadline); !known) {
    return tl::unexpected(std::move(known.error()));
  }
  bool is_certain = true;
  if (!knows_all()) {
    auto all = frames(deadline);
    if (!all) return tl::unexpected(std::move(all.error()));
    const auto is_it = [&](const Frame& frame) { return frame.id == id; };
    if (std::any_of(all->begin(), all->end(), is_it)) {
      return ids_of(*all, [&](const Frame& frame) { return frame.attached && frame.parent == id; });
    }
    is_certain = others_know_missed(*all);
  }
  // The frame may be one of those that have not come yet.
  if (!structure_.forest.exists(id)) {
    if (auto all = discovery_.await(deadline); !all) return tl::unexpected(std::move(all.error()));
  }
  auto found = structure_.forest.children(id);
  if (found || is_certain || !may_appear(found.error().code)) return found;
  return tl::unexpected(discovery_.explained(std::move(found.error())));
}

Result<std::vector<std::string>> Queries::roots() {
  if (auto ok = requests_.check_keeps_all("list roots"); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  const Deadline deadline = discovery_.call_deadline();
  if (auto known = discovery_.await_known(deadline); !known) {
    return tl::unexpected(std::move(known.error()));
  }
  if (knows_all()) return structure_.forest.roots();
  auto all = frames(deadline);
  if (!all) return tl::unexpected(std::move(all.error()));
  return ids_of(*all, [](const Frame& frame) { return !frame.attached; });
}

Result<std::vector<PartitionInfo>> Queries::partitions() {
  if (auto known = discovery_.await_known(discovery_.call_deadline()); !known) {
    return tl::unexpected(std::move(known.error()));
  }
  auto partitions = member_.with_rules([](const Member& member) { return member.partitions(); });
  for (IncompatiblePeer& peer : transport_.incompatible()) {
    PartitionInfo info;
    info.name = std::move(peer.partition);
    info.since = peer.since;
    info.program = std::move(peer.program);
    info.protocol = peer.protocol;
    partitions.push_back(std::move(info));
  }
  return partitions;
}

std::size_t Queries::own_frames() {
  return member_.with_rules([](Member& member) {
    return member.partition() != nullptr ? member.partition()->frame_count() : 0;
  });
}

Result<std::vector<HistoryInfo>> Queries::history(const std::string& id) {
  auto asked = requests_.ask_one<std::vector<HistoryInfo>>(
      discovery_.call_deadline(), {id}, [&](const Directory& directory) -> Result<Part> {
        const auto info = structure_.forest.info(id);
        if (!info) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
        return route_to(directory, info->owner, Request{0, id, HistoryRequest{}});
      });
  if (!asked) return tl::unexpected(std::move(asked.error()));
  return std::move(*asked).value_or(std::vector<HistoryInfo>());
}

Result<std::vector<HistoryInfo>> Queries::histories(const std::string& partition) {
  return requests_.ask_all<HistoryInfo>(partition, HistoryRequest{true},
                                        discovery_.call_deadline());
}

// The owner's clock is read once between the request and the reply. So its difference is known to
// within half of the round trip, and best by the fastest one.
Result<ClockDifference> Queries::clock_difference(const std::string& partition,
                                                  const Deadline& deadline, int round_trips) {
  std::optional<ClockDifference> best;
  for (int i = 0; i < round_trips; ++i) {
    // The part of a description after its end: nothing.
    constexpr std::uint64_t kEnd = UINT64_MAX;
    auto part = requests_.find(deadline, [&](const Directory& directory) {
      return route_to_partition(directory, Request{0, partition, DescriptionRequest{kEnd}});
    });
    if (!part) return tl::unexpected(std::move(part.error()));
    std::vector<Part> parts{*std::move(part)};
    const Time begin = wall_clock();
    Reply reply = std::move(requests_.ask(parts, deadline).front());
    const Time end = wall_clock();
    const auto* error = std::get_if<Error>(&reply.body);
    if (!reply.sent && error != nullptr) return tl::unexpected(*error);
    if (!reply.sent) {
      return fail(Errc::kUnsupported, "the clock of partition " + quote(partition) +
                                          " is not told: it is of this process, or its transport "
                                          "has no stamps");
    }
    const auto half = (end - begin) / 2;
    if (!best || half < best->error) best = {*reply.sent - (begin + half), half};
  }
  return *best;
}

}  // namespace tfdude
