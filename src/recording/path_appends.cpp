#include "recording/path_appends.hpp"

#include <algorithm>

namespace tfdude::recording {

void PathAppends::begin(const State& state) {
  newest_.clear();
  const auto edges = state.forest().edges(a_, b_);
  connected_ = edges.has_value();
  if (!connected_) return;
  for (const FrameInfo& edge : *edges) {
    const auto history = state.forest().histories(edge.id);
    newest_[edge.id] = history.empty() ? std::nullopt : history.front().newest;
  }
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
      const auto known = state.forest().info(one.edge.id);
      if (!known || known->parent != one.edge.parent) return false;
    }
  }
  if (!connected_) return true;
  for (const RecordedValue& one : values->values) {
    const auto edge = newest_.find(one.edge.id);
    if (edge == newest_.end()) continue;
    const WatchedValue& value = one.value;
    const bool appends = value.stamp && edge->second && *value.stamp > *edge->second &&
                         !value.begins && !value.cleared && !value.unsampled &&
                         value.correlation == Correlation();
    if (!appends) return false;
    edge->second = value.stamp;
  }
  return true;
}

}  // namespace tfdude::recording
