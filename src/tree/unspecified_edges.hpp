#pragma once

#include <cstdint>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "tree/frames.hpp"
#include "tree/held_edge.hpp"
#include "tree/remote_edges.hpp"

namespace tfdude {

/// Edges that others hold end a walk with an error.
struct OwnEdgesOnly {
  static constexpr bool kNone = true;
};

// Whether a sample is unspecified. One that was dropped meanwhile, or cannot be read, may be.
// @param as_given  or was, before an observation determined it
template <class Samples>
bool is_unspecified(const Samples& samples, const Sample* sample, bool as_given = false) {
  SampleHistory::Bracket one{sample, nullptr};
  typename Samples::Copies copies;
  if (sample == nullptr || !samples.make_whole(one, copies) || !one.before->complete()) return true;
  const SharedRevision* revision = one.before->revision();
  return as_given && revision != nullptr && !revision->given.covariance.complete();
}

// Whether a sample that the value at that instant is computed from is unspecified.
template <class Edge>
bool is_unspecified_at(const Edge& from, std::int64_t t) {
  const HeldVersion& edge = *from.version;
  const bool newest = !edge.X_PC.covariance.complete();
  if (!edge.moving() || edge.unsampled() || t == edge.stamp) return newest;
  const auto samples = from.samples();
  if (t > edge.stamp) {
    // The twist is that of the samples as they were given, but for an edge that drifts.
    const bool as_given = !samples.drifts();
    return newest || is_unspecified(samples, samples.sample(edge.number - 1), as_given) ||
           (as_given && is_unspecified(samples, samples.sample(edge.number), true));
  }
  std::uint64_t back = 0;
  const auto found = samples.around(t, edge.number, back);
  if (is_unspecified(samples, found.before)) return true;
  return found.before->stamp != t && is_unspecified(samples, found.after);
}

/// The ids of the edges of a path whose covariance is unspecified at an instant, in the order from
/// a to b; at least one. For a path that was walked at that instant, or, if it has no dynamic
/// edges, at any. The caller holds an epoch::Guard. Allocates: only for paths of which it is known
/// that they have some.
/// @param others  as for walk(): OwnEdgesOnly, or RemoteReading
template <class Others>
std::vector<std::string> unspecified_edges(const Ends& ends, std::int64_t t, Others& others) {
  std::vector<std::string> up;
  std::vector<std::string> down;  // from b
  const auto is_named = [&](const Version& here) {
    if (here.held()) return is_unspecified_at(OwnEdge{static_cast<const HeldVersion*>(&here)}, t);
    if constexpr (!Others::kNone) {
      const RemoteEdge edge = others.find(here);
      return edge.version != nullptr && is_unspecified_at(edge, t);
    }
    return false;
  };
  const Version* a = ends.a;
  const Version* b = ends.b;
  const Version* last = nullptr;
  while (a != b) {
    const bool from_a = a->depth >= b->depth;
    const Version*& here = from_a ? a : b;
    if (here->above == nullptr) break;
    last = here;
    if (is_named(*here)) (from_a ? up : down).emplace_back(here->name->text);
    here = Frames::at(*here->above, ends.commit);
  }
  // Others take the covariance for complete if they get no name.
  if (up.empty() && down.empty() && last != nullptr) up.emplace_back(last->name->text);
  up.insert(up.end(), std::make_move_iterator(down.rbegin()), std::make_move_iterator(down.rend()));
  return up;
}
inline std::vector<std::string> unspecified_edges(const Ends& ends, std::int64_t t) {
  OwnEdgesOnly own_edges;
  return unspecified_edges(ends, t, own_edges);
}

}  // namespace tfdude
