#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "tfdude/base/id.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/options.hpp"

#include "partition/incarnation.hpp"
#include "partition/name_claim.hpp"
#include "partition/observing.hpp"
#include "partition/partition.hpp"
#include "partition/routing.hpp"
#include "runtime/asking.hpp"
#include "runtime/calls.hpp"
#include "runtime/commit_loop.hpp"
#include "runtime/deadline.hpp"
#include "runtime/deferred.hpp"
#include "runtime/events.hpp"
#include "runtime/gathering.hpp"
#include "runtime/lookups.hpp"
#include "runtime/pusher.hpp"
#include "runtime/streams.hpp"
#include "runtime/watches.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// One participant: its forest, directory, partition (if it owns one) and transport, wired together.
///
/// Locks, in the order in which they may be taken: structure_mutex_, joints_mutex_. No lock is held while
/// a call waits for others; structure_mutex_ is not held while anything is sent.
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
    auto local = forest_.lookup(a, b);
    if (local || is_of_time(local.error())) return local;
    return lookup_elsewhere(a, b, {}, call_deadline())
        .map([](const StampedTransform& X_AB) -> Transform { return X_AB; });
  }
  template <class Name>
  [[nodiscard]] Result<Pose> lookup_pose(Name a, Name b) {
    if (auto local = forest_.lookup_pose(a, b)) return local;
    return lookup(a, b).map([](const Transform& X_AB) { return X_AB.pose; });
  }
  template <class Name>
  [[nodiscard]] Result<StampedTransform> lookup(Name a, Name b, const Query& query) {
    auto local = forest_.lookup(a, b, query);
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
  [[nodiscard]] Result<FrameInfo> info(const std::string& id, const Deadline& deadline);
  [[nodiscard]] Result<std::vector<Frame>> frames();
  [[nodiscard]] Result<std::vector<PartitionInfo>> partitions();
  [[nodiscard]] std::size_t own_frames();
  /// @return kUnknownPartition, kPartitionTaken where it is there.
  [[nodiscard]] Result<void> forget(const std::string& partition);
  /// @return what ends it when its last copy goes
  [[nodiscard]] std::shared_ptr<void> on_change(Events::Callback listener);

  /// When a call that begins now must be over: after Options::timeout; while this participant may still be meeting others,
  /// the rest of Options::discovery later.
  [[nodiscard]] Deadline call_deadline() const;

  /// Waits until all that was there at the start is known. @return kTimeout, naming what was missing.
  [[nodiscard]] Result<void> await_discovery(const Deadline& deadline);

  /// Runs an operation that may fail for what is not known yet; repeats it until it is known for sure.
  /// @return also kTimeout, where it was not known by then
  template <class Operation>
  auto after_discovery(const Deadline& deadline, Operation operation) -> decltype(operation()) {
    while (true) {
      if (auto ok = still_in(); !ok) return tl::unexpected(std::move(ok.error()));
      const bool certain = discovered();
      auto result = operation();
      if (result || !may_appear(result.error().code)) return result;
      if (certain) return tl::unexpected(explained(std::move(result.error())));
      if (deadline.over()) return undecided(result.error().message, deadline);
      wait_for_news(deadline);
    }
  }

  /// Of an update or a lookup: whether it concerns what others hold.
  static bool is_elsewhere(const Error& error) {
    return error.code == Errc::kUnknownFrame || error.code == Errc::kNotOwner;
  }
  static bool is_of_time(const Error& error) {
    return error.code == Errc::kNotYet || error.code == Errc::kTooOld;
  }

  Forest& forest() { return forest_; }
  [[nodiscard]] const std::string& partition_name() const { return partition_name_; }

  // TransportHandler
  void on_request(const PeerId& from, const Request& request) override;
  void on_reply(const Reply& reply) override { calls_.on_reply(reply); }
  void on_update(const Update& update) override;
  void on_joints(const JointUpdate& update) override;
  void on_state(const State& state) override;
  void on_watcher(std::uint64_t group) override;
  void on_page(const Page& page) override;
  void on_presence(const Presence& presence) override;
  void on_lost(const std::string& partition, std::uint64_t incarnation) override;
  [[nodiscard]] bool owns(std::string_view id) const override { return forest_.holds(id); }
  [[nodiscard]] bool owns_joint(std::string_view name) const override {
    return partition_ != nullptr && partition_->moves(name);
  }

 private:
  using Clock = std::chrono::steady_clock;

  static Time wall_clock();
  static bool may_appear(Errc code);
  /// Of what seems not to be there, as others know more.
  [[nodiscard]] Error explained(Error error);
  /// @return kPartitionTaken once this participant has given its partition up.
  [[nodiscard]] Result<void> still_in();
  [[nodiscard]] bool discovered();
  /// Why it is not known yet. @return kTimeout
  [[nodiscard]] tl::unexpected<Error> undecided(const std::string& what, const Deadline& deadline);
  void wait_for_news(const Deadline& deadline = Deadline(Milliseconds::max()));

  // Plans under structure_mutex_.
  template <class Route>
  auto routed(const Deadline& deadline, Route route) -> decltype(route()) {
    return after_discovery(deadline, [&] {
      const std::lock_guard lock(structure_mutex_);
      return route();
    });
  }

  /// Plans, asks, and plans again where the structure has changed meanwhile: the owner asked knows something
  /// newer than this process, or has not heard yet of a change that this process knows of.
  template <class Route, class Ask, class Plan = typename std::invoke_result_t<Route>::value_type>
  std::invoke_result_t<Ask, Plan&> retry_on_stale_route(const Deadline& deadline, Route route,
                                                        Ask ask) {
    int attempts = 0;
    Milliseconds pause{5};
    while (true) {
      const std::uint64_t version = forest_.structure_version();
      auto plan = routed(deadline, route);
      if (!plan) return tl::unexpected(std::move(plan.error()));
      auto result = ask(*plan);
      if (result) return result;
      if (result.error().code == Errc::kNotOwner && ++attempts < kAttempts && !deadline.over()) {
        await_structure_change(version, deadline);
      } else if (denies_plan(result.error().code) && !deadline.over(Clock::now() + pause)) {
        std::this_thread::sleep_for(pause);
        pause *= 2;
      } else {
        return result;
      }
    }
  }
  static constexpr int kAttempts = 3;
  static bool denies_plan(Errc code);

  // Lookups that others must be asked for, and what is pushed (participant_watch.cpp).
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
  /// The list that is a partition's answer.
  template <class Item>
  [[nodiscard]] Result<std::vector<Item>> ask_list(Part part, const Deadline& deadline) {
    std::vector<Part> parts{std::move(part)};
    Reply reply = std::move(ask(parts, deadline).front());
    if (auto* error = std::get_if<Error>(&reply.body)) return tl::unexpected(std::move(*error));
    auto* all = std::get_if<std::vector<Item>>(&reply.body);
    return all != nullptr ? std::move(*all) : std::vector<Item>();
  }
  /// The same by the partition's name, of all that it has.
  template <class Item, class Body>
  [[nodiscard]] Result<std::vector<Item>> ask_all(const std::string& partition, const Body& body) {
    const Deadline deadline = call_deadline();
    return retry_on_stale_route(
        deadline,
        [&]() -> Result<Part> {
          const auto owner = directory_.owner(partition);
          if (!owner) return fail(Errc::kUnknownPartition, "no partition " + quote(partition));
          return route_to(directory_, *owner, Request{0, partition, body});
        },
        [&](Part& part) { return ask_list<Item>(std::move(part), deadline); });
  }
  [[nodiscard]] Result<WatchRoute> plan_watch(const WatchedPath& path);
  [[nodiscard]] Reply answer_watch(const Request& request);
  /// The structure has changed, or who is there: watched paths and streams may go another way.
  void look_at_routes();
  template <class OwnersOf>
  [[nodiscard]] std::vector<std::vector<Destination>> destinations(
      const std::vector<std::string>& names, OwnersOf owners_of);
  [[nodiscard]] SenderLinks<Update> links_of_edge_streams();
  [[nodiscard]] SenderLinks<JointUpdate> links_of_joint_streams();

  [[nodiscard]] Result<void> change(std::vector<Part>& parts, const Deadline& deadline);
  [[nodiscard]] Result<void> publish_to(const Part& part, const Update& share,
                                        const Deadline& deadline);
  [[nodiscard]] Result<void> publish_to(const Part& part, const JointUpdate& share,
                                        const Deadline& deadline);
  [[nodiscard]] std::vector<Reply> ask(std::vector<Part>& parts, const Deadline& deadline);
  [[nodiscard]] Reply answer_here(const Request& request);
  void await_structure_change(std::uint64_t version, const Deadline& deadline);
  void await_epoch(const Part& part, std::uint64_t epoch, const Deadline& deadline);
  // What commits_ does (participant_commit.cpp).
  [[nodiscard]] Commit take() override;
  void publish(const Commit& commit) override;
  void take_back(const Commit& commit) override;
  [[nodiscard]] ChangedValues take_values() override;
  void take_back(const ChangedValues& values) override;
  void reply(const PendingReply& reply) override;
  /// Why a change is refused as long as what was changed before it cannot be stored.
  [[nodiscard]] std::optional<Error> refusal() const;
  /// Where an own frame is not stored, neither that it is there nor that it is gone is said.
  [[nodiscard]] Error unless_unsaved(Error error, const std::string& id);
  /// Waits until own changes of the structure are stored, if they are to be.
  [[nodiscard]] Result<void> await_stored(const Deadline& deadline);
  [[nodiscard]] Result<void> change_here(const Request& request, const Deadline& deadline);
  [[nodiscard]] Result<void> claim_name();
  [[nodiscard]] Result<StoredState> open_store(std::unique_ptr<StateStore>& store);
  [[nodiscard]] Result<void> take_frames(const std::vector<FrameSpec>& frames);
  [[nodiscard]] std::uint64_t next_incarnation() const;
  void say_goodbye();
  void announce_own();
  void overtake();
  void give_up_partition(const Presence& rival);
  void start_to_look_for_gone();
  void look_for_gone();
  void await_gone();
  void concede();
  [[nodiscard]] bool catch_up();
  void tell_changes();

  const Options options_;
  // The directory's copy moves as others appear.
  const std::string partition_name_;
  Forest forest_;
  std::mutex
      structure_mutex_;  // directory_, partition_, claim_, incarnations_, given_up_, presence_
  std::condition_variable structure_changed_;
  Directory directory_;
  std::unique_ptr<Partition> partition_;  // set once, before the transport serves
  Presence presence_;
  Presence announced_;  // as it was said last
  NameClaim claim_;
  IncarnationSource incarnations_;
  std::atomic<bool> out_{false};  // another process has the partition now,
  std::string given_up_;          // and this is why
  const std::shared_ptr<Events> events_ = std::make_shared<Events>();
  std::mutex joints_mutex_;           // what partition_ knows of joints, refused_joints_
  std::uint64_t refused_joints_ = 0;  // updates
  std::uint64_t told_epoch_ = 0;      // of what was published; under structure_mutex_
  std::uint64_t saved_commit_ = 0;    // of values; of the thread of commits_
  Calls calls_;
  SharedHints hints_;
  std::mutex pushing_mutex_;  // pusher_, watches_ and gone_look_, as they are made, and leaving_
  bool leaving_ = false;
  std::unique_ptr<Pusher> pusher_;    // once somebody watches
  std::unique_ptr<Watches> watches_;  // once this process does
  std::atomic<Watches*> watching_{nullptr};
  Lookups lookups_;  // that wait
  Streams streams_;  // that do not
  std::atomic<std::uint64_t> observations_{0};
  std::atomic<bool> discovered_{false};
  const Clock::time_point discovery_deadline_;
  const Clock::time_point
      discovery_end_;       // who has not told by then what it owns is not waited for
  TransportPtr transport_;  // stops before the rest goes
  // Both use the transport, and stop before it.
  std::optional<CommitLoop> commits_;  // set once, before partition_
  std::optional<Deferred> conceder_;
  std::optional<Deferred> gone_look_;  // once somebody is silent
};

}  // namespace tfdude
