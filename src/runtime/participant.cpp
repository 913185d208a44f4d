#include "runtime/participant.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"

namespace tfdude {
namespace {

// How long the structure may take to reach us where a reply says that ours is old.
constexpr Milliseconds kStructureDelay{100};

// How often a new participant asks itself whether it has met everybody.
constexpr Milliseconds kLookAround{2};

}  // namespace

Participant::Participant(TransportPtr transport, std::string partition, const Options& options)
    : options_(options),
      partition_name_(std::move(partition)),
      forest_(wall_clock),
      directory_(forest_, partition_name_),
      lookups_(forest_, calls_, hints_, links_of_lookups()),
      streams_(links_of_edge_streams(), links_of_joint_streams()),
      discovery_deadline_(Deadline(options.discovery).at()),
      discovery_end_(Deadline::sum(
          discovery_deadline_,
          Deadline::sum(options.timeout, Deadline::sum(options.timeout, options.timeout)))),
      transport_(std::move(transport)) {}

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
  const std::lock_guard lock(structure_mutex_);
  return fail(Errc::kPartitionTaken, given_up_);
}

Result<void> Participant::start() { return transport_->start(*this); }

bool Participant::may_appear(Errc code) {
  switch (code) {
    case Errc::kUnknownFrame:
    case Errc::kUnknownStart:
    case Errc::kUnknownEnd:
    case Errc::kUnknownParent:
    case Errc::kUnknownPartition:
    case Errc::kUnknownJoint:
    case Errc::kNotConnected:
      return true;
    default:
      return false;
  }
}

Error Participant::explained(Error error) {
  const std::lock_guard lock(structure_mutex_);
  const auto missed = directory_.only_heard_of();
  if (!missed || error.code == Errc::kUnknownPartition) return error;
  return {Errc::kUnreachable, error.message + ", unless it is of partition " + quote(missed->name) +
                                  ", which is not reachable since " + to_string(missed->since) +
                                  ", before this process came: it " + why_absent(*missed)};
}

// What a plan has checked before anybody was asked.
bool Participant::denies_plan(Errc code) {
  return code == Errc::kAlreadyExists || code == Errc::kUnknownParent || code == Errc::kCycle;
}

bool Participant::discovered() {
  if (discovered_.load(std::memory_order_relaxed)) return true;
  const auto now = Clock::now();
  bool known = now >= discovery_end_;
  if (!known) {
    const bool met_all = transport_->discovered();
    const bool met_none = now >= discovery_deadline_ && !transport_->awaits_presence();
    const std::lock_guard lock(structure_mutex_);
    known = met_all ? directory_.complete() : met_none && directory_.reachable_owners().empty();
  }
  if (known) discovered_.store(true, std::memory_order_relaxed);
  return known;
}

Deadline Participant::call_deadline() const {
  const auto now = Clock::now();
  const auto meeting = discovered_.load(std::memory_order_relaxed)
                           ? Milliseconds(0)
                           : std::chrono::ceil<Milliseconds>(discovery_deadline_ - now);
  return Deadline(Deadline::sum(options_.timeout, std::max(meeting, Milliseconds(0))), now);
}

tl::unexpected<Error> Participant::undecided(const std::string& what, const Deadline& deadline) {
  std::string missing = "nobody was met yet";
  {
    const std::lock_guard lock(structure_mutex_);
    if (const std::string* partition = directory_.incomplete()) {
      missing = "partition " + quote(*partition) + " has not told all of its frames yet";
    } else if (transport_->awaits_presence()) {
      missing = "somebody was met who has not told yet what it owns";
    } else if (!directory_.reachable_owners().empty()) {
      missing = "there may be others who were not met yet";
    }
  }
  return fail(Errc::kTimeout,
              what + ", as far as is known after " + deadline.text() + ": " + missing);
}

void Participant::wait_for_news(const Deadline& deadline) {
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_until(lock, deadline.within(kLookAround).at());
}

Result<void> Participant::await_discovery(const Deadline& deadline) {
  while (!discovered()) {
    if (deadline.over()) return undecided("not all frames are known", deadline);
    wait_for_news(deadline);
  }
  return {};
}

void Participant::await_structure_change(std::uint64_t version, const Deadline& deadline) {
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_until(lock, deadline.within(kStructureDelay).at(),
                                [&] { return forest_.structure_version() != version; });
}

// So that whoever changed something finds it changed. Past the deadline the change is made all the same.
void Participant::await_epoch(const Part& part, std::uint64_t epoch, const Deadline& deadline) {
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_until(lock, deadline.at(), [&] {
    return directory_.epoch(part.owner) >= epoch || !directory_.reachable(part.owner);
  });
}

std::vector<Reply> Participant::ask(std::vector<Part>& parts, const Deadline& deadline) {
  // What this process has changed itself comes before what it asks for: others build on that.
  const bool builds = std::any_of(parts.begin(), parts.end(), [](const Part& part) {
    return part.owner != kHeldHere && !is_read_only(part.request);
  });
  if (builds && commits_ && commits_->pending()) (void)commits_->flush(deadline.at());
  for (const Part& part : parts) {
    if (part.owner != kHeldHere) transport_->prepare(part.partition);
  }
  const auto send = [&](const std::string& partition, const Request& request) {
    return transport_->send(partition, request, deadline.at());
  };
  Asking asking(calls_, parts);
  auto due = asking.send_due(Clock::now(), send);
  asking.answer([this](const Request& request) { return answer_here(request); });
  while (!asking.wait_until(std::min(due, deadline.at()))) {
    const auto now = Clock::now();
    if (deadline.over(now)) {
      asking.give_up(deadline);
      break;
    }
    due = asking.send_due(now, send);
  }
  return asking.take_replies();
}

