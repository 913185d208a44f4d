#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/time.hpp"

#include "partition/consistency.hpp"
#include "partition/directory.hpp"
#include "partition/handovers.hpp"
#include "partition/joints.hpp"
#include "partition/messages.hpp"
#include "partition/pages.hpp"
#include "partition/reply_cache.hpp"
#include "partition/rewrites.hpp"
#include "partition/state_store.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// The rules of an owner: its answers to requests, and the structure that it publishes.
///
/// @par Thread safety  The caller serializes all functions that change the structure, including
///   answer(), with those of the directory. answer_lookup(), answer_history(), moves() and apply()
///   of edges may run concurrently with anything. Functions that concern joints, including
///   answer(), are serialized, too, but not necessarily with the directory.
class Partition {
 public:
  Partition(std::string name, std::uint64_t incarnation, Forest& forest, Directory& directory);

  [[nodiscard]] const std::string& name() const { return name_; }

  /// Limits the frames that requests can add; more are rejected with kTooMuch.
  void limit_frames(std::size_t frames) { max_frames_ = frames; }
  /// How many were rejected for that.
  [[nodiscard]] std::uint64_t refused_frames() const { return refused_frames_; }

  /// Loads the frames of a configuration, in any order; parents may be missing. All or none.
  /// @return the error of the first invalid frame: an invalid or repeated id, a cycle.
  [[nodiscard]] Result<void> load(const std::vector<FrameSpec>& frames, Time now);

  /// Loads the state of an earlier process of this partition, with the changes of the
  /// configuration: see configured_changes(). Everything else is as it was stored. Yields frames
  /// that others have claimed since. From now on changes are collected for take_unsaved().
  /// @return the error of the first invalid new frame of the configuration: an invalid or repeated
  ///   id, a cycle.
  [[nodiscard]] Result<void> restore(const StoredState& state,
                                     const std::vector<FrameSpec>& configured, Time now);

  /// Answers any request of a peer; a repeated one gets the same reply.
  [[nodiscard]] Reply answer(const PeerId& peer, const Request& request, Time now);

  /// Rejects a change that may not be made now. A request that was answered before gets the same
  /// reply.
  [[nodiscard]] Reply refuse(const PeerId& peer, const Request& request, const Error& why,
                             Time now);

  /// Answers a request of the owner's own process.
  [[nodiscard]] Reply answer(const Request& request, Time now);

  /// Answers a lookup request.
  [[nodiscard]] Reply answer_lookup(std::uint32_t sequence, const LookupRequest& lookup) const;

  /// The histories of the requested edges; at most kMaxItems.
  [[nodiscard]] Reply answer_history(const Request& request) const;

  /// Applies the edges of a stream that this partition owns, as one commit.
  /// @return the number of edges
  std::size_t apply(const Update& update);

  /// Applies the joints of a stream that this partition owns, as one commit. @return as
  /// Joints::apply()
  [[nodiscard]] Result<std::size_t> apply(const JointUpdate& update) {
    return joints_.apply(update);
  }
  /// As Joints::show()
  void show(std::vector<JointInfo> joints) { joints_.show(std::move(joints)); }
  /// Whether this partition owns a joint of that name, or one that follows it. Takes no lock.
  [[nodiscard]] bool moves(std::string_view joint) const { return joints_.moves(joint); }
  /// Whether it has joints. Constant once it serves.
  [[nodiscard]] bool moves_any() const { return joints_.moves_any(); }

  /// Gives up these frames. Those below stay, and wait for other frames of these ids.
  /// @return kUnknownFrame, kNotOwner: then it gives up none
  [[nodiscard]] Result<void> release(const std::vector<std::string>& ids, Time now);

  /// What would have to be yielded according to the directory's current state. O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields() const;

  /// Yields those of `due` that still have to be yielded; messages that were on their way may have
  /// resolved the others.
  /// @return whether the structure changed; new yields may then be pending
  bool yield(const std::set<PendingYield>& due, Time now);

