#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/types/frame.hpp"
#include "tfdude/types/options.hpp"

#include "partition/member.hpp"
#include "partition/observing.hpp"
#include "partition/routing.hpp"
#include "runtime/commit_loop.hpp"
#include "runtime/deadline.hpp"
#include "runtime/deferred.hpp"
#include "runtime/discovery.hpp"
#include "runtime/events.hpp"
#include "runtime/gathering.hpp"
#include "runtime/lookups.hpp"
#include "runtime/pusher.hpp"
#include "runtime/requests.hpp"
#include "runtime/streams.hpp"
#include "runtime/structure.hpp"
#include "runtime/watches.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// One participant: its forest, directory, partition (if it owns one) and transport, wired together.
///
/// Locks, in the order in which they may be taken: that of structure_, joints_mutex_. No lock is held while
/// a call waits for others; that of structure_ is not held while anything is sent.
class Participant final : public TransportHandler, private CommitLoop::Effects {
 public:
  /// @param partition  the one that it is to own; empty: none
  Participant(TransportPtr transport, std::string partition, const Options& options);
  ~Participant() override;
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  [[nodiscard]] Result<void> start();

  /// Makes this participant the owner of its partition (participant_serve.cpp).
  [[nodiscard]] Result<void> serve(const std::vector<FrameSpec>& frames);

  // What Client offers.
  [[nodiscard]] Result<void> add(const std::string& id, const AddRequest& request,
                                 const std::string& partition);
  [[nodiscard]] Result<void> remove(const std::string& id);
  [[nodiscard]] Result<void> move(const std::string& id, const MoveRequest& request);
  [[nodiscard]] Result<void> update(const std::vector<EdgeUpdate>& edges,
                                    std::optional<Time> stamp);
  [[nodiscard]] Result<void> update_partial(const std::vector<PartialUpdate>& edges,
                                            std::optional<Time> stamp);
  [[nodiscard]] Result<void> publish(const std::vector<EdgeUpdate>& edges,
                                     std::optional<Time> stamp);
  [[nodiscard]] Result<void> flush(Milliseconds wait);
  // Without waiting (participant_streams.cpp).
  [[nodiscard]] Result<std::shared_ptr<Sender<Update>>> stream(
      const std::vector<std::string>& edges);
  [[nodiscard]] Result<std::shared_ptr<Sender<JointUpdate>>> stream_joints(
      const std::vector<std::string>& names);
  // Joints (participant_joints.cpp).
  [[nodiscard]] Result<void> update_joints(const JointUpdate& update);
  [[nodiscard]] Result<void> publish_joints(const JointUpdate& update);
  [[nodiscard]] Result<std::vector<JointInfo>> joints(const std::string& partition);
  template <class Name>
  [[nodiscard]] Result<Transform> lookup(Name a, Name b) {
    auto local = structure_.forest.lookup(a, b);
    if (local || is_of_time(local.error())) return local;
    return lookup_elsewhere(a, b, {}, call_deadline())
        .map([](const StampedTransform& X_AB) -> Transform { return X_AB; });
  }
  template <class Name>
  [[nodiscard]] Result<Pose> lookup_pose(Name a, Name b) {
    if (auto local = structure_.forest.lookup_pose(a, b)) return local;
    return lookup(a, b).map([](const Transform& X_AB) { return X_AB.pose; });
  }
  template <class Name>
  [[nodiscard]] Result<StampedTransform> lookup(Name a, Name b, const Query& query) {
    auto local = structure_.forest.lookup(a, b, query);
    if (local || is_of_time(local.error())) return local;
    return lookup_elsewhere(a, b, query, call_deadline());
  }
  [[nodiscard]] Result<StampedTransform> lookup_by(std::string_view a, std::string_view b,
                                                   const Query& query, const Deadline& deadline);
  [[nodiscard]] Result<StampedTransform> lookup_waiting(std::string_view a, std::string_view b,
                                                        const Query& query, Milliseconds wait);
  /// @return what cancels it when its last copy goes
  [[nodiscard]] std::shared_ptr<void> lookup_async(const std::string& a, const std::string& b,
                                                   const Query& query, Milliseconds wait,
                                                   Lookups::Callback callback);
  [[nodiscard]] std::future<Result<StampedTransform>> lookup_async(const std::string& a,
                                                                   const std::string& b,
                                                                   const Query& query,
                                                                   Milliseconds wait);
  [[nodiscard]] Result<std::shared_ptr<WatchedPath>> watch(const std::string& a,
                                                           const std::string& b,
                                                           const WatchOptions& options);
  // Measurements (participant_observe.cpp).
  [[nodiscard]] Result<Observed> observe(const std::string& a, const std::string& b,
                                         const Transform& X_AB, std::optional<Time> stamp,
                                         const ObserveOptions& options, const Deadline& deadline);
  [[nodiscard]] Result<void> correlate(const std::string& id, const Correlation& correlation);
  [[nodiscard]] Result<std::vector<EdgeConsistency>> consistency(const std::string& partition);
  [[nodiscard]] Result<std::vector<PastInfo>> past(const std::string& id);
  [[nodiscard]] Result<std::vector<PastInfo>> pasts(const std::string& partition);
  [[nodiscard]] Result<std::vector<PathSegment>> path(std::string_view a, std::string_view b);
  [[nodiscard]] Result<Handle> find(std::string_view id);
  [[nodiscard]] Result<FrameInfo> info(const std::string& id, const Deadline& deadline);
  [[nodiscard]] Result<std::vector<Frame>> frames();
  [[nodiscard]] Result<std::vector<PartitionInfo>> partitions();
  [[nodiscard]] std::size_t own_frames();
  /// @return kUnknownPartition, kPartitionTaken where it is there.
  [[nodiscard]] Result<void> forget(const std::string& partition);
  /// @return what ends it when its last copy goes
  [[nodiscard]] std::shared_ptr<void> on_change(Events::Callback listener);

