#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// Whom a participant misses: what it noticed itself, what others have told it, and what an earlier process of its
/// partition has left. Short silences are told apart from absences, which have consequences. Not thread-safe.
class Absences {
 public:
  using Steady = std::chrono::steady_clock::time_point;

  /// A silence is an absence, and one that has stopped counts as outlived, once it has lasted for this long after it
  /// was noticed. Else who has hung itself, and then hears at once how another stopped and started again, would seem to
  /// have outlived that.
  static constexpr std::chrono::milliseconds kGrace{500};

  /// After so long its frames are those of who claims them as well. That is later, so that all know the absence by then: what
  /// the other acknowledges as their owner is not lost to one that returns in between.
  static constexpr std::chrono::milliseconds kTakeover{700};

  /// How many are kept. The oldest go first.
  static constexpr std::size_t kMost = 256;

  /// A partition that was there is not heard any more, or has said that it ends.
  void went(const std::string& partition, std::uint64_t incarnation, bool stopped, Time now);

  /// Another one, `teller`, misses a partition that was not met here. What is only told counts once it has stood for kGrace:
  /// else who has hung itself, and hears late what others said meanwhile, would take it for its own experience. It stands
  /// from the first word of a silence on, so that it counts here when it does at the others.
  void told(const Absent& absent, const std::string& teller);
  /// These are all whom the teller misses now. A silence that it has told, and does not tell any more, is over.
  void told_all(const std::vector<Absent>& absent, const std::string& teller);
  /// Of one that is missed a later incarnation was heard of.
  void heard_of(const std::string& partition, std::uint64_t incarnation);
  /// It was missed when this process's predecessor ended.
  void resume(const Absent& absent);

  /// It is there. @return whether it was missed
  bool returned(const std::string& partition);

  /// Of one that is back: nothing that it claims is this participant's any more.
  void resolved(const std::string& partition);

  /// Nothing is to be kept of a partition that is not there.
  void forget(const std::string& partition, std::uint64_t incarnation, Time now);

  struct Looked {
    bool counts = false;            ///< an absence counts that did not before
    std::vector<std::string> gone;  ///< have been away for kTakeover now
  };
  /// To be called at least twice in kGrace while any_pending(): time in which it was not does not count.
  Looked look(Steady now);

  /// Whether the time is to be watched.
  [[nodiscard]] bool any_pending() const;
  /// Whether something that others have told does not count yet.
  [[nodiscard]] bool any_hearsay() const;
  [[nodiscard]] std::vector<std::string> back() const;
  [[nodiscard]] std::optional<Absent> find(const std::string& partition) const;

  /// Sorted by name; without what was told just now.
  [[nodiscard]] std::vector<Absent> all() const;

  /// Whether an absence of this kind gives who notices it the frames that both claim.
  [[nodiscard]] static bool outlived(Absent::Kind kind) {
    return kind == Absent::Kind::kLost || kind == Absent::Kind::kStopped ||
           kind == Absent::Kind::kBack;
  }

 private:
  struct Missed {
    Absent absent;
    Absent::Kind then;  // what a silence becomes; a silence: the teller does not know yet
    std::optional<Steady> noticed;  // of a silence
    std::string teller{};           // of hearsay, which is not told on
    bool pending = false;           // until it counts as gone
  };
  void put(const std::string& partition, std::uint64_t incarnation, Time now, Absent::Kind kind,
           Absent::Kind then);
  void limit();

  std::map<std::string, Missed> missed_;
  std::optional<Steady> looked_;
};

}  // namespace tfdude
