#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "partition/absences.hpp"
#include "partition/partition.hpp"
#include "support/memory_store.hpp"
#include "support/owning.hpp"
#include "support/random.hpp"
#include "support/replica.hpp"

namespace tfdude::testing {

/// Owners that change, die, hang, return and are forgotten at random, and a participant that only
/// listens (the spectator). Messages between two participants arrive in order, after a random time.
class AbsencesWorld {
 public:
  /// How often the cases occurred that the test is about.
  struct Counts {
    std::size_t kept = 0;
    std::size_t inherited = 0;
    std::size_t removed = 0;
    std::size_t forgotten = 0;
    std::size_t conflicts = 0;
  };

  AbsencesWorld(Random& random, Counts& counts);

  void step();
  /// Delivers all messages; unreachable partitions count as gone.
  void run_until_quiet();
  /// Requires that all serving owners and the spectator agree on the owners of frames.
  void demand_agreement();
  void return_all();

 private:
  static constexpr std::size_t kOwners = 4;
  static constexpr std::size_t kSpectator = kOwners;
  static constexpr std::size_t kFrames = 8;  // few, so that owners often compete for them

  struct Silence {
    std::string partition;
    std::uint64_t incarnation = 0;
  };
  using Said = std::variant<Presence, Page, Silence>;
  using Way = std::pair<std::size_t, std::size_t>;  // from an owner to a hearer

  struct LiveOwner : Owning {
    using Owning::Owning;
    bool hangs = false;
    bool announced = false;
  };

  static std::string name(std::size_t who) { return "p" + std::to_string(who); }
  Time now() { return Time(std::chrono::milliseconds(++clock_)); }

  bool there(std::size_t who) const { return owners_[who] != nullptr; }
  bool serves(std::size_t who) const { return there(who) && !owners_[who]->hangs; }
  bool deaf(std::size_t who) const { return who != kSpectator && !serves(who); }
  /// Whether one owner reports another one as lost.
  bool misses(std::size_t who, std::size_t whom) const;
  Replica& replica(std::size_t who) {
    return who == kSpectator ? spectator_ : owners_[who]->replica;
  }
  /// The frames of reachable owners.
  std::vector<std::string> owned_by_those_there(const Replica& replica) const;
  /// Frames without a reachable owner; some may belong to an unreachable one.
  std::vector<FrameSpec> some_free_frames();
  /// The frames that an owner holds, or has stored, and when they got their parents.
  std::map<std::string, std::uint64_t> claimed_by(std::size_t who);
  /// Those of them that others have removed while it was away.
  std::set<std::string> removed_frames_of(std::size_t who);
  /// The frames of serving owners that the returning one claims, too.
  std::vector<std::pair<std::string, std::size_t>> claims_of_others(std::size_t who);

  // What happens to an owner.
  void start(std::size_t who, bool configured);
  void change(std::size_t who);
  void end(std::size_t who);
  void hang(std::size_t who);
  void blink(std::size_t who);
  void come_back(std::size_t who);
  void forget(std::size_t who);

  // Messages.
  void publish(std::size_t who);
  void say(const Way& way, const Said& said) { queues_[way].push_back(said); }
  void say_to_all(std::size_t who, const Said& said);
  static void lose(std::deque<Said>& queue);
  bool deliver_one();
  void heard(std::size_t hearer);
  void drain();
  /// Lets so much time pass that unreachable partitions count as gone.
  void grow_late();

  Random& random_;
  Counts& counts_;
  std::array<std::unique_ptr<LiveOwner>, kOwners> owners_;
  std::array<MemoryStore, kOwners> stores_;
  std::array<std::vector<Absent>, kOwners> absent_;
  std::vector<FrameSpec> configured_;  // of the owner that was started last
  std::array<std::uint64_t, kOwners> last_life_{};
  std::set<std::size_t> knew_;
  Replica spectator_;
  std::map<Way, std::deque<Said>> queues_;
  std::uint64_t lives_ = 0;
  std::size_t clock_ = 0;
  Absences::Steady steady_{};
};

}  // namespace tfdude::testing
