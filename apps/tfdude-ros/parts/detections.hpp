#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../logic/detections.hpp"
#include "../logic/error_reports.hpp"
#include "../ros_domain.hpp"
#include "frames_in.hpp"

namespace tfdude::ros {

/// Makes the objects that a topic's messages have seen frames.
class ObjectTaker {
 public:
  /// @param node, frames  outlive it
  ObjectTaker(Node& node, FramesIn& frames, const DetectionsIn& settings)
      : node_(node), frames_(frames), settings_(settings), import_(settings) {}

  /// @param is_own  as for FramesIn. @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  /// Nothing is taken any more. Logs the counts.
  void stop();

 private:
  void take(const DetectionImport::Sightings& sightings, const std::string& writer);
  [[nodiscard]] Result<void> observe(const DetectionImport::Sighting& one);
  void drop();

  Node& node_;
  FramesIn& frames_;
  const DetectionsIn settings_;
  DetectionImport import_;
  std::uint64_t accepted_ = 0;
  std::uint64_t rejected_ = 0;  // by the gate
  std::uint64_t failed_ = 0;
  std::uint64_t dropped_ = 0;  // frames
  ErrorReports errors_;
  cli::Worker worker_{100};  // last: it uses the other members
};

}  // namespace tfdude::ros