  [[nodiscard]] Deadline call_deadline() const { return discovery_.call_deadline(); }
  /// Waits until all that was there at the start is known. @return kTimeout, naming what was missing.
  [[nodiscard]] Result<void> await_discovery(const Deadline& deadline) {
    return discovery_.await(deadline);
  }

  /// Of an update or a lookup: whether it concerns what others hold.
  static bool is_elsewhere(const Error& error) {
    return error.code == Errc::kUnknownFrame || error.code == Errc::kNotOwner;
  }
  static bool is_of_time(const Error& error) {
    return error.code == Errc::kNotYet || error.code == Errc::kTooOld;
  }

  Forest& forest() { return structure_.forest; }
  [[nodiscard]] const std::string& partition_name() const { return partition_name_; }

  // TransportHandler
  void on_request(const PeerId& from, const Request& request) override;
  void on_reply(const Reply& reply) override { requests_.calls().on_reply(reply); }
  void on_update(const Update& update) override;
  void on_joints(const JointUpdate& update) override;
  void on_state(const State& state) override;
  void on_watcher(std::uint64_t group) override;
  void on_page(const Page& page) override;
  void on_presence(const Presence& presence) override;
  void on_lost(const std::string& partition, std::uint64_t incarnation) override;
  [[nodiscard]] bool owns(std::string_view id) const override {
    return structure_.forest.holds(id);
  }
  [[nodiscard]] bool owns_joint(std::string_view name) const override {
    return partition_ != nullptr && partition_->moves(name);
  }

 private:
  using Clock = std::chrono::steady_clock;

  static Time wall_clock();
  /// @return kPartitionTaken once this participant has given its partition up.
  [[nodiscard]] Result<void> still_in();

  // Lookups that others must be asked for (participant_lookup.cpp, participant_observe.cpp), and what is pushed
  // (participant_watch.cpp).
  [[nodiscard]] Result<StampedTransform> lookup_elsewhere(std::string_view a, std::string_view b,
                                                          const Query& query,
                                                          const Deadline& deadline);
  [[nodiscard]] Result<StampedTransform> lookup_elsewhere(Handle a, Handle b, const Query& query,
                                                          const Deadline& deadline);
  [[nodiscard]] Result<std::vector<SegmentValues>> ask_values(std::vector<Part>& parts,
                                                              const Deadline& deadline);
  [[nodiscard]] Lookups::Links links_of_lookups();
  [[nodiscard]] std::string new_source();
  [[nodiscard]] Result<ObservedPath> ask_observed(ObservePlan& plan, const Deadline& deadline);
  [[nodiscard]] Result<bool> revise(std::vector<Part> parts, const Deadline& deadline);
  [[nodiscard]] Result<WatchRoute> plan_watch(const WatchedPath& path);
  [[nodiscard]] Reply answer_watch(const Request& request);
  /// The structure has changed, or who is there: watched paths and streams may go another way.
  void look_at_routes();
  template <class OwnersOf>
  [[nodiscard]] std::vector<std::vector<Destination>> destinations(
      const std::vector<std::string>& names, OwnersOf owners_of);
  [[nodiscard]] SenderLinks<Update> links_of_edge_streams();
  [[nodiscard]] SenderLinks<JointUpdate> links_of_joint_streams();

