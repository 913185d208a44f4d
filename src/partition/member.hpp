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

/// One participant as a state machine: what it knows of the others, and the partition that it owns, if any. Inputs go in
/// (what it hears, what it is asked for, time); what is to be done comes out as Ready, and what its own process has to look
/// at as Outcome. No threads, no I/O, no clock, no randomness.
///
/// @par Thread safety  None: the caller serializes all functions. Those marked [joints] change what the partition knows of
///   joints, too.
class Member {
 public:
  using Steady = Absences::Steady;

  /// @param own  the partition that it is to own; empty: none
  Member(Forest& forest, Directory& directory, std::string own)
      : forest_(forest), directory_(directory), name_(std::move(own)) {}

  // ---- what it hears

  void on_page(const Page& page);
  void on_presence(const Presence& presence, Time now);
  void on_lost(const std::string& partition, std::uint64_t incarnation, Time now);
  /// To be called at least twice in Absences::kGrace while somebody is silent.
  void on_time(Steady now);

  /// A request of a peer that is not answered by lookups alone. [joints]
  /// @param refusal  why changes are not to be made now: what was changed before could not be stored
  /// @return the reply to send at once; nothing where it follows with Ready, after what it rests on
  [[nodiscard]] std::optional<Reply> on_request(const PeerId& from, const Request& request,
                                                const std::optional<Error>& refusal, Time now);

  // ---- what its own process asks for

  /// The same of its own process, which sees its changes before they are stored. [joints]
  [[nodiscard]] Reply answer(const Request& request, const std::optional<Error>& refusal, Time now);
  /// Nothing is kept of a partition that is not there. @return kPartitionTaken where it is.
  [[nodiscard]] Result<void> forget(const std::string& partition, Time now);

  /// What would have to be yielded as far as is known now. O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields() const;
  /// Gives up what of these still stands. [joints]
  /// @param current  whether all has come that the others had changed when `due` was found
  void yield(const std::set<PendingYield>& due, bool current, Time now);

  // ---- how it becomes an owner

  /// It wants the partition's name from now on.
  /// @param random  another number for each process
  void claim(const std::string& host, std::uint32_t pid, Time now, std::uint64_t random);
  [[nodiscard]] const NameClaim& name_claim() const { return claim_; }
  /// It says that it has taken the name.
  void take_name() { presence_.taken = true; }
  /// It has the name, and these frames: those of the state that an earlier process has left, where one is kept, and what the
  /// configuration changes of that. [joints]
  /// @return the first frame's error
  [[nodiscard]] Result<void> serve(const StoredState* left,
                                   const std::vector<FrameSpec>& configured, Time now);
  /// It has no name any more.
  /// @return the last word, to be announced; nothing where nothing was said
  [[nodiscard]] std::optional<Presence> leave();
  /// What it says of itself now, to be announced before there is anything to store.
  [[nodiscard]] Presence introduce() { return announced_ = presence_; }

  // ---- what is to be done

  /// All that is to be stored or told since the last call; what follows it is stored() or not_stored(). [joints]
  [[nodiscard]] Ready take_ready();
  /// @return what to announce once the pages are published
  [[nodiscard]] std::optional<Presence> stored(const Ready& ready);
  /// The next take_ready() gives it again, but for the replies. [joints]
  /// @return what to announce all the same: who is missed has nothing to do with what is stored
  [[nodiscard]] std::optional<Presence> not_stored(const Ready& ready);
  /// Of values that nobody waits for, those that may be stored alone. Where a frame hangs elsewhere and that is not stored
  /// yet, its value goes with that: else it would be kept where the frame was before.
  [[nodiscard]] std::vector<ChangedEdge> storable(std::vector<ChangedEdge> edges) const;
  [[nodiscard]] Outcome take_outcome();

  // ---- what it is

  /// Null before it serves.
  [[nodiscard]] Partition* partition() { return partition_.get(); }
  [[nodiscard]] const Presence& presence() const { return presence_; }
  /// Why another process has the partition now; empty: it has not.
  [[nodiscard]] const std::string& given_up() const { return given_up_; }

 private:
  void on_own_presence(const Presence& presence);
  void give_up(const Presence& rival);
  void overtake(Time now);
  void look_for_contests();

  Forest& forest_;
  Directory& directory_;
  const std::string name_;
  std::unique_ptr<Partition> partition_;
  Presence presence_;
  Presence announced_;  // as it was said last
  NameClaim claim_;
  IncarnationSource incarnations_;
  std::string given_up_;
  bool stores_ = false;
  std::uint64_t told_epoch_ = 0;  // of what was published
  std::map<std::pair<PeerId, std::uint32_t>, PendingReply> replies_;
  Outcome outcome_;
};

}  // namespace tfdude
