#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/types/frame.hpp"
#include "tfdude/types/options.hpp"
#include "tfdude/types/refused.hpp"

#include "runtime/advances.hpp"
#include "runtime/context.hpp"
#include "runtime/descriptions.hpp"
#include "runtime/explanations.hpp"
#include "runtime/joint_calls.hpp"
#include "runtime/lookups.hpp"
#include "runtime/many_lookups.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/memory_reads.hpp"
#include "runtime/observations.hpp"
#include "runtime/one_shots.hpp"
#include "runtime/queries.hpp"
#include "runtime/requests.hpp"
#include "runtime/serving.hpp"
#include "runtime/streams.hpp"
#include "runtime/two_instants.hpp"
#include "runtime/velocities.hpp"
#include "runtime/watch_client.hpp"
#include "runtime/watch_server.hpp"
#include "runtime/writes.hpp"
#include "runtime/yielding.hpp"

namespace tfdude {

/// One participant: its structure, its parts, and its transport, wired together. Passes each
/// message and each request of a client to the part responsible.
/// @par Thread safety  All functions are thread-safe, except start() and serve(), which are called
///   first, by one thread.
class Participant final : public TransportHandler,
                          private MemberRunner::Listeners,
                          private OwnPartition {
 public:
  /// @param partition  the partition to own; empty: none
  Participant(TransportPtr transport, std::string partition, const ParticipantOptions& options);
  ~Participant() override;
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  [[nodiscard]] Result<void> start();

  /// Stops all threads and leaves the network, as the destructor does: at exit. Then no function
  /// may be called.
  void end();
  /// As Client::end_waits().
  void end_waits();

  /// Makes this participant the owner of its partition. @return as Serving::serve()
  [[nodiscard]] Result<void> serve(const std::vector<FrameSpec>& frames);

  [[nodiscard]] SourceClock& clock() { return structure_.clock; }
  [[nodiscard]] Forest& forest() { return structure_.forest; }
  [[nodiscard]] Discovery& discovery() { return discovery_; }
  [[nodiscard]] MemberRunner& member() { return member_; }
  [[nodiscard]] Queries& queries() { return queries_; }
  [[nodiscard]] MemoryReads& memory() { return memory_; }
  [[nodiscard]] Writes& writes() { return writes_; }
  [[nodiscard]] JointCalls& joints() { return joints_; }
  [[nodiscard]] Observations& observations() { return observations_; }
  [[nodiscard]] WatchClient& watches() { return watches_; }
  [[nodiscard]] Lookups& lookups() { return lookups_; }
  [[nodiscard]] Velocities& velocities() { return velocities_; }
  [[nodiscard]] TwoInstants& two_instants() { return two_instants_; }
  [[nodiscard]] ManyLookups& many_lookups() { return many_lookups_; }
  [[nodiscard]] Explanations& explanations() { return explanations_; }
  [[nodiscard]] Descriptions& descriptions() { return descriptions_; }
  /// @return kInvalidInput in a client that follows only some frames
  [[nodiscard]] Result<Streams*> streams();

  /// As Forest::clear_history() and clear_histories(); watchers get the samples of before.
  [[nodiscard]] Result<void> clear_history(const std::string& id);
  std::size_t clear_histories(Time from, std::optional<Time> jumped_from = std::nullopt);
  /// Sets the external clock. If it jumps back, own values that are later do not hold any more.
  /// @return kInvalidInput
  /// @param by_itself  the process has determined the time, and not another one
  [[nodiscard]] Result<void> set_time(Time now, bool by_itself);
  /// Sends the time to others with an external clock, and sets the own one, if it is external.
  /// @return kInvalidInput; as Transport::publish_clock()
  [[nodiscard]] Result<void> publish_clock(Time now);
  /// The same, until all owners with an external clock show it. @return as Client::advance_to()
  [[nodiscard]] Result<void> advance_to(Time time, const Deadline& deadline);

  /// Waits until data sent on reliable streams is acknowledged. @return kTimeout, kTransport
  [[nodiscard]] Result<void> flush(Milliseconds wait) {
    return transport_->flush(Deadline(wait).at());
  }

  /// What limits have rejected.
  [[nodiscard]] RefusedCounts refused();
  /// Of Node.
  [[nodiscard]] bool responds(Milliseconds wait);

  // TransportHandler
  void on_request(const PeerId& from, const Request& request) override;
  void on_reply(const std::string& from, const Reply& reply) override {
    requests_.replies().on_reply(from, reply);
  }
  void on_update(const Update& update) override;
  void on_joints(const JointUpdate& update) override { joints_.on_joints(update); }
  void on_pushed(const PushedValues& pushed) override;
  void on_watcher(std::uint64_t group) override { watch_server_.on_watcher(group); }
  void on_page(const Page& page) override {
    if (wants_pages()) member_.on_page(page);
  }
  [[nodiscard]] bool wants_pages() const override { return !options_.follow.has_value(); }
  [[nodiscard]] bool wants_clock() const override {
    return structure_.clock.kind() == ClockKind::kExternal;
  }
  void on_clock(Time now) override { (void)set_time(now, false); }
  void on_presence(const Presence& presence) override { member_.on_presence(presence); }
  void on_lost(const std::string& partition, std::uint64_t incarnation,
               std::chrono::nanoseconds early) override {
    member_.on_lost(partition, incarnation, early);
  }
  [[nodiscard]] bool owns(std::string_view id) const override {
    return structure_.forest.holds(id);
  }
  [[nodiscard]] bool owns_joint(std::string_view name) const override;
  [[nodiscard]] bool owns_joints() const override;

 private:
  // MemberRunner::Listeners
  void on_routes() override;
  void on_gone(const std::string& partition) override { requests_.replies().on_lost(partition); }
  void on_contest() override { yielding_.ask(); }

  // OwnPartition
  [[nodiscard]] Reply answer_own(const Request& request) override;
  [[nodiscard]] std::optional<Reply> read(const Request& request) override {
    return memory_.read(request);
  }
  void announce_changes(const Deadline& deadline) override { member_.tell(deadline); }
  [[nodiscard]] Result<void> await_stored(const Deadline& deadline) override {
    return member_.await_stored(deadline);
  }
  [[nodiscard]] Result<void> check_owns_partition() override {
    return member_.check_owns_partition();
  }

  void stop();
  [[nodiscard]] std::optional<Requests::Follow> follow();
  /// Others have committed something. @return when to call again
  [[nodiscard]] Loop::Clock::time_point look_in_memory();
  [[nodiscard]] Reply answer_frames(const Request& request);
  /// The reply to a request that changes nothing; empty for other requests.
  [[nodiscard]] std::optional<Reply> answer_query(const Request& request,
                                                  const std::optional<PeerId>& from);

  const ParticipantOptions options_;
  ProcessMemory process_memory_;
  Structure structure_;
  TransportPtr transport_;
  Threads threads_;
  const Context context_;
  Discovery discovery_;
  MemberRunner member_;
  Requests requests_;
  MemoryReads memory_;
  OneShots one_shots_;
  Yielding yielding_;
  Serving serving_;
  Queries queries_;
  Writes writes_;
  JointCalls joints_;
  Observations observations_;
  WatchClient watches_;
  WatchServer watch_server_;
  Lookups lookups_;
  Velocities velocities_;
  TwoInstants two_instants_;
  ManyLookups many_lookups_;
  Explanations explanations_;
  Descriptions descriptions_;
  Advances advances_;
  std::atomic<std::uint64_t> jumps_{0};  // of the clock
  std::once_flag ended_;
  Streams streams_;
};

}  // namespace tfdude
