#include "tree/edge_marks.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>

#include "tree/held_edges.hpp"
#include "tree/sample_rows.hpp"

namespace tfdude {
namespace {

constexpr std::size_t kMoves = 2;
constexpr std::size_t kDrifts = 3;
constexpr std::size_t kDriftsCorrected = 4;

// Whether an observation has corrected a sample, or one from which it follows. Others have a
// revision, too, if they follow without noise, or a watcher was told of them.
bool is_corrected(const Sample& sample) {
  const SharedRevision* revision = sample.revision();
  if (revision == nullptr) return false;
  const RowInfo& row = revision->row;
  return row.observed || row.follows != RowInfo{}.follows || row.told != Told::kNot;
}

// @return nothing if it cannot be read
template <class Edge>
std::optional<std::size_t> count_of_marks(const Edge& edge, std::optional<Time> at) {
  const HeldVersion& version = *edge.version;
  const auto samples = edge.samples();
  if (!samples.drifts()) return kMoves;
  if (!at || version.lacks_sample()) return kDrifts;
  const std::int64_t t = nanoseconds(*at);
  const bool is_newest = t >= version.stamp;
  SampleHistory::Bracket found{is_newest ? samples.sample(version.number) : nullptr, nullptr};
  std::uint64_t back = 0;
  if (!is_newest) found = samples.around(t, version.number, back);
  if (found.before == nullptr) return kDrifts;
  if (found.before->stamp == t) found.after = nullptr;
  typename decltype(samples)::Copies copies;
  if (!samples.make_whole(found, copies)) return std::nullopt;
  const bool corrected = is_corrected(*found.before);
  // Between what was corrected and what was not, the value follows from neither.
  if (found.after != nullptr && corrected != is_corrected(*found.after)) return kMoves;
  return corrected ? kDriftsCorrected : kDrifts;
}

std::vector<std::string> marks(std::size_t count, const Name& name) {
  return {count, std::string(name.text)};
}

}  // namespace

void tell_observed_with(const std::vector<Ends>& edges, Rows rows, SegmentValues& found) {
  const auto edge_of = [](const Ends& ends) -> const HeldVersion* {
    const Version* child = ends.a->depth > ends.b->depth ? ends.a : ends.b;
    return child->held() ? static_cast<const HeldVersion*>(child) : nullptr;
  };
  found.correlations.resize(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const HeldVersion* edge = edge_of(edges[i]);
    if (edge == nullptr) continue;
    if (edge->moving() && !edge->unsampled()) {
      auto& with = found.correlations[i].observed_with;
      const OwnEdge own{edge};
      // Observations tell the rows instead.
      const std::size_t of_drift = own.samples().drifts() ? kDrifts : kMoves;
      const auto count = rows == Rows::kNone ? count_of_marks(own, found.stamp) : of_drift;
      with = marks(count.value_or(kMoves), *edge->name);
      if (!found.stamp) continue;
      const auto others = tell_rows(*edge, i, nanoseconds(*found.stamp), rows, found);
      std::copy_if(others.begin(), others.end(), std::back_inserter(with),
                   [&](const std::string& id) { return id != edge->name->text; });
    } else if (edge->correlation != nullptr) {
      found.correlations[i].observed_with = edge->correlation->now().observed_with;
    }
  }
}

bool tell_motion(const std::vector<Ends>& edges, std::optional<Time> timed_since,
                 RemoteReading& reading, SegmentValues& found) {
  found.correlations.resize(edges.size());
  bool all = true;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    for_each_edge(edges[i], reading, [&](const Version& here, const auto& edge) {
      all = all && edge.version != nullptr;
      if (!all || !edge.version->moving() || edge.version->unsampled()) return;
      const auto count = count_of_marks(edge, found.stamp);
      all = count.has_value();
      if (!all) return;
      found.correlations[i].observed_with = marks(*count, *here.name);
      if (!timed_since || edge.version->lacks_sample()) return;
      all = edge.samples().is_timed_since(nanoseconds(*timed_since), edge.version->number);
    });
  }
  return all;
}

}  // namespace tfdude