  /// Goes on with handovers, according to what is known of the claims of others. Call after each
  /// input. @return whether the structure changed
  bool settle_handovers();
  /// Ends those that have lasted too long. Call as long as handovers await the time, at least twice
  /// per second. @return whether the structure changed
  bool on_time(Handovers::Steady now);
  [[nodiscard]] bool awaits_time() const { return handovers_.awaits_time(); }
  [[nodiscard]] bool hands_over() const { return !handovers_.empty(); }
  /// What was handed over up to that epoch is stored, and not yet published: others have it now.
  /// @return whether the structure changed
  bool pass_on_stored(std::uint64_t stored);

  /// Continues as a later incarnation, since others know one that hides this one.
  void overtake(std::uint64_t incarnation) {
    pages_.overtake(incarnation);
    saved_absent_.reset();
    overtook_ = true;
  }

  /// The pages to publish since the last call.
  [[nodiscard]] std::vector<Page> take_pages() { return pages_.take_changed(); }
  [[nodiscard]] std::uint32_t page_count() const { return pages_.count(); }
  [[nodiscard]] std::size_t frame_count() const {
    return pages_.frame_count() - handovers_.passed.size();
  }
  /// As Pages::epoch().
  [[nodiscard]] std::uint64_t epoch() const { return pages_.epoch(); }
  /// The number of replies kept for requests that may be repeated.
  [[nodiscard]] std::size_t kept_replies() const { return replies_.size(); }

  /// All that must be saved since the last call, except values, which add_values() adds.
  /// @param values_due  whether values that no request waits for must be saved, even if nothing
  ///   else has changed
  [[nodiscard]] StateChange take_unsaved(bool values_due = false);

  /// Adds the values, as of when the change was taken. Needs no lock: there may be many. See
  /// Forest::changed().
  void add_values(StateChange& change) const;

  /// The change could not be saved, and these pages were not published: both are returned again
  /// later.
  void still_unsaved(const StateChange& change, const std::vector<Page>& pages);
  /// Whether a change of the frame's existence or place is not saved.
  [[nodiscard]] bool is_unsaved(const std::string& id) const {
    return unsaved_.count(id) != 0 || pages_.is_touched(id);
  }

