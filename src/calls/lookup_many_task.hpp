#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "tfdude/types/many.hpp"

#include "calls/lookup_in_progress.hpp"

namespace tfdude {

/// Many lookups at one common instant. Each owner is asked once for all segments that it owns. If
/// it has an error, it is asked for fewer at a time, until the error is that of a single segment,
/// and so of the pairs whose path it is on. Such pairs do not count for the common instant.
class LookupManyTask final : public Task {
 public:
  using Found = Result<StampedTransform>;

  LookupManyTask(const Forest& forest, ClockKind own, SharedHints& hints,
                 std::vector<FramePair> pairs, const Query& query);

  [[nodiscard]] std::vector<std::string> frames() const override;
  /// @return the error of a pair that may still be discovered
  [[nodiscard]] Result<void> plan(const Directory& directory, Clock::time_point now) override;
  [[nodiscard]] std::vector<Part>& parts() override { return parts_; }
  [[nodiscard]] Result<Next> take(std::vector<Reply> replies, Clock::time_point now) override;

  /// After plan() has failed: all pairs with such an error have it for good. @return whether there
  /// are any
  [[nodiscard]] bool settle(const Error& last);
  /// Ends all pairs that have no answer.
  void fail_all(const Error& error);

  /// Once it is done.
  [[nodiscard]] std::vector<Found>& found() { return found_; }

 private:
  struct Segment {
    std::optional<Error> error;
    std::size_t group = 0;  // that answers for it, and its place there
    std::size_t place = 0;
  };
  // Segments of one owner that are asked for together.
  struct Group {
    Owner owner = kHeldHere;
    std::string partition;
    std::string id;  // of the request
    std::vector<std::size_t> segments;
    std::optional<SegmentValues> answer;
    bool slowest = false;  // its newest instant is the latest common time
  };
  struct Pair {
    std::optional<LookupPlan> plan;     // its parts with its own segments only
    std::vector<std::size_t> segments;  // all of them, by part
    std::optional<Error> error;
    bool settled = false;
  };

  void add_segments(std::size_t i);
  void ask();
  void divide(Group group);
  [[nodiscard]] Result<void> take_reply(Group group, Reply reply);
  [[nodiscard]] bool drop_failed();
  void note_errors();
  [[nodiscard]] bool again_at_one_instant(Clock::time_point now);
  [[nodiscard]] bool again_without_slowest();
  void restart();
  [[nodiscard]] Found assembled(const Pair& pair) const;
  void finish();

  const Forest& forest_;
  const ClockKind own_;
  SharedHints& hints_;
  const std::vector<FramePair> pairs_;
  const Query query_;
  std::string key_;  // of all pairs, for the hints
  std::vector<Pair> planned_;
  std::vector<PathEnds> ends_;  // of the segments
  std::vector<Segment> segments_;
  std::map<std::tuple<Owner, std::string, std::string, std::size_t>, std::size_t> known_;
  std::vector<Group> groups_;   // answered
  std::vector<Group> asked_;    // by parts_
  std::vector<Group> too_old_;  // without data at the latest common time
  std::vector<Part> parts_;
  std::optional<Time> at_;  // for which is asked now
  std::optional<Time> hint_;
  Clock::time_point planned_at_;
  std::string differs_;  // that an owner has another clock
  int refusals_ = 0;     // replies that the plan is outdated
  std::vector<Found> found_;
};

}  // namespace tfdude
