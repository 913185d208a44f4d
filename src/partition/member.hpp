#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "partition/directory.hpp"
#include "partition/incarnation.hpp"
#include "partition/name_claim.hpp"
#include "partition/partition.hpp"
#include "partition/ready.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// One participant as a state machine: its knowledge of the others, and the partition that it owns,
/// if any. Inputs are messages, requests and time. Outputs are Ready, the actions to perform, and
/// Outcome, for its own process. No threads, no I/O, no clock, no randomness.
///
/// @par Thread safety  None: the caller serializes all functions. Those marked [joints] also change
///   the state of joints.
class Member {
 public:
  using Steady = Absences::Steady;

  /// @param own  the partition to own; empty: none
  Member(Forest& forest, Directory& directory, std::string own)
      : forest_(forest), directory_(directory), name_(std::move(own)) {}

  // ---- received messages

  void on_page(const Page& page);
  void on_presence(const Presence& presence, Time now);
  /// @param early  as of Absences::mark_absent()
  void on_lost(const std::string& partition, std::uint64_t incarnation, Time now,
               std::chrono::nanoseconds early = {});
  /// Call at least twice per Absences::kGrace while a partition is silent.
  void on_time(Steady now);

  /// Handles a request of a peer other than a lookup. [joints]
  /// @param rejection  why no changes may be made now: earlier ones could not be stored
  /// @return the reply to send at once; empty if it follows with Ready, after its changes are
  ///   stored
  [[nodiscard]] std::optional<Reply> on_request(const PeerId& from, const Request& request,
                                                const std::optional<Error>& rejection, Time now);

  // ---- requests of its own process

  /// As on_request(), for its own process, which sees its changes before they are stored. [joints]
  [[nodiscard]] Reply answer(const Request& request, const std::optional<Error>& rejection,
                             Time now);
  /// As Partition::release(). [joints]
  [[nodiscard]] Result<void> release(const std::vector<std::string>& ids, Time now);
  /// Drops everything about an unreachable partition. @return kPartitionTaken if it is reachable.
  [[nodiscard]] Result<void> forget(const std::string& partition, Time now);

  /// What would have to be yielded according to current knowledge. O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields() const;
  /// Yields those of `due` that still have to be yielded. [joints]
  /// @param current  whether all changes have come that the others had made when `due` was found
  void yield(const std::set<PendingYield>& due, bool current, Time now);

  // ---- becoming an owner

  /// Claims the partition's name.
  /// @param random  a different number for each process
  void claim(const std::string& host, std::uint32_t pid, Time now, std::uint64_t random);
  [[nodiscard]] const NameClaim& name_claim() const { return claim_; }
  /// After claim(): its stamps are of an external clock.
  void use_external_clock() { presence_.clock = Time{}; }
  /// Announces that it has taken the name.
  void take_name() { presence_.taken = true; }
  /// Serves the partition, with the frames that an earlier process left, if they are stored, and
  /// the changes of the configuration. [joints]
  /// @return the error of the first invalid frame
  [[nodiscard]] Result<void> serve(const StoredState* left,
                                   const std::vector<FrameSpec>& configured, Time now);
  /// Gives up the name.
  /// @return the last presence to announce; empty if none was announced before
  [[nodiscard]] std::optional<Presence> leave();
  /// The own presence, to announce before anything has to be stored.
  [[nodiscard]] Presence introduce() { return announced_ = presence_; }

  // ---- actions

  /// Everything to store or announce since the last call, except for the values, which
  /// Partition::add_values() adds. Call stored() or not_stored() afterwards. [joints]
  /// @param values_due  as of Partition::take_unsaved()
  [[nodiscard]] Ready take_ready(bool values_due = false);
  /// @return the presence to announce after the pages are published
  [[nodiscard]] std::optional<Presence> stored(const Ready& ready);
  /// The next take_ready() returns it again, without the replies. [joints]
  /// @return the presence to announce all the same: absences do not depend on what is stored
  [[nodiscard]] std::optional<Presence> not_stored(const Ready& ready);
  [[nodiscard]] Outcome take_outcome();

  // ---- state

  /// Null before it serves.
  [[nodiscard]] Partition* partition() { return partition_.get(); }
  [[nodiscard]] const Presence& presence() const { return presence_; }
  /// Whether all changes of the own structure are stored, and announced or about to be.
  [[nodiscard]] bool told() const {
    return partition_ == nullptr || partition_->epoch() == told_epoch_;
  }
  /// Why another process has the partition now; empty: it has not.
  [[nodiscard]] const std::string& given_up() const { return given_up_; }
  /// As Directory::partitions(), with what only this process knows of the own one.
  [[nodiscard]] std::vector<PartitionInfo> partitions() const;

 private:
  void on_own_presence(const Presence& presence);
  void give_up(const Presence& rival);
  void overtake(Time now);
  void look_for_contests();
  void compare_plans();

  Forest& forest_;
  Directory& directory_;
  const std::string name_;
  std::unique_ptr<Partition> partition_;
  Presence presence_;
  Presence announced_;  // as last announced
  NameClaim claim_;
  IncarnationSource incarnations_;
  std::string given_up_;
  bool stores_ = false;
  std::pair<std::uint64_t, std::uint64_t> planned_with_{};  // versions at the last outcome
  std::uint64_t told_epoch_ = 0;                            // of the published structure
  std::map<std::pair<PeerId, std::uint32_t>, PendingReply> replies_;
  bool to_settle_ = false;  // a handover may go on
  Outcome outcome_;
};

}  // namespace tfdude
