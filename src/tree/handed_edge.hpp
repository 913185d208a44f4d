#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"
#include "tfdude/types/edge.hpp"

#include "tree/shared_correlation.hpp"

namespace tfdude {

/// A sample of an edge that is handed over.
struct HandedSample {
  Time stamp{};
  Transform X_PC;
  std::optional<SampleRevision> revision{};  ///< if an observation has corrected it
  /// The last observation of what the edge was observed with had this sample, too; otherwise it may
  /// have been left out since.
  bool is_row = false;
  bool made_up = false;  ///< the owner has made up the stamp; only of the newest such sample
};

enum class HandedState : std::uint8_t {
  kStatic = 1,     ///< the value holds for all times
  kUnsampled = 2,  ///< dynamic, and had no sample yet
  kCleared = 3,    ///< its history was cleared, and has no next sample yet
  kSampled = 4,    ///< its samples give its values
};

/// All that an owner knows of an edge, for another owner that goes on with it.
struct HandedEdge {
  std::string id;
  std::string parent;              ///< empty: a root
  std::uint64_t lamport_time = 0;  ///< when the frame got its parent
  HandedState state = HandedState::kStatic;
  bool left_behind = false;            ///< its only sample is the last one of an earlier process
  std::optional<EdgeTiming> timing{};  ///< absent: that of its owner, from its first sample on
  Transform X_PC;                      ///< the newest value, without what `now` says
  Correlation said{};
  std::optional<Correlation> now{};  ///< as observations have left it
  std::vector<HandedSample> samples{};
  bool continues = false;  ///< more samples follow in the next part
};

/// A frame that another partition owns from now on.
struct HandedFrame {
  std::string id;
  std::string parent;
  std::uint64_t lamport_time = 0;
};

}  // namespace tfdude
