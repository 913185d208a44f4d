#include "recording/path_appends.hpp"

#include <algorithm>

namespace tfdude::recording {

void PathAppends::begin(const State& state) {
  newest_.clear();
  places_.clear();
  const auto edges = state.forest().edges(a_, b_);
  connected_ = edges.has_value();
  if (!connected_) return;
  for (const FrameInfo& edge : *edges) {
    const auto kept = state.forest().kept(edge.id);
    newest_[edge.id] = kept ? kept->time.stamp : std::nullopt;
  }
}

std::optional<Time>* PathAppends::newest_of(const RecordedEdge& edge) {
  if (places_.size() <= edge.number) places_.resize(edge.number + std::size_t{1});
  Place& place = places_[edge.number];
  if (!place.known) {
    const auto found = newest_.find(edge.id);
    place = {true, found != newest_.end() ? &found->second : nullptr};
  }
  return place.newest;
}

bool PathAppends::only_appends(const State& state, const RecordedMessage& message) {
  if (std::holds_alternative<RecordedJoints>(message.what)) return true;
  if (std::holds_alternative<Change>(message.what)) return true;
  const auto* values = std::get_if<RecordedValues>(&message.what);
  if (values == nullptr) return false;
  if (values->repeats) {
    // Needed only where nothing is known yet.
    return std::all_of(newest_.begin(), newest_.end(), [](const auto& one) { return one.second; });
  }
  // Values may imply frames.
  if (message.foreign) {
    for (const RecordedValue& one : values->values) {
      const auto known = state.forest().info(one.edge->id);
      if (!known || known->parent != one.edge->parent) return false;
    }
  }
  if (!connected_) return true;
  for (const RecordedValue& one : values->values) {
    std::optional<Time>* newest = newest_of(*one.edge);
    if (newest == nullptr) continue;
    const bool appends = one.is_sample() && *newest && *one.stamp > **newest;
    if (!appends) return false;
    *newest = one.stamp;
  }
  return true;
}

}  // namespace tfdude::recording
