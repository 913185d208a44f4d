#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../logic/error_reports.hpp"
#include "../logic/poses.hpp"
#include "../logic/stamps.hpp"
#include "../ros_domain.hpp"

namespace tfdude::ros {

/// Sends one path with its covariance.
class PoseSender {
 public:
  /// @param node  outlives it, and so does the domain. @return kTransport.
  [[nodiscard]] static Result<std::unique_ptr<PoseSender>> start(Node& node, RosDomain& domain,
                                                                 const PoseOut& settings);
  ~PoseSender();
  PoseSender(const PoseSender&) = delete;
  PoseSender& operator=(const PoseSender&) = delete;

 private:
  PoseSender(Node& node, PoseOut settings, std::unique_ptr<Publisher> publisher);

  void run();
  /// Until the path is no longer followed.
  void send(const PathWatch& path);
  void publish(const StampedTransform& X);
  void log(const Error& why);
  /// @return false if it is to stop
  bool pause();

  Node& node_;
  const PoseOut settings_;
  std::unique_ptr<Publisher> publisher_;
  ErrorReports errors_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;  // last: it uses the other members
};

/// Observes what a topic measures.
class PoseObserver {
 public:
  /// @param node  outlives it
  PoseObserver(Node& node, PoseIn settings) : node_(node), settings_(std::move(settings)) {}

  /// @param is_own  as for FramesIn. @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  /// Nothing is taken any more. Logs the answers.
  void stop();

 private:
  void take(const PoseWithCovariance& message, const std::string& child);
  void take(const GeoPose& message);
  /// @return whether the partitions have answered
  bool observe(const Result<Measurement>& measured);

  Node& node_;
  const PoseIn settings_;
  std::uint64_t accepted_ = 0;
  std::uint64_t rejected_ = 0;  // by the gate
  std::uint64_t failed_ = 0;
  std::uint64_t placeless_ = 0;
  ErrorReports errors_;
  StampReports stamps_;
  std::optional<PoseWithCovariance> last_;
  std::optional<GeoPose> last_place_;
  cli::Worker worker_{100};  // last: it uses the other members
};

}  // namespace tfdude::ros
