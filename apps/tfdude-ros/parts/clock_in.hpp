#pragma once

#include <functional>
#include <string>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../ros_domain.hpp"

namespace tfdude::ros {

/// Passes the time of /clock on to all participants of tf-dude's domain that have an external
/// clock.
class ClockIn {
 public:
  /// @param node  outlives it
  explicit ClockIn(Node& node) : node_(node) {}

  /// @param is_own  as for FramesIn. @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  /// Nothing is passed on any more.
  void stop() { worker_.stop(); }

 private:
  void take(Time now);

  Node& node_;
  std::string logged_;
  cli::Worker worker_{10};  // last: it uses the other members
};

}  // namespace tfdude::ros
