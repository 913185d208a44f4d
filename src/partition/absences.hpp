#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/base/time.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// The partitions that a participant misses: those that it noticed itself, those that others
/// reported, and those that an earlier process of its partition has stored. Distinguishes short
/// silences from absences, which have consequences. Not thread-safe.
class Absences {
 public:
  using Steady = std::chrono::steady_clock::time_point;

  /// A silence counts as an absence, and a stopped partition as survived, this long after it was
  /// noticed. Otherwise a process that has hung, and then hears at once that another one stopped
  /// and restarted, would seem to have survived it.
  static constexpr std::chrono::milliseconds kGrace{500};

  /// After this time, frames of the absent partition go to others that also claim them. It is
  /// longer than kGrace, so that all know of the absence by then. So changes that the new owner
  /// acknowledges are not lost to a partition that returns in between.
  static constexpr std::chrono::milliseconds kTakeover{700};

  /// Maximum number of entries. Hearsay is dropped first, then partitions that contest nothing
  /// here, each the oldest first; then the newest of the others.
  static constexpr std::size_t kMost = 256;

  /// @param contests  whether a partition may claim something that this participant holds, or has
  ///   removed
  explicit Absences(std::function<bool(const std::string& partition)> contests)
      : contests_(std::move(contests)) {}

  /// A partition no longer sends, or has announced its stop.
  /// @param early  by how much later others may notice it. It counts as gone that much later, so
  ///   that all know of the absence by then
  void mark_absent(const std::string& partition, std::uint64_t incarnation, bool stopped, Time now,
                   std::chrono::nanoseconds early = {});

  /// Another participant, `teller`, misses a partition that was not discovered here. Hearsay counts
  /// only after kGrace: otherwise a process that has hung, and hears late what others reported
  /// meanwhile, would take it for its own observation. The time starts with the first report of a
  /// silence, so that it counts here when it does at the others.
  void add_report(const Absent& absent, const std::string& teller);
  /// The complete list of those that the teller misses now. A silence that it no longer reports is
  /// over.
  void replace_reports(const std::vector<Absent>& absent, const std::string& teller);
  /// The teller was restarted, so it cannot say what has become of the silences that it reported:
  /// they count as losses.
  void teller_restarted(const std::string& teller);
  /// The teller has stopped or is lost. The silences that it reported are over, except those that
  /// were relied on: they count as losses, so that this participant tells them itself.
  void teller_gone(const std::string& teller);
  /// Messages of the missed partition were dropped, as whoever misses it will inform it.
  void relied_on(const std::string& partition);
  /// A later incarnation of a missed partition was heard of.
  void heard_of(const std::string& partition, std::uint64_t incarnation);
  /// The partition was missed when this process's predecessor ended.
  void resume(const Absent& absent);

  /// The partition is reachable. @return whether it was missed
  bool returned(const std::string& partition);

  /// Whether this participant holds nothing any more that a returned partition claims. It is told
  /// as survived for kGrace from then on: otherwise whoever hears that before the last words of the
  /// returned partition would take its earlier claims for valid again.
  void set_resolved(const std::string& partition, bool resolved);

  /// Drops everything about an unreachable partition.
  void forget(const std::string& partition, std::uint64_t incarnation, Time now);

  struct Looked {
    bool counts = false;            ///< an absence counts now that did not before, or no more
    std::vector<std::string> gone;  ///< partitions now absent for kTakeover
  };
  /// Call at least twice per kGrace while any_pending(); longer gaps between calls do not count.
  Looked look(Steady now);

  /// Whether look() must be called.
  [[nodiscard]] bool any_pending() const;
  /// Whether a report by others does not count yet.
  [[nodiscard]] bool any_hearsay() const;
  [[nodiscard]] std::vector<std::string> back() const;
  [[nodiscard]] std::optional<Absent> find(const std::string& partition) const;

  /// Sorted by name; without recent hearsay.
  [[nodiscard]] std::vector<Absent> all() const;

  /// Whether an absence of this kind gives the observer the frames that both claim.
  [[nodiscard]] static bool survived(Absent::Kind kind) {
    return kind == Absent::Kind::kLost || kind == Absent::Kind::kStopped ||
           kind == Absent::Kind::kBack;
  }

 private:
  struct Missed {
    Absent absent;
    Absent::Kind then{};            // what a silence becomes; kSilent: the teller does not know yet
    std::optional<Steady> noticed;  // of a silence, or of a return that is resolved
    std::string teller{};           // of hearsay, which is not passed on
    bool pending = false;           // until it counts as gone, or no more as survived
    bool relied_on = false;         // messages were dropped because of it
    std::chrono::nanoseconds early{};
  };
  void put(const std::string& partition, std::uint64_t incarnation, Time now, Absent::Kind kind,
           Absent::Kind then);
  /// @return whether it is not pending any more
  static bool advance(Missed& missed, Steady now, bool hung, Looked& looked);
  /// @param kept  the one entry that stays in any case
  void limit(const std::string& kept);

  const std::function<bool(const std::string&)> contests_;
  std::map<std::string, Missed> missed_;
  std::optional<Steady> looked_;
};

}  // namespace tfdude
