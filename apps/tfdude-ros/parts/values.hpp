#pragma once

#include <cstdint>
#include <string>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../logic/error_reports.hpp"
#include "../logic/stamps.hpp"
#include "../logic/values.hpp"
#include "../ros_domain.hpp"
#include "frames_in.hpp"

namespace tfdude::ros {

/// Takes the poses of a topic as values of an edge.
class ValueTaker {
 public:
  /// @param node, frames  outlive it
  ValueTaker(Node& node, FramesIn& frames, ValueIn settings)
      : node_(node), frames_(frames), settings_(std::move(settings)) {}

  /// @param is_own  as for FramesIn. @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  /// Nothing is taken any more. Logs the counts.
  void stop();

 private:
  void take(const PoseWithCovariance& message, const std::string& child, const std::string& writer);
  void take(const GeoPose& message, const std::string& writer);
  /// Takes the value of the child's own edge.
  [[nodiscard]] Result<void> replace(const Result<TransformStamped>& value,
                                     const std::string& writer);
  /// The edge of the frame above the child, by the child's pose in that frame at the same instant.
  /// @param frame  of the message
  [[nodiscard]] Result<void> determine(Result<Measurement> value, const std::string& frame);
  void count(const Result<void>& done);

  Node& node_;
  FramesIn& frames_;
  const ValueIn settings_;
  std::uint64_t taken_ = 0;
  std::uint64_t failed_ = 0;
  std::uint64_t placeless_ = 0;
  ErrorReports errors_;
  StampReports stamps_;
  cli::Worker worker_{100};  // last: it uses the other members
};

}  // namespace tfdude::ros
