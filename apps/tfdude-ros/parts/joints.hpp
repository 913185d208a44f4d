#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../logic/error_reports.hpp"
#include "../logic/joints.hpp"
#include "../ros_domain.hpp"

namespace tfdude::ros {

/// Passes /joint_states on to the owners of the joints.
class JointsIn {
 public:
  /// @param node  outlives it
  JointsIn(Node& node, const JointImportSettings& settings) : node_(node), import_(settings) {}

  /// @param is_own  as for FramesIn. @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  /// Nothing is taken any more. Logs what was not.
  void stop();

 private:
  void take(const JointState& message);

  Node& node_;
  JointImport import_;
  ErrorReports errors_;
  std::uint64_t not_sent_ = 0;  // messages, of which some joints may have been sent
  cli::Worker worker_;          // last: it uses the other members
};

/// Sends the joints of tf-dude to /joint_states.
class JointsOut {
 public:
  /// @param node  outlives it
  JointsOut(Node& node, const JointExportSettings& settings) : node_(node), export_(settings) {}

  /// @param domain  outlives it until stop(). @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  void stop();

 private:
  void send();

  Node& node_;
  JointExport export_;
  std::unique_ptr<Publisher> publisher_;
  std::set<std::string> told_;  // the joints that are not sent
  cli::Worker worker_;          // last: it uses the other members
};

}  // namespace tfdude::ros
