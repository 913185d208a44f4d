#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "partition/member.hpp"
#include "runtime/commit_loop.hpp"
#include "runtime/deadline.hpp"
#include "runtime/deferred.hpp"
#include "runtime/events.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Runs the rules of a participant: hands them what happens, one input at a time, has what comes out stored, published and
/// replied in this order (CommitLoop), and tells the parts of this process what has changed.
///
/// Locks, in the order in which they may be taken: that of the structure, that of joints. None is held while anything is
/// sent, nor while the parts are told.
/// @par Thread safety  All functions, by callers that hold none of these locks; open(), serve() and publish_all() by the
///   thread that makes this participant an owner.
class MemberRunner final : private CommitLoop::Effects {
 public:
  using Clock = std::chrono::steady_clock;

  /// Told what has changed, by whoever brought the change.
  struct Parts {
    std::function<void()> on_routes;  ///< frames are elsewhere, or with others
    std::function<void()> on_others;  ///< another partition came or went
    std::function<void(const std::string& partition)> on_gone;  ///< was stopped, or is lost
    std::function<void()> on_contest;                           ///< a yield may be pending
  };

  /// @param partition  the one that it is to own; empty: none
  MemberRunner(Structure& structure, Transport& transport, std::string partition, Parts parts);
  ~MemberRunner() override { stop(); }
  MemberRunner(const MemberRunner&) = delete;
  MemberRunner& operator=(const MemberRunner&) = delete;

  /// No listener runs any more.
  void stop_events() { events_->stop(); }
  /// Stores and tells what there is; what comes later is not done.
  void stop();

  // ---- what happens

  void on_page(const Page& page);
  void on_presence(const Presence& presence);
  void on_lost(const std::string& partition, std::uint64_t incarnation);
  /// A request of a peer. @return the reply to send at once; nothing where it follows once what it rests on is stored
  [[nodiscard]] std::optional<Reply> on_request(const PeerId& from, const Request& request);
  /// A request of this process.
  [[nodiscard]] Reply answer(const Request& request);
  /// @return as Member::forget
  [[nodiscard]] Result<void> forget(const std::string& partition);
  /// Positions of joints. @return how many were taken; kInvalidInput
  [[nodiscard]] Result<std::size_t> apply(const JointUpdate& update);
  /// The same without waiting. @return kTimeout, too, where another thread does the same
  [[nodiscard]] Result<std::size_t> try_apply(const JointUpdate& update);

  /// @return as Member::yield
  void yield(const std::set<PendingYield>& due, bool current);

  // ---- how it becomes an owner

  /// From now on what is changed here is stored, where there is a store, and told.
  void open(std::unique_ptr<StateStore> store, Milliseconds save_every);
  /// @return as Member::serve
  [[nodiscard]] Result<void> serve(const StoredState* left,
                                   const std::vector<FrameSpec>& configured);
  /// Stores, publishes and announces all, on this thread. @return kState
  [[nodiscard]] Result<void> publish_all(const std::vector<FrameSpec>& configured);
  /// Announces what it is now.
  void introduce();
  /// Announces that it ends, if it has ever said that it is there.
  void say_goodbye();

  // ---- what it is

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Null before it serves. Set once, before the transport serves.
  [[nodiscard]] Partition* partition() const { return partition_; }
  /// Whether another process has the partition now.
  [[nodiscard]] bool out() const { return out_.load(std::memory_order_relaxed); }
  /// @return kPartitionTaken once it is so.
  [[nodiscard]] Result<void> still_in();
  /// Hands the rules to `use`, for what brings nothing out, under the structure's lock.
  template <class Use>
  auto with_rules(Use use) {
    const Lock lock(structure_.mutex);
    return use(member_);
  }

  // ---- what was changed

  /// Has what was changed here told to others.
  void tell(const Deadline& deadline);
  /// Waits until what a request has changed here is stored, if it is to be.
  [[nodiscard]] Result<void> await_stored(const Request& request, const Deadline& deadline);
  /// Where an own frame is not stored, neither that it is there nor that it is gone is said.
  [[nodiscard]] Error unless_unsaved(Error error, const std::string& id);

  /// @return what ends it when its last copy goes
  [[nodiscard]] std::shared_ptr<void> on_change(Events::Callback listener);

 private:
  // CommitLoop::Effects
  [[nodiscard]] Ready take() override;
  void publish(const Ready& ready) override;
  void take_back(const Ready& ready) override;
  [[nodiscard]] ChangedValues take_values() override;
  void take_back(const ChangedValues& values) override;
  void reply(const PendingReply& reply) override;

  /// Under the lock of the structure,
  template <class Input>
  void input(Input input);
  /// and that of joints, too.
  template <class Input>
  void input_of_joints(Input input);
  [[nodiscard]] Outcome take_outcome();
  void react(const Outcome& outcome);
  void look_for_gone();
  /// Why a change is refused as long as what was changed before it cannot be stored.
  [[nodiscard]] std::optional<Error> refusal() const;

  Structure& structure_;
  Transport& transport_;
  const std::string name_;
  const Parts parts_;
  Member member_;                   // under the structure's lock
  Partition* partition_ = nullptr;  // the member's
  std::atomic<bool> out_{false};
  const std::shared_ptr<Events> events_ = std::make_shared<Events>();
  Mutex joints_mutex_;              // what partition_ knows of joints
  std::uint64_t saved_commit_ = 0;  // of values; of the thread of commits_
  // Both stop before the transport does.
  std::optional<CommitLoop> commits_;  // set once, before partition_
  Mutex gone_mutex_;                   // of the rest
  bool stopped_ TFDUDE_GUARDED_BY(gone_mutex_) = false;
  std::optional<Deferred> gone_look_ TFDUDE_GUARDED_BY(gone_mutex_);  // once somebody is silent
};

}  // namespace tfdude
