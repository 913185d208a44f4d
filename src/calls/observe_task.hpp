#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calls/call.hpp"
#include "partition/observing.hpp"

namespace tfdude {

/// A measurement of a path.
struct Measurement {
  std::string a;
  std::string b;
  Transform X_AB;
  std::optional<Time> stamp;
  ObserveOptions options;
};

/// What a client knows from its earlier observations.
struct EarlierObservations {
  std::vector<std::string> settled;  ///< sources of those that all owners have applied
  /// Edges that had a new value when others still had the error of their observation.
  std::vector<std::string> rewritten;
};

/// Applies a measurement: asks for all edges of the path at one instant, computes their
/// corrections, and sends each owner its share. If an edge has changed meanwhile, or its owner
/// cannot be reached any more, it takes back what others have applied; after a change it does all
/// of this again.
class ObserveTask final : public Task {
 public:
  /// @param determined  the frame whose edge takes all of it, whatever its value was; empty: none
  /// @param source  a name of the measurement's error that no other has that begins with
  ///   kObservedPrefix and when it has begun [ns], so that others know whether it is under way
  /// @param asks_for_frames  the participant does not keep all frames
  ObserveTask(const Forest& forest, Measurement measurement, std::string determined,
              std::string source, EarlierObservations earlier, bool asks_for_frames,
              const TimeLimit& limit);

  [[nodiscard]] std::vector<std::string> frames() const override;
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override {
    return stage_ < Stage::kFirst ? plan_.parts : shares_;
  }
  [[nodiscard]] bool changes() const override { return stage_ >= Stage::kFirst; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;
  [[nodiscard]] bool may_plan_again() const override { return stage_ < Stage::kFirst; }
  [[nodiscard]] Milliseconds pause() const override { return pause_; }

  /// Once it is done.
  [[nodiscard]] Observed& observed() { return observed_; }
  /// The name of the measurement's error at the owners, once it is done.
  [[nodiscard]] const std::string& source() const { return source_; }
  /// The edges that it has waited for in vain.
  [[nodiscard]] const std::vector<std::string>& rewritten() const { return rewritten_; }
  /// Whether it could not wait for another observation, or correct all edges beside the path: the
  /// result is right, but less certain than both together allow (observe_beside_others()).
  [[nodiscard]] bool beside_others() const { return !absent_.empty() || !path_.lacking.empty(); }

 private:
  enum class Stage {
    kNewest,   ///< asks for the newest values, or those at the stamp
    kInstant,  ///< asks for the values at the latest common time
    kFirst,    ///< the first owner is asked to apply its share
    kOthers,   ///< and then all others
    kPresent,  ///< one has not: asks those that have for what they have now
    kTakeBack,
  };

  /// Whether another observation may not have reached all owners yet.
  [[nodiscard]] bool is_under_way(const std::string& source, Clock::time_point now) const;
  [[nodiscard]] bool awaits_others(const ObservedPath& path, Clock::time_point now);
  [[nodiscard]] Result<Next> values(std::vector<Reply> replies, Clock::time_point now);
  [[nodiscard]] Result<Next> observe(const ObservedPath& path, Clock::time_point now);
  /// The edges of the path; that which the measurement determines is unspecified.
  [[nodiscard]] Result<std::vector<ObservedEdge>> edges_of(const ObservedPath& path) const;
  [[nodiscard]] Result<Next> apply(const ObservedPath& path, const Observation& found);
  [[nodiscard]] Result<Next> first(Reply reply);
  [[nodiscard]] Result<Next> others(const std::vector<Reply>& replies);
  [[nodiscard]] Result<Next> present(std::vector<Reply> replies);
  [[nodiscard]] Result<Next> taken_back(const std::vector<Reply>& replies);
  [[nodiscard]] Result<Next> again();
  /// Leaves edges beside the path out whose owners have not answered. @return whether there are any
  [[nodiscard]] bool leave_out_silent(const std::vector<Reply>& replies);

  const Forest& forest_;
  const Measurement measurement_;
  const std::string determined_;
  const std::string begin_;  // the name that it began with
  const EarlierObservations earlier_;
  const bool asks_for_frames_;
  const TimeLimit limit_;
  Stage stage_ = Stage::kNewest;
  ObservePlan plan_;
  std::vector<std::string> beside_;    // edges that were observed with some of the path
  std::vector<std::string> unknown_;   // further ones, of which others have been asked
  std::vector<std::string> left_out_;  // edges that were, but cannot be corrected now
  ObservedPath path_;
  std::vector<Part> shares_;
  std::vector<Part> later_;          // shares of all owners but the first
  std::vector<Part> applied_;        // shares that owners have applied
  std::size_t owners_ = 0;           // that have a share
  Error refused_{};                  // why another one has not
  std::vector<std::string> absent_;  // edges beside the path that are left out, but still exist
  Observed observed_;
  std::string source_;  // of this attempt
  int attempts_ = 0;
  std::vector<std::string> awaited_;  // sources of other observations
  Clock::time_point awaited_since_{};
  int waits_ = 0;
  std::vector<std::string> rewritten_;
  std::optional<Clock::time_point> begun_;  // when it was planned first
  Milliseconds pause_{0};
};

}  // namespace tfdude