Result<void> Participant::change(std::vector<Part>& parts, const Deadline& deadline) {
  if (parts.size() == 1 && parts[0].owner == kHeldHere)
    return change_here(parts[0].request, deadline);
  const std::vector<Reply> replies = ask(parts, deadline);
  Result<void> outcome;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (const auto* error = std::get_if<Error>(&replies[i].body)) {
      // What is not stored is told, whatever else may be healed by another attempt.
      if (outcome || error->code == Errc::kState) outcome = tl::unexpected(*error);
    } else if (parts[i].owner != kHeldHere) {
      await_epoch(parts[i], replies[i].epoch, deadline);
    } else if (auto stored = await_stored(deadline); !stored && outcome) {
      outcome = std::move(stored);
    }
  }
  return outcome;
}

Result<void> Participant::add(const std::string& id, const AddRequest& request,
                              const std::string& partition) {
  const Deadline deadline = call_deadline();
  auto added = retry_on_stale_route(
      deadline, [&] { return route_add(forest_, directory_, id, request, partition); },
      [&](Part& part) {
        std::vector<Part> parts{std::move(part)};
        return change(parts, deadline);
      });
  if (added) return added;
  return tl::unexpected(unless_unsaved(std::move(added.error()), id));
}

Result<void> Participant::remove(const std::string& id) {
  const Deadline deadline = call_deadline();
  // All below it are told by name, so all must be known.
  if (auto all = await_discovery(deadline); !all) return all;
  bool asked = false;
  auto removed = retry_on_stale_route(
      deadline, [&] { return route_remove(forest_, directory_, id); },
      [&](std::vector<Part>& parts) {
        asked = true;
        return change(parts, deadline);
      });
  // Gone by the time of a second attempt: what was asked for has come to be.
  if (removed) return removed;
  const bool is_missing = is_elsewhere(removed.error());
  if (is_missing && asked && !forest_.exists(id)) return {};
  return tl::unexpected(unless_unsaved(std::move(removed.error()), id));
}

Result<void> Participant::move(const std::string& id, const MoveRequest& request) {
  const Deadline deadline = call_deadline();
  return retry_on_stale_route(
      deadline, [&] { return route_move(forest_, directory_, id, request); },
      [&](Part& part) {
        std::vector<Part> parts{std::move(part)};
        return change(parts, deadline);
      });
}

Result<void> Participant::update(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = forest_.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  const Deadline deadline = call_deadline();
  return retry_on_stale_route(
      deadline, [&] { return route_update(forest_, directory_, edges, stamp); },
      [&](std::vector<Part>& parts) { return change(parts, deadline); });
}

Result<void> Participant::update_partial(const std::vector<PartialUpdate>& edges,
                                         std::optional<Time> stamp) {
  if (edges.empty()) return {};
  const Deadline deadline = call_deadline();
  return retry_on_stale_route(
      deadline, [&] { return route_update(forest_, directory_, edges, stamp); },
      [&](std::vector<Part>& parts) { return change(parts, deadline); });
}

Result<void> Participant::publish(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = forest_.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  const Deadline deadline = call_deadline();
  auto parts = routed(deadline, [&] { return route_publish(forest_, directory_, edges, stamp); });
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
  if (part.owner == kHeldHere) return forest_.update(share.edges, share.stamp);
  {
    const std::lock_guard lock(structure_mutex_);
    if (auto ok = check_reachable(directory_, {part}); !ok) return ok;
  }
  return transport_->send(part.partition, share, deadline.at());
}

Result<void> Participant::flush(Milliseconds wait) {
  return transport_->flush(Deadline(wait).at());
}

Result<std::vector<PathSegment>> Participant::path(std::string_view a, std::string_view b) {
  return routed(call_deadline(), [&]() -> Result<std::vector<PathSegment>> {
    auto segments = forest_.segments(a, b);
    if (!segments) return tl::unexpected(std::move(segments.error()));
    std::vector<PathSegment> path;
    for (Segment& segment : *segments) {
      path.push_back(
          {directory_.name(segment.owner), std::move(segment.from), std::move(segment.to)});
    }
    return path;
  });
}

Result<FrameInfo> Participant::info(const std::string& id, const Deadline& deadline) {
  return after_discovery(deadline, [&]() -> Result<FrameInfo> {
    auto info = forest_.info(id);
    if (!info) return fail(Errc::kUnknownFrame, "no frame " + quote(id));
    return *std::move(info);
  });
}

Result<std::vector<Frame>> Participant::frames() {
  if (auto all = await_discovery(call_deadline()); !all)
    return tl::unexpected(std::move(all.error()));
  std::vector<FrameInfo> infos = forest_.frames();
  std::vector<Frame> frames;
  frames.reserve(infos.size());
  const std::lock_guard lock(structure_mutex_);
  for (FrameInfo& info : infos) {
    frames.push_back(
        {std::move(info.id), std::move(info.parent), directory_.name(info.owner), info.attached});
  }
  std::sort(frames.begin(), frames.end(),
            [](const Frame& a, const Frame& b) { return a.id < b.id; });
  return frames;
}

std::size_t Participant::own_frames() {
  const std::lock_guard lock(structure_mutex_);
  return partition_ != nullptr ? partition_->frame_count() : 0;
}

Result<std::vector<PartitionInfo>> Participant::partitions() {
  if (auto all = await_discovery(call_deadline()); !all)
    return tl::unexpected(std::move(all.error()));
  const std::lock_guard lock(structure_mutex_);
  auto all = directory_.partitions();
  if (partition_ == nullptr) return all;
  for (PartitionInfo& info : all) {
    if (info.name != partition_->name()) continue;
    info.host = presence_.host;
    info.pid = presence_.pid;
    info.frames = partition_->frame_count();
  }
  return all;
}

}  // namespace tfdude