 private:
  [[nodiscard]] Reply answer_new(const PeerId& peer, const Request& request, Time now);
  [[nodiscard]] Result<void> apply(const PeerId& peer, const Request& request, Time now);
  [[nodiscard]] Result<void> add(const std::string& id, const AddRequest& request, Time now);
  [[nodiscard]] Result<void> remove(const RemoveRequest& request, Time now);
  [[nodiscard]] Result<void> move(const std::string& id, const MoveRequest& request, Time now);
  [[nodiscard]] Result<void> update(const UpdateRequest& request);
  [[nodiscard]] Result<void> update(const PartialUpdateRequest& request);
  template <class Edge>
  [[nodiscard]] Result<void> note_update(const std::vector<Edge>& edges, Result<void> updated);
  [[nodiscard]] Result<void> revise(const ReviseRequest& request);
  [[nodiscard]] Result<void> rewrite(const PeerId& peer, const std::string& id,
                                     const RewriteRequest& part, Time now);
  [[nodiscard]] Reply answer_handover(const PeerId& peer, const Request& request,
                                      const HandOverRequest& asked, Time now);
  [[nodiscard]] Result<void> begin_handover(const PeerId& peer, const std::string& top,
                                            const std::string& to, Time now);
  void offer(const std::string& to, std::vector<HandedFrame>& frames, Time now);
  [[nodiscard]] Result<std::vector<HandedFrame>> frames_to_hand_over(const std::string& top) const;
  [[nodiscard]] Result<HandedPart> part_of(const Handovers::Handover& handover,
                                           const HandOverRequest& asked) const;
  [[nodiscard]] Result<void> hand_over(const PeerId& peer, const std::string& top,
                                       const HandOverRequest& asked);
  [[nodiscard]] Result<void> adopt(const PeerId& peer, const std::string& top,
                                   const AdoptRequest& request, Time now);
  [[nodiscard]] Result<void> check_adopted(const std::vector<HandedEdge>& edges,
                                           const std::string& top,
                                           const AdoptRequest& request) const;
  [[nodiscard]] Result<void> check_offered(const std::vector<HandedEdge>& edges,
                                           const std::string& top,
                                           const AdoptRequest& request) const;
  [[nodiscard]] tl::unexpected<Error> fail_not_offered(const std::string& id,
                                                       const std::string& from) const;
  /// Of a claim to a held frame with another parent.
  [[nodiscard]] std::uint64_t time_of_move(const std::string& id, Time now);
  /// Gives up a frame that no joint moves.
  bool withdraw(const std::string& id);
  void resume_handovers(const std::vector<const StoredFrame*>& kept);
  void freeze_adopted();
  /// Of an adopted frame: its former owner has not decided, or this partition owns it, or does not.
  enum class Outlook : std::uint8_t { kOpen, kOwned, kLost };
  [[nodiscard]] Outlook outlook(const std::string& id, const Handovers::Adopted& adopted) const;
  bool settle_offered();
  bool settle_adopted();
  bool settle_passed();
  [[nodiscard]] bool stands(const Handovers::Handover& handover) const;
  [[nodiscard]] bool must_wait(const PendingYield& pending) const;
  [[nodiscard]] bool is_taken(const Handovers::Handover& handover) const;
  void decide(Handovers::Handover& handover);
  void pass_on(const Handovers::Handover& handover);
  void keep(const Handovers::Handover& handover);
  [[nodiscard]] Result<void> correlate(const std::string& id, const Correlation& correlation);
  [[nodiscard]] Result<void> set_joints(const JointUpdate& update);
  [[nodiscard]] Result<void> take(const std::vector<FrameSpec>& frames, std::uint64_t lamport_time);
  void attach_joints(const std::vector<FrameSpec>& frames, const std::vector<StoredJoint>& left);
  void detach_joint(const std::string& id);
  bool yield(const PendingYield& pending, Time now);
  [[nodiscard]] bool hang_again(const StoredFrame& frame);
  void make_root(const StoredFrame& frame, Time now);
  [[nodiscard]] Result<void> reconfigure(const StoredState& state,
                                         const std::vector<StoredJoint>& joints,
                                         const std::vector<FrameSpec>& configured, Time now);
  bool release(const std::string& id, std::optional<LamportTime> dropped = {});
  void tell_dropped(const std::string& id);
  void leave(const Tombstone& tombstone);
  void put(const std::string& id, const std::string& parent, std::uint64_t lamport_time);
  void forget(const std::vector<std::string>& removed, LamportTime when);
  void yield_to(const std::string& id, Owner rival, Time now);
  bool concede(const std::string& id, Owner rival, Time now);
  [[nodiscard]] Result<void> forget_partition(const ForgetRequest& request, Time now);
  void make_root(const std::string& id, Owner rival, Time now);
  void tell_conflict(const Tombstone& tombstone);
  [[nodiscard]] Error at_home(Error error, std::string_view id) const;

  std::string name_;
  Forest& forest_;
  Directory& directory_;
  Pages pages_;
  Joints joints_;
  ReplyCache replies_;
  Rewrites rewrites_;
  Handovers handovers_;
  AdoptedParts adopted_parts_;
  std::size_t max_frames_ = SIZE_MAX;
  std::uint64_t refused_frames_ = 0;
  Consistency consistency_;
  bool saved_ = false;
  bool values_asked_ = false;       // a request waits until its values are saved
  bool overtook_ = false;           // since it was last saved
  std::uint64_t saved_commit_ = 0;  // up to which the values are
  std::set<std::string> unsaved_;   // what could not be saved
  std::optional<std::vector<Absent>>
      saved_absent_;  // the partitions that this one misses, as last stored
  std::optional<std::vector<FrameSpec>> configured_;  // until it is saved
};

}  // namespace tfdude
