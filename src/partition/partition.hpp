#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/time.hpp"

#include "partition/directory.hpp"
#include "partition/joints.hpp"
#include "partition/messages.hpp"
#include "partition/pages.hpp"
#include "partition/reply_cache.hpp"
#include "partition/state_store.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// The rules of an owner: what it answers to each request, and what it publishes of its structure.
///
/// @par Thread safety  The caller serializes all functions that change the structure, answer() among
///   them, with those of the directory; answer_lookup(), answer_history(), moves() and apply() of edges may run beside
///   anything. What has to do with joints, answer() among it, is serialized, too, and need not be with the directory.
class Partition {
 public:
  Partition(std::string name, std::uint64_t incarnation, Forest& forest, Directory& directory);

  [[nodiscard]] const std::string& name() const { return name_; }

  /// Takes the frames of a configuration, in any order; parents may be missing. All or none.
  /// @return the first frame's error: a bad or repeated id, a cycle.
  [[nodiscard]] Result<void> load(const std::vector<FrameSpec>& frames, Time now);

  /// Takes what an earlier process of this partition left, with what the configuration changes of that:
  /// see configured_changes(); all else is as it was left. Yields where others have claimed a frame since. From now on what
  /// changes is kept for take_unsaved().
  /// @return the error of the first new frame of the configuration: a bad or repeated id, a cycle.
  [[nodiscard]] Result<void> restore(const StoredState& state,
                                     const std::vector<FrameSpec>& configured, Time now);

  /// Answers any request of a peer; a repeated one as before.
  [[nodiscard]] Reply answer(const PeerId& peer, const Request& request, Time now);

  /// Refuses a change that is not to be made now; one that was answered before, is answered as before.
  [[nodiscard]] Reply refuse(const PeerId& peer, const Request& request, const Error& why,
                             Time now);

  /// Answers a request of the owner's own process.
  [[nodiscard]] Reply answer(const Request& request, Time now);

  /// Answers a request that reads.
  [[nodiscard]] Reply answer_lookup(std::uint32_t sequence, const LookupRequest& lookup) const;

  /// What is kept of the histories of the edges that a request asks for; kMaxItems edges at most.
  [[nodiscard]] Reply answer_history(const Request& request) const;

  /// Applies those edges of a stream that are owned here, as one commit.
  /// @return how many
  std::size_t apply(const Update& update);

  /// Applies those joints of a stream that are owned here, as one commit. @return as Joints::apply()
  [[nodiscard]] Result<std::size_t> apply(const JointUpdate& update) {
    return joints_.apply(update);
  }
  /// Whether a joint of that name, or one that follows it, is owned here. Takes no lock.
  [[nodiscard]] bool moves(std::string_view joint) const { return joints_.moves(joint); }

  /// The joints that have got positions since the last call.
  [[nodiscard]] std::vector<StoredJoint> take_changed_joints() { return joints_.take_changed(); }

  /// What would have to be yielded as far as the directory knows now. O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields() const {
    return directory_.pending_yields();
  }

  /// Yields what of these would still have to be yielded: what was on its way when they were found may have resolved the
  /// rest. @return whether the structure changed; others may be pending then
  bool yield(const std::set<PendingYield>& due, Time now);

  /// Goes on as a later incarnation, since others know of one that hides this.
  void overtake(std::uint64_t incarnation) {
    pages_.overtake(incarnation);
    saved_absent_.reset();
  }

  /// The pages to publish since the last call.
  [[nodiscard]] std::vector<Page> take_pages() { return pages_.take_changed(); }
  [[nodiscard]] std::uint32_t page_count() const { return pages_.count(); }
  [[nodiscard]] std::size_t frame_count() const { return pages_.frame_count(); }

  /// What must be saved of what was changed by requests since the last call.
  [[nodiscard]] StateChange take_unsaved();

  /// It could not be saved, and these pages were not published: all will be taken again.
  void still_unsaved(const StateChange& change, const std::vector<Page>& pages) {
    updated_.insert(change.erased.begin(), change.erased.end());
    still_unsaved(change.joints);
    if (change.absent) saved_absent_.reset();
    pages_.still_changed(pages);
  }
  void still_unsaved(const std::vector<StoredJoint>& joints) { joints_.still_changed(joints); }
  /// Whether something that was changed of a frame by request will be taken by take_unsaved().
  [[nodiscard]] bool is_unsaved(const std::string& id) const {
    return updated_.count(id) != 0 || pages_.is_touched(id);
  }

 private:
  [[nodiscard]] Result<void> apply(const Request& request, Time now);
  [[nodiscard]] Result<void> add(const std::string& id, const AddRequest& request, Time now);
  [[nodiscard]] Result<void> remove(const RemoveRequest& request, Time now);
  [[nodiscard]] Result<void> move(const std::string& id, const MoveRequest& request, Time now);
  [[nodiscard]] Result<void> update(const UpdateRequest& request);
  [[nodiscard]] Result<void> update(const PartialUpdateRequest& request);
  template <class Edge>
  [[nodiscard]] Result<void> told_of(const std::vector<Edge>& edges, Result<void> updated);
  [[nodiscard]] Result<void> revise(const ReviseRequest& request);
  [[nodiscard]] Result<void> correlate(const std::string& id, const Correlation& correlation);
  [[nodiscard]] Result<void> set_joints(const JointUpdate& update);
  [[nodiscard]] Result<void> take(const std::vector<FrameSpec>& frames, std::uint64_t lamport_time);
  void hang_on_joints(const std::vector<FrameSpec>& frames, const std::vector<StoredJoint>& left);
  void let_go(const std::string& id);
  [[nodiscard]] std::vector<EdgeConsistency> consistency(const std::string& id, bool all) const;
  bool yield(const PendingYield& pending, Time now);
  [[nodiscard]] bool hang_again(const StoredFrame& frame);
  void make_root(const StoredFrame& frame, Time now);
  [[nodiscard]] Result<void> reconfigure(const StoredState& state,
                                         const std::vector<StoredJoint>& joints,
                                         const std::vector<FrameSpec>& configured, Time now);
  bool release(const std::string& id);
  void tell_dropped(const std::string& id, Time now);
  void put(const std::string& id, const std::string& parent, std::uint64_t lamport_time);
  void forget(const std::vector<std::string>& removed, Time now);
  void yield_to(const std::string& id, Owner rival, Time now);
  [[nodiscard]] Result<void> forget_partition(const ForgetRequest& request, Time now);
  void unhang(const std::string& id, Owner rival, Time now);
  void tell_conflict(const Tombstone& tombstone);
  [[nodiscard]] Error at_home(Error error, std::string_view id) const;

  std::string name_;
  Forest& forest_;
  Directory& directory_;
  Pages pages_;
  Joints joints_;
  ReplyCache replies_;
  std::map<std::string, EdgeConsistency> consistency_;  // of edges that were observed
  bool saved_ = false;
  std::set<std::string> updated_;  // by requests, since the last take_unsaved()
  std::optional<std::vector<Absent>>
      saved_absent_;  // whom the store says that this partition misses
};

}  // namespace tfdude
