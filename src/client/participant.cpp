#include "client/participant.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"

namespace tfdude {
namespace {

// A request without a reply is sent again after this long, then twice as long, up to the second.
constexpr Milliseconds kFirstRepeat{2};
constexpr Milliseconds kLastRepeat{160};

// How long the structure may take to reach us where a reply says that ours is old.
constexpr Milliseconds kStructureDelay{100};

// How often a new participant asks itself whether it has met everybody.
constexpr Milliseconds kLookAround{2};

}  // namespace

Participant::Participant(std::unique_ptr<Transport> transport, std::string partition,
                         const Options& options)
    : options_(options),
      partition_name_(std::move(partition)),
      forest_(wall_clock),
      directory_(forest_, partition_name_),
      settle_deadline_(Clock::now() + options.discovery),
      transport_(std::move(transport)) {}

Participant::~Participant() {
  pending_.cancel_all();
  {
    const std::lock_guard lock(pushing_mutex_);
    leaving_ = true;
  }
  // Both are used by the transport's threads until that has stopped.
  if (watches_ != nullptr) watches_->stop();
  if (pusher_ != nullptr) pusher_->stop();
  if (conceder_) conceder_->stop();
  if (commits_) commits_->stop();
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
                                  ", before this process came"};
}

// What a plan has checked before anybody was asked.
bool Participant::denies_plan(Errc code) {
  return code == Errc::kAlreadyExists || code == Errc::kUnknownParent || code == Errc::kCycle;
}

bool Participant::settled() {
  if (settled_.load(std::memory_order_relaxed)) return true;
  const auto now = Clock::now();
  bool known = now >= settle_deadline_ + 3 * options_.timeout;
  if (!known) {
    const bool met_all = transport_->settled();
    const bool met_none = now >= settle_deadline_ && !transport_->awaits_presence();
    const std::lock_guard lock(structure_mutex_);
    known = met_all ? directory_.complete() : met_none && directory_.reachable_owners().empty();
  }
  if (known) settled_.store(true, std::memory_order_relaxed);
  return known;
}

void Participant::wait_for_news() {
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_for(lock, kLookAround);
}

void Participant::settle() {
  while (!settled()) wait_for_news();
}

void Participant::await_structure_change(std::uint64_t version) {
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_for(lock, kStructureDelay,
                              [&] { return forest_.structure_version() != version; });
}

// So that whoever changed something finds it changed. Past the deadline the change is made all the same.
void Participant::await_epoch(const Part& part, std::uint64_t epoch, Clock::time_point deadline) {
  std::unique_lock lock(structure_mutex_);
  structure_changed_.wait_until(lock, deadline, [&] {
    return directory_.epoch(part.owner) >= epoch || !directory_.reachable(part.owner);
  });
}

void Participant::send(Calls::Call& call, std::size_t entry, const Request& request,
                       Clock::time_point deadline) {
  if (auto sent = transport_->send(call.entries()[entry].partition, request, deadline); !sent) {
    call.give_up(entry, std::move(sent.error()));
  }
}

void Participant::wait_for_replies(Calls::Call& call, const std::vector<const Request*>& requests,
                                   Clock::time_point deadline) {
  Milliseconds pause = kFirstRepeat;
  int asked = 1;
  while (!call.wait_until(std::min(deadline, Clock::now() + pause))) {
    const bool over = Clock::now() >= deadline;
    for (std::size_t i = 0; i < requests.size(); ++i) {
      if (!call.waits(i)) continue;
      if (!over) {
        send(call, i, *requests[i], deadline);
        continue;
      }
      call.give_up(i, Error{Errc::kTimeout, "partition " + quote(call.entries()[i].partition) +
                                                " did not answer within " +
                                                std::to_string(options_.timeout.count()) +
                                                " ms (asked " + std::to_string(asked) + " times)"});
    }
    ++asked;
    pause = std::min(2 * pause, kLastRepeat);
  }
}

