#include "partition/partition.hpp"

#include <algorithm>

#include "tfdude/base/id.hpp"

#include "partition/requests.hpp"
#include "partition/taken_frames.hpp"

namespace tfdude {
namespace {

template <class... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <class... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

bool are_too_many(const std::vector<PathCorrelation>& all) {
  return all.size() > kMaxCorrelated ||
         std::any_of(all.begin(), all.end(), [](const PathCorrelation& correlation) {
           return correlation.common_errors.size() > kMaxCorrelated;
         });
}

Result<void> check_new_ids(const FrameSpec& frame) {
  auto ok = check_new_id(frame.id, "id");
  for (const CommonError& one : frame.correlation.common_errors) {
    if (ok) ok = check_new_source(one.source);
  }
  return ok;
}

// What is not held of these segments, for a message. Looks at the first ones only: nothing limits
// the edges of many.
std::string unowned(const Forest& forest, const std::vector<PathEnds>& segments) {
  constexpr std::ptrdiff_t kMost = 16;
  const auto count = static_cast<std::ptrdiff_t>(segments.size());
  const auto end = segments.begin() + std::min(count, kMost);
  const auto missing = std::find_if(segments.begin(), end, [&](const PathEnds& segment) {
    return !forest.lookup_segments({segment});
  });
  if (missing == end) return "does not own all of the path";
  return "does not own the path from " + quote(missing->from) + " to " + quote(missing->to);
}

}  // namespace

Partition::Partition(std::string name, std::uint64_t incarnation, Forest& forest,
                     Directory& directory)
    : name_(std::move(name)),
      forest_(forest),
      directory_(directory),
      pages_(name_, incarnation),
      joints_(forest) {}

Result<void> Partition::load(const std::vector<FrameSpec>& frames, Time now) {
  if (auto ok = check_joints(frames); !ok) return ok;
  if (auto taken = take(frames, directory_.next_lamport_time(now)); !taken) return taken;
  attach_joints(frames, {});
  pages_.close_epoch();
  return {};
}

// Takes all frames or none.
Result<void> Partition::take(const std::vector<FrameSpec>& frames, std::uint64_t lamport_time) {
  for (const FrameSpec& frame : frames) {
    if (auto ok = check_new_ids(frame); !ok) return ok;
  }
  std::vector<std::string> loaded;
  for (const FrameSpec& frame : frames) {
    // Frames of a partition that is gone may be taken.
    (void)directory_.take(frame.id);
    auto added = forest_.add(frame.id, frame.parent, value_of(frame), Forest::MissingParent::kAllow,
                             lamport_time);
    if (added) loaded.push_back(frame.id);
    if (added && !frame.correlation.empty()) added = forest_.correlate(frame.id, frame.correlation);
    if (!added) {
      for (const std::string& id : loaded) {
        (void)forest_.remove(id);
        directory_.released(id);
      }
      if (added.error().code != Errc::kAlreadyExists) return added;
      auto free = check_all_free(forest_, directory_, frames);
      return free ? added : free;
    }
  }
  for (const FrameSpec& frame : frames) put(frame.id, frame.parent, lamport_time);
  return {};
}

// A frame whose parent is not that of its description was moved by hand.
void Partition::attach_joints(const std::vector<FrameSpec>& frames,
                              const std::vector<StoredJoint>& left) {
  for (const FrameSpec& frame : frames) {
    const auto info = forest_.info(frame.id);
    const bool there = info && info->owner == kHeldHere && info->parent == frame.parent;
    if (!frame.joint || !there) continue;
    joints_.put(frame.id, *frame.joint, left_of(*frame.joint, left));
    const PageJoint said = names_of(*frame.joint);
    pages_.put_joint(frame.id, said);
    directory_.put_own_joint(said);
  }
}

void Partition::detach_joint(const std::string& id) {
  joints_.detach_joint(id);
  if (const auto joint = pages_.erase_joint(id)) directory_.erase_own_joint(*joint);
}

Reply Partition::answer(const PeerId& peer, const Request& request, Time now) {
  if (is_read_only(request)) return answer_new(peer, request, now);
  if (auto before = replies_.find(peer, request, now)) return *std::move(before);
  Reply reply = answer_new(peer, request, now);
  replies_.put(peer, request, reply);
  return reply;
}

// Stored like any reply: a later repetition of the request must not be applied.
Reply Partition::refuse(const PeerId& peer, const Request& request, const Error& why, Time now) {
  if (auto before = replies_.find(peer, request, now)) return *std::move(before);
  Reply reply{request.sequence, 0, why};
  replies_.put(peer, request, reply);
  return reply;
}

Reply Partition::answer(const Request& request, Time now) {
  return answer_new(PeerId(), request, now);
}

Reply Partition::answer_new(const PeerId& peer, const Request& request, Time now) {
  rewrites_.forget_idle(now);
  adopted_parts_.forget_idle(now);
  if (const auto* lookup = std::get_if<LookupRequest>(&request.body)) {
    return answer_lookup(request.sequence, *lookup);
  }
  const auto* handover = std::get_if<HandOverRequest>(&request.body);
  if (handover != nullptr) return answer_handover(peer, request, *handover, now);
  Reply reply;
  reply.sequence = request.sequence;
  if (const auto* asked = std::get_if<ConsistencyRequest>(&request.body)) {
    reply.body = consistency_.list(request.id, asked->all);
    return reply;
  }
  if (std::holds_alternative<JointsRequest>(request.body)) {
    reply.body = joints_.infos(std::get<JointsRequest>(request.body).after);
    return reply;
  }
  if (auto done = apply(peer, request, now); !done) reply.body = std::move(done.error());
  reply.epoch = pages_.shown_epoch();
  reply.lamport_time = directory_.latest_lamport_time();
  return reply;
}

Reply Partition::answer_lookup(std::uint32_t sequence, const LookupRequest& lookup) const {
  Reply reply;
  reply.sequence = sequence;
  const auto too_many = [&] {
    return Error{Errc::kInvalidInput, "partition " + quote(name_) + " has more than " +
                                          std::to_string(kMaxCorrelated) +
                                          " segments of the path, or sources in one of them"};
  };
  if (lookup.edges && lookup.segments.size() > kMaxCorrelated) {
    reply.body = too_many();
    return reply;
  }
  auto values = forest_.lookup_segments(lookup.segments, lookup.query, lookup.hint, lookup.edges,
                                        lookup.rows);
  if (values && lookup.timed && lookup.query.at) {
    auto timed = forest_.check_timed(lookup.segments, *lookup.query.at);
    if (!timed) values = tl::unexpected(std::move(timed.error()));
  }
  if (values && are_too_many(values->correlations)) {
    reply.body = too_many();
  } else if (values) {
    values->incarnation = pages_.incarnation();
    reply.body = *std::move(values);
  } else if (const Errc code = values.error().code;
             code == Errc::kNotYet || code == Errc::kTooOld || code == Errc::kInvalidInput ||
             code == Errc::kTooMuch) {
    values.error().message.insert(0, "partition " + quote(name_) + ": ");
    reply.body = std::move(values.error());
  } else {
    // The caller's structure is not, or no longer, the owner's.
    reply.body = Error{Errc::kNotOwner, "partition " + quote(name_) + " " +
                                            unowned(forest_, lookup.segments) + ": " +
                                            values.error().message};
  }
  return reply;
}

Reply Partition::answer_history(const Request& request) const {
  const bool all = std::get<HistoryRequest>(request.body).all;
  if (!all && !forest_.holds(request.id)) {
    return {request.sequence, 0,
            at_home(Error{Errc::kNotOwner, "no frame " + quote(request.id)}, request.id)};
  }
  return {request.sequence, 0, forest_.histories(all ? std::string_view() : request.id)};
}

Result<void> Partition::apply(const PeerId& peer, const Request& request, Time now) {
  return std::visit(
      Overloaded{
          [&](const AddRequest& one) { return add(request.id, one, now); },
          [&](const RemoveRequest& one) { return remove(one, now); },
          [&](const UpdateRequest& one) { return update(one); },
          [&](const PartialUpdateRequest& one) { return update(one); },
          [&](const MoveRequest& one) { return move(request.id, one, now); },
          [&](const ReviseRequest& one) { return revise(one); },
          [&](const RewriteRequest& one) { return rewrite(peer, request.id, one, now); },
          [&](const AdoptRequest& one) { return adopt(peer, request.id, one, now); },
          [&](const JointUpdate& one) { return set_joints(one); },
          [&](const CorrelateRequest& one) { return correlate(request.id, one.correlation); },
          [&](const ForgetRequest& one) { return forget_partition(one, now); },
          [](const auto&) -> Result<void> { return {}; }},
      request.body);
}

Result<void> Partition::add(const std::string& id, const AddRequest& request, Time now) {
  if (auto ok = check_new_id(id, "id"); !ok) return ok;
  if (frame_count() >= max_frames_) {
    ++refused_frames_;
    return fail(Errc::kTooMuch, "frame " + quote(id) + " is not added: partition " + quote(name_) +
                                    " has " + std::to_string(frame_count()) + " frames, its limit");
  }
  directory_.saw_lamport_time(request.lamport_time);
  const std::uint64_t lamport_time = directory_.next_lamport_time(now);
  auto added =
      forest_.add(id, request.parent, request.X_PC, Forest::MissingParent::kRefuse, lamport_time);
  if (!added) return added;
  put(id, request.parent, lamport_time);
  pages_.close_epoch();
  return {};
}

Result<void> Partition::remove(const RemoveRequest& request, Time now) {
  std::vector<std::string> removed;
  Result<void> outcome;
  for (const std::string& top : request.tops) {
    auto gone = forest_.remove(top);
    if (gone) {
      removed.insert(removed.end(), gone->begin(), gone->end());
    } else if (outcome) {
      outcome = tl::unexpected(at_home(std::move(gone.error()), top));
    }
  }
  directory_.saw_lamport_time(request.lamport_time);
  forget(removed, directory_.next_lamport_time(now));
  return outcome;
}

Result<void> Partition::move(const std::string& id, const MoveRequest& request, Time now) {
  directory_.saw_lamport_time(request.lamport_time);
  const std::uint64_t lamport_time = time_of_move(id, now);
  if (auto moved = forest_.move(id, request.parent, request.X_PC, lamport_time); !moved) {
    return tl::unexpected(at_home(std::move(moved.error()), id));
  }
  consistency_.forget(id);
  detach_joint(id);
  pages_.put(id, request.parent, lamport_time);
  pages_.close_epoch();
  directory_.changes().frame_moved(id, request.parent, name_);
  directory_.moved();
  return {};
}

void Partition::put(const std::string& id, const std::string& parent, std::uint64_t lamport_time) {
  handovers_.passed.erase(id);
  pages_.put(id, parent, lamport_time);
  directory_.forget_own_tombstone(id);
  directory_.changes().frame_added(id, parent, name_);
}

void Partition::leave(const Tombstone& tombstone) {
  for (const std::string& dropped : pages_.leave(tombstone))
    directory_.forget_own_tombstone(dropped);
  directory_.note_own(tombstone);
}

// From the leaves up: tombstones are limited in number, and those of the top frames should last
// longest.
void Partition::forget(const std::vector<std::string>& removed, LamportTime when) {
  if (removed.empty()) return;
  for (auto id = removed.rbegin(); id != removed.rend(); ++id) {
    consistency_.forget(*id);
    detach_joint(*id);
    pages_.erase(*id);
    leave({*id, when, Tombstone::Kind::kRemoved, {}});
    directory_.changes().frame_removed(*id, name_);
    directory_.released(*id);
  }
  pages_.close_epoch();
}

Result<void> Partition::update(const UpdateRequest& request) {
  return note_update(request.edges, forest_.update(request.edges, request.stamp));
}

Result<void> Partition::update(const PartialUpdateRequest& request) {
  return note_update(request.edges, forest_.update_partial(request.edges, request.stamp));
}

// Notes the result of an update for saving and for statistics.
template <class Edge>
Result<void> Partition::note_update(const std::vector<Edge>& edges, Result<void> updated) {
  if (updated) {
    values_asked_ = true;
    return {};
  }
  const auto foreign = std::find_if(edges.begin(), edges.end(),
                                    [this](const Edge& edge) { return !forest_.holds(edge.id); });
  if (foreign == edges.end()) return updated;
  return tl::unexpected(at_home(std::move(updated.error()), foreign->id));
}

Result<void> Partition::revise(const ReviseRequest& request) {
  std::vector<Revision> edges;
  for (const ReviseRequest::Edge& edge : request.edges) {
    if (!forest_.holds(edge.id)) {
      return tl::unexpected(at_home(Error{Errc::kNotOwner, "no frame " + quote(edge.id)}, edge.id));
    }
    if (edge.revision) edges.push_back(*edge.revision);
  }
  if (request.incarnation != pages_.incarnation()) {
    return fail(Errc::kChangedMeanwhile,
                "partition " + quote(name_) + " has restarted since the observation began");
  }
  if (!edges.empty()) {
    if (auto revised = forest_.revise(edges, request.stamp, request.seen); !revised) return revised;
  }
  for (const ReviseRequest::Edge& edge : request.edges) {
    if (edge.revision) values_asked_ = true;
    consistency_.note(edge);
  }
  return {};
}

// What is known to fail later fails with the first part, before anything is kept.
Result<void> Partition::rewrite(const PeerId& peer, const std::string& id,
                                const RewriteRequest& part, Time now) {
  if (auto ok = forest_.check_rewrite(id, part.interval, part.total); !ok) {
    rewrites_.forget(peer, part.number);
    return tl::unexpected(at_home(std::move(ok.error()), id));
  }
  const auto all = rewrites_.add(peer, id, part, now);
  if (!all) return tl::unexpected(all.error());
  if (!*all) return {};
  if (auto done = forest_.rewrite(id, part.interval, **all); !done) {
    return tl::unexpected(at_home(std::move(done.error()), id));
  }
  values_asked_ = true;
  return {};
}

Result<void> Partition::correlate(const std::string& id, const Correlation& correlation) {
  const std::string who = "frame " + quote(id);
  const auto observed =
      std::find_if(correlation.common_errors.begin(), correlation.common_errors.end(), is_observed);
  if (observed != correlation.common_errors.end()) {
    return fail(Errc::kInvalidInput, who + ": source " + quote(observed->source) +
                                         ": names with this prefix are reserved for observations");
  }
  if (!correlation.observed_with.empty()) {
    return fail(Errc::kInvalidInput, who + ": only observations set what it was observed with");
  }
  for (const CommonError& one : correlation.common_errors) {
    if (auto ok = check_new_source(one.source); !ok) return fail_at(who, ok.error());
  }
  if (joints_.is_coupled(id)) {
    return fail(Errc::kInvalidInput, who +
                                         " is moved by a joint that others mimic; its correlation "
                                         "cannot be set");
  }
  if (auto said = forest_.correlate(id, correlation); !said) {
    return tl::unexpected(at_home(std::move(said.error()), id));
  }
  values_asked_ = true;
  return {};
}

Result<void> Partition::set_joints(const JointUpdate& update) {
  for (const JointValue& joint : update.joints) {
    if (joints_.moves(joint.name)) continue;
    return fail(Errc::kNotOwner,
                "partition " + quote(name_) + " has no joint " + quote(joint.name) + " (any more)");
  }
  const auto moved = joints_.apply(update);
  if (!moved) return tl::unexpected(moved.error());
  if (*moved == 0) {
    return fail(Errc::kInvalidInput, "joint " + quote(update.joints.front().name) +
                                         " moves no frame: it follows another, or its frame was "
                                         "removed or moved");
  }
  values_asked_ = true;
  return {};
}

std::size_t Partition::apply(const Update& update) {
  const auto taken = forest_.update(update.edges, update.stamp);
  if (taken) return update.edges.size();
  if (taken.error().code != Errc::kUnknownFrame && taken.error().code != Errc::kNotOwner) return 0;
  std::vector<EdgeUpdate> own;
  std::copy_if(update.edges.begin(), update.edges.end(), std::back_inserter(own),
               [this](const EdgeUpdate& edge) {
                 return forest_.holds(edge.id) && !forest_.is_frozen(edge.id);
               });
  return forest_.update(own, update.stamp) ? own.size() : 0;
}

// If an owner does not have a requested frame, the frame was moved or removed. In both cases the
// route is outdated, and the directory will have a new one.
Error Partition::at_home(Error error, std::string_view id) const {
  if (error.code != Errc::kUnknownFrame && error.code != Errc::kNotOwner) return error;
  if (forest_.holds(id)) return error;  // it, or a frame below it, is being handed over
  return {Errc::kNotOwner,
          "partition " + quote(name_) + " does not own frame " + quote(id) + " (any more)"};
}

}  // namespace tfdude
