#pragma once

#include <functional>
#include <memory>
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

/// Sends the time of tf-dude's external clock to /clock, again and again, so that nodes that start
/// later have it.
class ClockOut {
 public:
  /// @param node  outlives it
  ClockOut(Node& node, double rate) : node_(node), rate_(rate) {}

  /// @param domain  outlives it until stop(). @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain);
  void stop();

 private:
  void send();

  Node& node_;
  const double rate_;  // [Hz]
  std::unique_ptr<Publisher> publisher_;
  cli::Worker worker_{10};  // last: it uses the other members
};

}  // namespace tfdude::ros
