#include <algorithm>
#include <set>

#include "tfdude/base/id.hpp"

#include "partition/counters.hpp"
#include "partition/partition.hpp"

// The owner that hands frames over to another one (partition_handover.cpp).
namespace tfdude {
namespace {

using Step = HandOverRequest::Step;

// Of a part; more only if one edge, or one sample, has more by itself.
constexpr std::size_t kPartBytes = 48'000;

// Leaves as many samples as there is room for, but one.
void shorten(HandedEdge& edge, std::size_t room) {
  std::size_t bytes = 0;
  std::size_t fit = 0;
  for (const HandedSample& sample : edge.samples) {
    bytes += bytes_of(sample);
    if (fit > 0 && bytes > room) break;
    ++fit;
  }
  if (fit == edge.samples.size()) return;
  edge.samples.resize(fit);
  edge.continues = true;
}

tl::unexpected<Error> too_late(const std::string& top, const std::string& to) {
  return fail(Errc::kAlreadyExists,
              "frame " + quote(top) + " belongs to partition " + quote(to) + " already");
}

}  // namespace

Reply Partition::answer_handover(const PeerId& peer, const Request& request,
                                 const HandOverRequest& asked, Time now) {
  Reply reply;
  reply.sequence = request.sequence;
  const auto known = handovers_.all.find(request.id);
  const bool begun =
      known != handovers_.all.end() && known->second.to == asked.to && known->second.by == peer;
  if (asked.step == Step::kRead) {
    const auto over = [&] {
      return fail(Errc::kChangedMeanwhile,
                  "frame " + quote(request.id) + " is not being handed over any more");
    };
    auto part = begun ? part_of(known->second, asked) : Result<HandedPart>(over());
    if (begun) known->second.until.reset();
    if (part) {
      reply.body = *std::move(part);
    } else {
      reply.body = std::move(part.error());
    }
    return reply;
  }
  if (asked.step == Step::kBegin) {
    auto ok = begin_handover(peer, request.id, asked.to, now);
    if (!ok) reply.body = std::move(ok.error());
  } else if (auto done = hand_over(peer, request.id, asked); !done) {
    reply.body = std::move(done.error());
  }
  reply.epoch = pages_.shown_epoch();
  reply.lamport_time = directory_.latest_lamport_time();
  return reply;
}

// All claims that follow from this one are later than what is known now.
void Partition::offer(const std::string& to, std::vector<HandedFrame>& frames, Time now) {
  const std::uint64_t lamport_time = time_of_offer(directory_.next_lamport_time(now), to);
  directory_.saw_lamport_time(lamport_time + kPassedOn);
  std::vector<std::string> ids;
  for (HandedFrame& frame : frames) {
    frame.lamport_time = lamport_time;
    pages_.put(frame.id, frame.parent, lamport_time);
    ids.push_back(frame.id);
  }
  forest_.thaw(frames);
  forest_.freeze(ids);
  pages_.close_epoch();
}

Result<void> Partition::begin_handover(const PeerId& peer, const std::string& top,
                                       const std::string& to, Time now) {
  const auto owner = directory_.owner(to);
  if (!owner || *owner == kHeldHere) {
    return fail(Errc::kUnknownPartition,
                "partition " + quote(name_) + " knows no other partition " + quote(to));
  }
  if (!directory_.reachable(*owner)) {
    return fail(Errc::kUnreachable,
                "partition " + quote(to) + " is not reachable for partition " + quote(name_));
  }
  settle_handovers();
  auto known = handovers_.all.find(top);
  if (known == handovers_.all.end()) {
    auto frames = frames_to_hand_over(top);
    if (!frames) return tl::unexpected(std::move(frames.error()));
    if (directory_.latest_lamport_time() > kLastCounter - 2'000'000) {
      return fail(Errc::kInvalidInput, "no more frames can be handed over in this domain");
    }
    offer(to, *frames, now);
    Handovers::Handover handover{peer, to, *std::move(frames)};
    known = handovers_.all.emplace(top, std::move(handover)).first;
  }
  if (known->second.to != to || known->second.by != peer) return being_handed_over(top);
  known->second.until.reset();
  return {};
}

Result<std::vector<HandedFrame>> Partition::frames_to_hand_over(const std::string& top) const {
  if (!forest_.holds(top)) {
    return tl::unexpected(at_home(Error{Errc::kNotOwner, "no frame " + quote(top)}, top));
  }
  std::vector<HandedFrame> frames;
  std::set<std::string> ids;
  std::size_t samples = 0;
  for (const FrameInfo& frame : forest_.subtree(top)) {
    const bool goes = frame.owner == kHeldHere && (frame.id == top || ids.count(frame.parent) != 0);
    if (!goes) continue;
    const bool waits = directory_.handovers().is_contested(frame.id);
    if (waits || forest_.is_frozen(frame.id)) return being_handed_over(frame.id);
    if (pages_.has_joint(frame.id)) {
      return fail(Errc::kInvalidInput, "frame " + quote(frame.id) +
                                           " is moved by a joint of partition " + quote(name_) +
                                           ", so it cannot be handed over");
    }
    ids.insert(frame.id);
    frames.push_back({frame.id, frame.parent, frame.lamport_time});
    for (const HistoryInfo& history : forest_.histories(frame.id)) samples += history.samples;
  }
  if (frames.size() > kMaxItems || samples > kMostHandedSamples) {
    return fail(Errc::kTooMuch, "frame " + quote(top) + ": " + std::to_string(frames.size()) +
                                    " frames with " + std::to_string(samples) +
                                    " samples, of at most " + std::to_string(kMaxItems) +
                                    " frames with " + std::to_string(kMostHandedSamples) +
                                    " samples that can be handed over at once");
  }
  return frames;
}

Result<HandedPart> Partition::part_of(const Handovers::Handover& handover,
                                      const HandOverRequest& asked) const {
  HandedPart part;
  part.incarnation = pages_.incarnation();
  part.first = asked.edge;
  part.begins = asked.edge == 0 && !asked.after;
  const auto& frames = handover.frames;
  std::size_t samples = 0;
  std::size_t bytes = 0;
  std::size_t next = asked.edge;
  while (next < frames.size() && part.edges.size() < kMostHandedAtOnce &&
         samples < kMostHandedAtOnce && bytes < kPartBytes) {
    const auto after = part.edges.empty() ? asked.after : std::nullopt;
    auto edge = forest_.handed(frames[next].id, after, kMostHandedAtOnce - samples);
    if (!edge) return tl::unexpected(at_home(std::move(edge.error()), frames[next].id));
    bytes += bytes_of_head(*edge);
    shorten(*edge, kPartBytes - std::min(bytes, kPartBytes));
    for (const HandedSample& sample : edge->samples) bytes += bytes_of(sample);
    samples += edge->samples.size();
    part.edges.push_back(*std::move(edge));
    if (part.edges.back().continues) return part;
    ++next;
  }
  part.is_last = next == frames.size();
  return part;
}

Result<void> Partition::hand_over(const PeerId& peer, const std::string& top,
                                  const HandOverRequest& asked) {
  settle_handovers();
  const auto known = handovers_.all.find(top);
  const bool begun =
      known != handovers_.all.end() && known->second.to == asked.to && known->second.by == peer;
  const bool cancels = asked.step == Step::kCancel;
  if (begun && known->second.decided) return cancels ? too_late(top, asked.to) : Result<void>();
  if (begun && asked.step == Step::kEnd) {
    return fail(Errc::kNotYet, "partition " + quote(name_) + " has not heard yet that partition " +
                                   quote(asked.to) + " has frame " + quote(top));
  }
  if (begun) {
    keep(known->second);
    handovers_.all.erase(known);
    return {};
  }
  const auto there = forest_.info(top);
  const bool has_gone = there && directory_.name(there->owner) == asked.to;
  if (has_gone && cancels) return too_late(top, asked.to);
  if (has_gone || cancels) return {};
  return fail(Errc::kChangedMeanwhile, "partition " + quote(name_) + " has not handed over frame " +
                                           quote(top) + " to partition " + quote(asked.to) +
                                           ": it lasted too long");
}

// The new owner gives the frames up when it hears of this claim.
void Partition::keep(const Handovers::Handover& handover) {
  std::vector<HandedFrame> frames;
  for (const HandedFrame& frame : handover.frames) {
    const auto there = forest_.info(frame.id);
    if (!there || there->owner != kHeldHere) continue;
    const std::uint64_t claimed = there->lamport_time;
    const std::uint64_t earlier = is_offer(claimed) ? claimed - kKept : claimed;
    frames.push_back({frame.id, there->parent, earlier});
    pages_.put(frame.id, there->parent, earlier);
  }
  forest_.thaw(frames);
  pages_.close_epoch();
}

bool Partition::is_taken(const Handovers::Handover& handover) const {
  const auto to = directory_.owner(handover.to);
  return to && directory_.is_of_live_process(*to) &&
         std::all_of(handover.frames.begin(), handover.frames.end(), [&](const HandedFrame& frame) {
           return directory_.handovers().has_adopted(*to, frame.id);
         });
}

// Until it is stored and published, the frames stay readable here: a disk may take its time.
void Partition::decide(Handovers::Handover& handover) {
  for (const HandedFrame& frame : handover.frames) {
    pages_.put(frame.id, frame.parent, frame.lamport_time + kPassedOn);
    handovers_.leaving.insert(frame.id);
  }
  handover.decided = pages_.epoch() + 1;
}

// A frame that the new owner does not claim any more stays. Nobody has heard that it was let go.
void Partition::pass_on(const Handovers::Handover& handover) {
  FrameClaims& claims = directory_.handovers();
  const auto to = directory_.owner(handover.to);
  std::vector<std::string> ids;
  Handovers::Handover kept{handover.by, handover.to, {}};
  for (const HandedFrame& frame : handover.frames) {
    handovers_.leaving.erase(frame.id);
    if (!to || !claims.has_adopted(*to, frame.id)) {
      kept.frames.push_back(frame);
      continue;
    }
    ids.push_back(frame.id);
    consistency_.forget(frame.id);
    handovers_.passed[frame.id] = {handover.to, {}};
  }
  if (to) claims.pass_on(*to, ids);
  if (!kept.frames.empty()) keep(kept);
}

bool Partition::pass_on_stored(std::uint64_t stored) {
  bool changed = false;
  for (auto one = handovers_.all.begin(); one != handovers_.all.end();) {
    const bool goes = one->second.decided && *one->second.decided <= stored;
    if (goes) pass_on(one->second);
    changed = changed || goes;
    one = goes ? handovers_.all.erase(one) : std::next(one);
  }
  return changed;
}

// Whether all its frames are as it has offered them.
bool Partition::stands(const Handovers::Handover& handover) const {
  return std::all_of(handover.frames.begin(), handover.frames.end(), [&](const HandedFrame& frame) {
    const auto there = forest_.info(frame.id);
    return there && there->owner == kHeldHere && there->lamport_time == frame.lamport_time &&
           forest_.is_frozen(frame.id);
  });
}

bool Partition::settle_offered() {
  bool changed = false;
  for (auto one = handovers_.all.begin(); one != handovers_.all.end();) {
    Handovers::Handover& handover = one->second;
    const bool over = !handover.decided && !stands(handover);
    const bool decides = !handover.decided && !over && is_taken(handover);
    if (over) keep(handover);
    if (decides) decide(handover);
    changed = changed || over || decides;
    one = over ? handovers_.all.erase(one) : std::next(one);
  }
  // There is nothing to wait for.
  if (!saved_) (void)pass_on_stored(UINT64_MAX);
  return changed;
}

bool Partition::settle_passed() {
  bool changed = false;
  for (auto one = handovers_.passed.begin(); one != handovers_.passed.end();) {
    const auto to = directory_.owner(one->second.to);
    const auto place = pages_.place(one->first);
    const auto claim = to ? directory_.handovers().claim_of(one->first, *to) : std::nullopt;
    const bool stays = claim && place && directory_.reachable(*to) &&
                       is_passed_on(claim->lamport_time, place->lamport_time);
    if (!stays) pages_.erase(one->first);
    changed = changed || !stays;
    one = stays ? std::next(one) : handovers_.passed.erase(one);
  }
  return changed;
}

}  // namespace tfdude
