#pragma once

#include <optional>
#include <string>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/joint_spec.hpp"

namespace tfdude {

/// A frame as a configuration describes it. An empty parent makes it a root.
struct FrameSpec {
  std::string id;
  std::string parent;
  Transform X_PC;
  std::optional<EdgeTiming> timing{};  ///< absent: the partition's default
  Correlation correlation{};
  /// The joint that moves the frame. It also determines the value before the first sample.
  std::optional<JointSpec> joint{};
};

/// A frame and its place in the structure.
struct Frame {
  std::string id;
  std::string parent;     ///< empty: a root
  std::string partition;  ///< the owner
  bool attached = false;  ///< its parent exists
};

/// One partition's share of a path.
struct PathSegment {
  std::string partition;
  std::string from;
  std::string to;
  std::optional<ClockKind> clock{};  ///< as of PartitionInfo
};

}  // namespace tfdude
