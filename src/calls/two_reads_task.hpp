#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "calls/call.hpp"
#include "partition/observing.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Asks for the edges of two paths, each at an instant of its own, or of one path at two instants.
/// What one owner says is of one state: no value is from before a change and another one from after
/// it. The answers tell which edges are dynamic.
class TwoReadsTask final : public Task {
 public:
  struct Read {
    std::string a;
    std::string b;
    Query query;  ///< of an instant, or of edges that are static
  };

  /// How often owners are asked anew that commit something between the two reads, before the values
  /// are compared; and after that.
  static constexpr int kTriesForOneCommit = 5;
  static constexpr int kMostTries = 15;

  /// @param timed  stamps that an owner has made up do not count, as LookupRequest::timed
  TwoReadsTask(const Forest& forest, Read first, Read second, bool timed)
      : forest_(forest), reads_{std::move(first), std::move(second)}, timed_(timed) {}

  [[nodiscard]] std::vector<std::string> frames() const override;
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  /// @return also kChangedMeanwhile
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;

  /// Once it is done: of the first read, 0, or the second one, 1.
  [[nodiscard]] const ObservePlan& planned(std::size_t read) const { return plans_[read]; }
  [[nodiscard]] const ObservedPath& path(std::size_t read) const { return paths_[read]; }

 private:
  using Answers = std::vector<SegmentValues>;

  void ask_both();
  [[nodiscard]] bool are_of_one_state() const;
  [[nodiscard]] bool is_first_unchanged(const Answers& again) const;
  [[nodiscard]] Result<Next> conclude();

  const Forest& forest_;
  const std::array<Read, 2> reads_;
  const bool timed_;
  std::array<ObservePlan, 2> plans_;
  std::array<Answers, 2> answers_;
  std::array<ObservedPath, 2> paths_;
  std::vector<Part> parts_;
  bool asks_first_again_ = false;
  int tries_ = 0;
};

}  // namespace tfdude
