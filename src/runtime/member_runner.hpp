#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "partition/member.hpp"
#include "runtime/commit_loop.hpp"
#include "runtime/context.hpp"
#include "runtime/deadline.hpp"
#include "runtime/events.hpp"

namespace tfdude {

/// Runs the rules of a participant: passes them one input at a time, has their outputs stored,
/// published and replied, in this order (CommitLoop), and notifies the parts of this process.
///
/// No lock is held while sending or while notifying the parts.
/// @par Thread safety  All functions are thread-safe, for callers that hold none of these locks.
///   open(), serve() and publish_all() are for the thread that makes this participant an owner.
class MemberRunner final : private CommitLoop::Effects {
 public:
  using Clock = std::chrono::steady_clock;

  /// The parts that are notified of changes, by the thread that brought them.
  class Listeners {
   public:
    virtual ~Listeners() = default;
    /// What a plan would find has changed.
    virtual void on_routes() = 0;
    /// The partition was stopped, or is lost.
    virtual void on_gone(const std::string& partition) = 0;
    /// A yield may be pending.
    virtual void on_contest() = 0;
  };

  /// @param partition  the partition to own; empty: none
  MemberRunner(const Context& context, std::string partition, Listeners& listeners);
  ~MemberRunner() override { stop(); }
  MemberRunner(const MemberRunner&) = delete;
  MemberRunner& operator=(const MemberRunner&) = delete;

  /// After it has returned no listener runs.
  void stop_events() { events_->stop(); }
  /// Stores and announces pending changes; later ones are not processed.
  void stop();

  // ---- inputs

  void on_page(const Page& page);
  void on_presence(const Presence& presence);
  void on_lost(const std::string& partition, std::uint64_t incarnation,
               std::chrono::nanoseconds early);
  /// A request of a peer. @return the reply to send at once; empty if it follows after its changes
  /// are stored
  [[nodiscard]] std::optional<Reply> on_request(const PeerId& from, const Request& request);
  /// A request of this process.
  [[nodiscard]] Reply answer(const Request& request);
  /// As Node::release()
  [[nodiscard]] Result<void> release(const std::vector<std::string>& ids, const Deadline& deadline);
  /// @return as Member::forget
  [[nodiscard]] Result<void> forget(const std::string& partition);
  /// Applies joint positions. @return the number of moved edges; kInvalidInput
  [[nodiscard]] Result<std::size_t> apply(const JointUpdate& update);
  /// As apply(), without waiting. @return also kTimeout if another thread does the same
  [[nodiscard]] Result<std::size_t> try_apply(const JointUpdate& update);
  /// As Node::show_joints()
  void show(std::vector<JointInfo> joints);

  /// @return as Member::yield
  void yield(const std::set<PendingYield>& due, bool current);

  // ---- becoming an owner

  /// From now on changes made here are stored, if there is a store, and announced.
  void open(std::unique_ptr<StateStore> store, Milliseconds save_every);
  /// @return as Member::serve
  [[nodiscard]] Result<void> serve(const StoredState* left,
                                   const std::vector<FrameSpec>& configured);
  /// Stores, publishes and announces everything, on this thread. @return kState
  [[nodiscard]] Result<void> publish_all() { return commits_->start(); }
  /// Announces its current presence.
  void introduce();
  /// Announces its stop, if its presence was ever announced.
  void say_goodbye();

  // ---- state

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Null before it serves. Set once, before the transport serves.
  [[nodiscard]] Partition* partition() const { return partition_; }
  /// Whether another process has the partition now.
  [[nodiscard]] bool out() const { return out_.load(std::memory_order_relaxed); }
  /// @return kPartitionTaken if out().
  [[nodiscard]] Result<void> check_owns_partition();
  /// Calls `use` with the rules, under the structure's lock; for calls without outputs.
  template <class Use>
  auto with_rules(Use use) {
    const Lock lock(structure_.mutex);
    return use(member_);
  }
  /// Of the own partition; 0 if there is none.
  [[nodiscard]] std::uint64_t incarnation() {
    return with_rules([](const Member& member) { return member.presence().incarnation; });
  }

  // ---- changes

  /// Announces changes made here to others.
  void tell(const Deadline& deadline);
  /// Waits until the changes of a request are stored here, if required.
  [[nodiscard]] Result<void> await_stored(const Deadline& deadline);
  /// Whether the loop that stores and announces changes does a round in time, failed or not.
  [[nodiscard]] bool responds(const Deadline& deadline);
  /// While a change of an own frame is not stored, neither its existence nor its absence is
  /// reported.
  [[nodiscard]] Error unless_unsaved(Error error, const std::string& id);

  /// @return a handle; the listener ends when its last copy is destroyed
  [[nodiscard]] std::shared_ptr<void> on_change(Events::Callback listener);
  /// Reports only that another process has taken the partition.
  [[nodiscard]] std::shared_ptr<void> on_taken(Events::Callback listener);

 private:
  [[nodiscard]] std::shared_ptr<void> subscribe(Events::Callback listener);

  // CommitLoop::Effects
  [[nodiscard]] Ready take(bool values_due) override;
  void publish(const Ready& ready) override;
  void take_back(const Ready& ready) override;
  void reply(const PendingReply& pending) override;

  /// Passes the rules to `input`, under the lock of the structure.
  template <class Input>
  void input(Input input);
  /// As input(), and under that of joints.
  template <class Input>
  void input_of_joints(Input input);
  void announce(Presence presence);
  [[nodiscard]] Outcome take_outcome() TFDUDE_REQUIRES(structure_.mutex);
  void react(const Outcome& outcome);
  void report_clocks(const Presence& appeared);
  /// Why changes are rejected while earlier ones cannot be stored.
  [[nodiscard]] std::optional<Error> refusal() const;

  Structure& structure_;
  Transport& transport_;
  const std::string name_;
  Listeners& listeners_;
  Member member_ TFDUDE_GUARDED_BY(structure_.mutex);
  Partition* partition_ = nullptr;  // owned by member_
  std::atomic<bool> out_{false};
  std::atomic<bool> clocks_reported_{false};
  const std::shared_ptr<Events> events_;
  Mutex joints_mutex_{LockRank::kJoints};  // guards the joints of partition_
  // Both stop before the transport does.
  std::optional<CommitLoop> commits_;  // set once, before partition_
  Loop::Job gone_looks_;               // last: it uses the other members
};

}  // namespace tfdude
