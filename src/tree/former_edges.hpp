#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "tree/frames.hpp"
#include "tree/past.hpp"

namespace tfdude {

/// The edges of some paths as they were at an earlier commit, in the structure of now, for the
/// functions that walk paths. Has as many samples as these need for a query.
class FormerEdges {
 public:
  FormerEdges() : store_(arena_) {}
  FormerEdges(const FormerEdges&) = delete;
  FormerEdges& operator=(const FormerEdges&) = delete;

  /// Call once, with the forest's lock, and while an epoch::Guard lives as long as this object.
  /// @param paths  in the newest commit
  /// @param past  null: nothing is kept
  /// @return kNotYet (Query::believed_at is ahead of the clock), kTooOld (naming an edge of which
  ///   what was believed then is not kept, and since when it is). O(kept samples of the edges).
  [[nodiscard]] Result<void> take(const std::vector<Ends>& paths, const Query& query,
                                  std::optional<Time> hint, const Past* past,
                                  const Forest::Clock& clock);

  /// The same paths.
  [[nodiscard]] const std::vector<Ends>& paths() const { return paths_; }

 private:
  struct Edge {
    const HeldVersion* now;
    HeldVersion* then;
    const EdgePast* past = nullptr;  // null: it has not changed since
    // The newest first. Null: there are fewer.
    const Sample* newest[2] = {nullptr, nullptr};
  };

  void copy(const Ends& path);
  [[nodiscard]] Result<void> go_back(Edge& edge, const Past& past, Time instant);
  void find_newest(Edge& edge) const;
  void take_samples(const Edge& edge, const std::vector<std::int64_t>& instants);
  [[nodiscard]] std::vector<std::int64_t> instants(const Query& query,
                                                   std::optional<Time> hint) const;
  template <class Visit>
  void for_each_sample(const Edge& edge, Visit visit) const;

  Arena arena_;
  SampleStore store_;  // of chunks; what their samples share belongs to the forest
  std::deque<HeldVersion> held_;
  std::deque<Version> others_;
  std::deque<Head> heads_;
  std::vector<SampleHistory::Pointer> histories_;
  std::vector<InArena<EdgeCorrelation>> correlations_;
  std::vector<Edge> edges_;
  std::vector<Ends> paths_;
  std::uint64_t commit_ = 0;
};

}  // namespace tfdude
