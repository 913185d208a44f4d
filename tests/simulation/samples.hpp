#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/types/query.hpp"

namespace tfdude::simulation {

/// What one client knows of the samples of an edge that only it writes, and what lookups may
/// therefore return. The translation of sample number n is (0, n, 0); number 0 is the value without
/// a stamp that the edge had at first.
///
/// Samples are numbered in the order in which they are sent, and a later one is sent only when an
/// earlier one has arrived or is lost. The clock of the source may jump back by more than an owner
/// keeps; each jump begins an era.
class Samples {
 public:
  /// A rule that was broken; empty: none.
  struct Broken {
    std::string kind;
    std::string what;
    [[nodiscard]] bool empty() const { return kind.empty(); }
  };

  /// Begins an era.
  void jump_back() { ++era_; }
  /// The time of the source's clock, which shows simulated time besides its jumps.
  [[nodiscard]] Time clock(std::chrono::nanoseconds now) const;

  /// A sample is sent. @return its number
  std::size_t send(Time stamp);
  [[nodiscard]] std::size_t size() const { return samples_.size(); }
  /// Whether some process has certainly taken a sample of this era.
  [[nodiscard]] bool era_is_taken() const;
  [[nodiscard]] Time stamp(std::size_t number) const { return samples_[number].stamp; }

  /// Whether a sample of this era with a later stamp was sent before.
  [[nodiscard]] bool came_late(std::size_t number) const;

  /// A process has taken a sample.
  [[nodiscard]] Broken taken(std::size_t number, std::uint64_t by);
  /// A process has rejected a sample.
  [[nodiscard]] Broken rejected(std::size_t number, std::uint64_t by, const Error& why);
  /// A process was asked for the value at an instant, or for the newest, after all samples so far.
  [[nodiscard]] Broken answered(std::optional<Time> at, std::uint64_t by,
                                const Result<StampedTransform>& X);

  /// How often a history has certainly restarted.
  [[nodiscard]] std::size_t restarts() const { return restarts_; }

 private:
  struct Sample {
    Time stamp;
    int era = 0;
    std::uint64_t taken_by = 0;  // a process; 0: not known
    bool rejected = false;
  };
  /// A sample that a process may have, or certainly has.
  struct Kept {
    std::size_t number = 0;
    Time stamp;
    bool certain = false;
  };
  using History = std::vector<Kept>;  // by stamp

  [[nodiscard]] std::optional<int> era_of(std::uint64_t process) const;
  [[nodiscard]] std::size_t sent_in(int era) const;
  [[nodiscard]] bool may_be_in(int era) const;
  [[nodiscard]] History history_of(std::uint64_t process) const;
  [[nodiscard]] Broken judge_static(const StampedTransform& X, std::uint64_t by) const;
  [[nodiscard]] Broken judge_newest(const StampedTransform& X, std::uint64_t by);
  [[nodiscard]] Broken judge_at(Time at, const StampedTransform& X, std::uint64_t by) const;
  [[nodiscard]] Broken judge_error(std::optional<Time> at, std::uint64_t by,
                                   const Error& error) const;

  std::vector<Sample> samples_{{Time{}, 0, 0, true}};
  int era_ = 0;
  std::map<std::pair<int, std::uint64_t>, std::size_t> rejected_;  // in an era, by a process
  std::size_t restarts_ = 0;
};

}  // namespace tfdude::simulation