std::vector<Reply> Participant::ask(std::vector<Part>& parts, Clock::time_point deadline) {
  // What this process has changed itself comes before what it asks for: others build on that.
  const bool builds = std::any_of(parts.begin(), parts.end(), [](const Part& part) {
    return part.owner != kHeldHere && !is_question(part.request);
  });
  if (builds && commits_ && commits_->pending()) (void)commits_->flush(deadline);
  std::vector<std::string> partitions;
  for (const Part& part : parts) {
    if (part.owner == kHeldHere) continue;
    partitions.push_back(part.partition);
    transport_->prepare(part.partition);
  }
  Calls::Call call(calls_, partitions);
  std::vector<const Request*> requests;
  for (Part& part : parts) {
    if (part.owner == kHeldHere) continue;
    const std::size_t entry = requests.size();
    part.request.sequence = call.entries()[entry].sequence;
    requests.push_back(&part.request);
    send(call, entry, part.request, deadline);
  }
  std::vector<Reply> replies(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].owner == kHeldHere) replies[i] = answer_here(parts[i].request);
  }
  wait_for_replies(call, requests, deadline);
  std::size_t entry = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].owner != kHeldHere) replies[i] = *call.entries()[entry++].reply;
  }
  return replies;
}

Result<void> Participant::change(std::vector<Part>& parts) {
  if (parts.size() == 1 && parts[0].owner == kHeldHere) return change_here(parts[0].request);
  const auto deadline = Clock::now() + options_.timeout;
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
  auto added = healed([&] { return route_add(forest_, directory_, id, request, partition); },
                      [&](Part& part) {
                        std::vector<Part> parts{std::move(part)};
                        return change(parts);
                      });
  if (added) return added;
  return tl::unexpected(unless_unsaved(std::move(added.error()), id));
}

Result<void> Participant::remove(const std::string& id) {
  // All below it are told by name, so all must be known.
  settle();
  bool asked = false;
  auto removed = healed([&] { return route_remove(forest_, directory_, id); },
                        [&](std::vector<Part>& parts) {
                          asked = true;
                          return change(parts);
                        });
  // Gone by the time of a second attempt: what was asked for has come to be.
  if (removed) return removed;
  const bool is_missing = is_elsewhere(removed.error());
  if (is_missing && asked && !forest_.exists(id)) return {};
  return tl::unexpected(unless_unsaved(std::move(removed.error()), id));
}

Result<void> Participant::move(const std::string& id, const MoveRequest& request) {
  return healed([&] { return route_move(forest_, directory_, id, request); },
                [&](Part& part) {
                  std::vector<Part> parts{std::move(part)};
                  return change(parts);
                });
}

Result<void> Participant::update(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = forest_.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  return healed([&] { return route_update(forest_, directory_, edges, stamp); },
                [&](std::vector<Part>& parts) { return change(parts); });
}

Result<void> Participant::publish(const std::vector<EdgeUpdate>& edges, std::optional<Time> stamp) {
  if (edges.empty()) return {};
  auto updated = forest_.update(edges, stamp);
  if (updated || !is_elsewhere(updated.error())) return updated;
  auto parts = routed([&] { return route_update(forest_, directory_, edges, stamp); });
  if (!parts) return tl::unexpected(std::move(parts.error()));
  const auto deadline = Clock::now() + options_.timeout;
  for (Part& part : *parts) {
    Update update{std::move(std::get<UpdateRequest>(part.request.body).edges), stamp};
    auto sent = part.owner == kHeldHere ? forest_.update(update.edges, update.stamp)
                                        : transport_->send(part.partition, update, deadline);
    if (!sent) return sent;
  }
  return {};
}

Result<std::vector<PathSegment>> Participant::path(std::string_view a, std::string_view b) {
  return routed([&]() -> Result<std::vector<PathSegment>> {
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

Result<FrameInfo> Participant::info(const std::string& id) {
  return when_known([&]() -> Result<FrameInfo> {
    auto info = forest_.info(id);
    if (!info) return fail(Errc::kUnknownFrame, "no frame " + quote(id));
    return *std::move(info);
  });
}

std::vector<Frame> Participant::frames() {
  settle();
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

std::vector<PartitionInfo> Participant::partitions() {
  settle();
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
