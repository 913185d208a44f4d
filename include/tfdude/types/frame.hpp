#pragma once

#include <optional>
#include <string>

#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"
#include "tfdude/types/edge.hpp"
#include "tfdude/types/joint_spec.hpp"

namespace tfdude {

/// A frame as a configuration gives it; an empty parent makes a root.
struct FrameSpec {
  std::string id;
  std::string parent;
  Transform X_PC;
  std::optional<EdgeTiming> timing{};  ///< absent: the partition's
  Correlation correlation{};
  /// What moves it; then that says what its value is before the first sample.
  std::optional<JointSpec> joint{};
};

/// A frame and where it stands.
struct Frame {
  std::string id;
  std::string parent;     ///< empty: a root
  std::string partition;  ///< the owner
  bool attached = false;  ///< its parent is there
};

/// One partition's share of a path.
struct PathSegment {
  std::string partition;
  std::string from;
  std::string to;
};

}  // namespace tfdude
