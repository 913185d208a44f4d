#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/recording/transform_counts.hpp"

#include "recording/messages.hpp"

namespace tfdude::recording {

/// Which transforms of a recording of ROS are taken: the rules of the bridge for repeated stamps,
/// jumps of time and cycles. A recording does not say who published a transform.
/// @par Memory  The stamps of the last second of each edge, 2 million in total.
class ForeignTransforms {
 public:
  using Report = std::function<void(std::string)>;

  /// Takes the next message, in the order in which they were logged. Values that are not taken are
  /// removed. A value without a stamp is static.
  /// @param report  is told what is unusual, in sentences for people; of a frame more than once
  void take(std::vector<RecordedValue>& values, TransformCounts& counts, const Report& report);

 private:
  struct Seen {
    Time stamp;
    std::size_t pose = 0;  // its hash
  };
  struct Edge {
    const Edge* parent = nullptr;  // none: a root so far
    bool is_parent = false;        // or was
    bool is_static = true;
    std::deque<Seen> seen{};          // by stamp
    std::optional<Time> forgotten{};  // the newest stamp that there was no room for
  };

  [[nodiscard]] bool takes(RecordedValue& value, TransformCounts& counts, const Report& report);
  [[nodiscard]] bool takes_sample(RecordedValue& value, Edge& edge, TransformCounts& counts,
                                  const Report& report);
  /// @return what the parent is below; null if the edge can be below the parent
  [[nodiscard]] static const char* why_not_below(const Edge& parent, const Edge& edge);
  void forget_some(Edge& edge) const;

  std::unordered_map<std::string, Edge> edges_;  // by child; also of roots
};

}  // namespace tfdude::recording
