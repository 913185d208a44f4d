#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calls/call.hpp"
#include "partition/observing.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Asks for the edges of several paths, each at an instant of its own, or of one path at several
/// instants. What one owner says is of one state: no value is from before a change and another one
/// from after it. The answers tell which edges are dynamic.
class OneStateTask final : public Task {
 public:
  struct Read {
    std::string a;
    std::string b;
    Query query;  ///< of an instant, or of edges that are static
  };

  /// How often owners are asked anew that commit something between the reads, before the values are
  /// compared; and after that.
  static constexpr int kTriesForOneCommit = 5;
  static constexpr int kMostTries = 15;

  /// @param reads  at least one
  /// @param timed  stamps that an owner has made up do not count, as LookupRequest::timed
  OneStateTask(const Forest& forest, std::vector<Read> reads, bool timed)
      : forest_(forest),
        reads_(std::move(reads)),
        timed_(timed),
        plans_(reads_.size()),
        answers_(reads_.size()),
        paths_(reads_.size()) {}

  [[nodiscard]] std::vector<std::string> frames() const override;
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  /// @return also kChangedMeanwhile
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;

  // Once it is done, of the read with this number:
  [[nodiscard]] const ObservePlan& planned(std::size_t read) const { return plans_[read]; }
  [[nodiscard]] const ObservedPath& path(std::size_t read) const { return paths_[read]; }
  /// X_AB.
  [[nodiscard]] Pose pose(std::size_t read) const;

 private:
  using Answers = std::vector<SegmentValues>;

  void ask_all();
  void ask_again_but_the_last();
  [[nodiscard]] bool are_of_one_state() const;
  /// @param again  of all reads but the last, after that
  [[nodiscard]] bool are_unchanged(const std::vector<Answers>& again) const;
  [[nodiscard]] Result<Next> conclude();

  const Forest& forest_;
  const std::vector<Read> reads_;
  const bool timed_;
  std::vector<ObservePlan> plans_;
  std::vector<Answers> answers_;
  std::vector<ObservedPath> paths_;
  std::vector<Part> parts_;
  bool compares_ = false;  // all reads but the last are asked again
  int tries_ = 0;
};

}  // namespace tfdude
