#include "tree/edge_marks.hpp"

#include <algorithm>
#include <iterator>
#include <string>

#include "tree/held_edges.hpp"
#include "tree/sample_rows.hpp"

namespace tfdude {
namespace {

template <class Edge>
std::vector<std::string> marks_of(const Edge& edge, const Name& name) {
  return {edge.samples().drifts() ? 3U : 2U, std::string(name.text)};
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
      with = marks_of(OwnEdge{edge}, *edge->name);
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
      found.correlations[i].observed_with = marks_of(edge, *here.name);
      if (!timed_since || edge.version->lacks_sample()) return;
      all = edge.samples().is_timed_since(nanoseconds(*timed_since), edge.version->number);
    });
  }
  return all;
}

}  // namespace tfdude
