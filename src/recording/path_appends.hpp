#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "recording/state.hpp"

namespace tfdude::recording {

/// Tells which messages only append samples to edges of a path, or do not concern it. Whether such
/// messages are applied before or after a lookup at an instant makes no difference to its answer,
/// once there is one that is not extrapolated.
class PathAppends {
 public:
  PathAppends(std::string_view a, std::string_view b) : a_(a), b_(b) {}

  /// The state has changed by another message than these, or is another one.
  void begin(const State& state);
  /// @param message  that comes next
  [[nodiscard]] bool only_appends(const State& state, const RecordedMessage& message);

 private:
  [[nodiscard]] std::optional<Time>* newest_of(const RecordedEdge& edge);

  const std::string a_;
  const std::string b_;
  bool connected_ = false;
  std::unordered_map<std::string, std::optional<Time>> newest_;  // of the edges of the path
  // Of edges by their numbers; null: the path does not have it.
  struct Place {
    bool known = false;
    std::optional<Time>* newest = nullptr;
  };
  std::vector<Place> places_;
};

}  // namespace tfdude::recording