  [[nodiscard]] Result<void> publish_to(const Part& part, const Update& share,
                                        const Deadline& deadline);
  [[nodiscard]] Result<void> publish_to(const Part& part, const JointUpdate& share,
                                        const Deadline& deadline);
  [[nodiscard]] Reply answer_here(const Request& request);
  // What commits_ does (participant_commit.cpp).
  [[nodiscard]] Ready take() override;
  void publish(const Ready& ready) override;
  void take_back(const Ready& ready) override;
  [[nodiscard]] ChangedValues take_values() override;
  void take_back(const ChangedValues& values) override;
  void reply(const PendingReply& reply) override;
  /// Why a change is refused as long as what was changed before it cannot be stored.
  [[nodiscard]] std::optional<Error> refusal() const;
  /// Where an own frame is not stored, neither that it is there nor that it is gone is said.
  [[nodiscard]] Error unless_unsaved(Error error, const std::string& id);
  /// Waits until what a request has changed of the own structure is stored, if it is to be.
  [[nodiscard]] Result<void> await_stored(const Request& request, const Deadline& deadline);
  [[nodiscard]] Requests::Own links_of_requests();
  [[nodiscard]] Result<void> claim_name();
  [[nodiscard]] Result<StoredState> open_store(std::unique_ptr<StateStore>& store);
  [[nodiscard]] Result<void> take_frames(const std::vector<FrameSpec>& frames);
  [[nodiscard]] Result<void> set_timings(const std::vector<FrameSpec>& frames);
  void introduce();
  void say_goodbye();
  void start_to_look_for_gone();
  void await_gone();
  void concede();
  [[nodiscard]] bool catch_up();

  /// Hands the member an input; under the lock of the structure,
  template <class Input>
  [[nodiscard]] Outcome input(Input input) {
    const std::lock_guard lock(structure_.mutex);
    input();
    return take_outcome();
  }
  /// and that of joints, too.
  template <class Input>
  [[nodiscard]] Outcome input_of_joints(Input input) {
    const std::lock_guard lock(structure_.mutex);
    const std::lock_guard joints(joints_mutex_);
    input();
    return take_outcome();
  }
  [[nodiscard]] Outcome take_outcome();
  /// Has the parts of this process look at what has changed. By callers that hold no lock.
  void react(const Outcome& outcome);

  const Options options_;
  // The directory's copy moves as others appear.
  const std::string partition_name_;
  Structure structure_;
  Member member_;  // under the structure's lock
  TransportPtr transport_;
  Discovery discovery_;
  Requests requests_;
  Partition* partition_ = nullptr;  // the member's; set once, before the transport serves
  std::atomic<bool> out_{false};    // another process has the partition now
  const std::shared_ptr<Events> events_ = std::make_shared<Events>();
  std::mutex joints_mutex_;           // what partition_ knows of joints, refused_joints_
  std::uint64_t refused_joints_ = 0;  // updates
  std::uint64_t saved_commit_ = 0;    // of values; of the thread of commits_
  SharedHints hints_;
  std::mutex pushing_mutex_;  // pusher_, watches_ and gone_look_, as they are made, and leaving_
  bool leaving_ = false;
  std::unique_ptr<Pusher> pusher_;    // once somebody watches
  std::unique_ptr<Watches> watches_;  // once this process does
  std::atomic<Watches*> watching_{nullptr};
  Lookups lookups_;  // that wait
  Streams streams_;  // that do not
  std::atomic<std::uint64_t> observations_{0};
  // Both use the transport, and stop before it.
  std::optional<CommitLoop> commits_;  // set once, before partition_
  std::optional<Deferred> conceder_;
  std::optional<Deferred> gone_look_;  // once somebody is silent
};

}  // namespace tfdude
