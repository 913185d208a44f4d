#pragma once

#include <chrono>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/node.hpp"

#include "net/floor_dds.hpp"
#include "net/harness.hpp"

// The robot that the benchmarks of pushed paths push, and bare samples for comparison.
namespace bench {

inline constexpr const char* kBase = "base";

/// A chain: the parent of the first frame is the base, that of each other frame is the one before.
inline std::string joint(int number) { return "joint_" + std::to_string(number); }

/// The owner of such a chain; all of its joints move at once.
class PushedRobot {
 public:
  PushedRobot(int joints, const tfdude::Options& options) : node_(open(joints, options)) {
    for (int i = 0; i < joints; ++i) edges_.push_back({must(node_.find(joint(i)), "a joint"), {}});
  }

  /// The stamp is the moment just before the update, by shared_clock().
  void move() {
    ++steps_;
    const double half_angle = 0.0005 * steps_;  // 1 rad/s at 1 kHz
    const Eigen::Quaterniond turn(std::cos(half_angle), 0, 0, std::sin(half_angle));
    for (auto& edge : edges_) edge.X_PC = {tfdude::Pose::trusted(turn, {0, 0, 0.1}), noise_};
    check(node_.update(edges_, tfdude::Time(Clock::now().time_since_epoch())), "update");
  }

 private:
  static tfdude::Node open(int joints, const tfdude::Options& options) {
    std::vector<tfdude::FrameSpec> frames{{kBase, "", {}}};
    for (int i = 0; i < joints; ++i) frames.push_back({joint(i), i > 0 ? joint(i - 1) : kBase, {}});
    return must(tfdude::Node::open("robot", frames, options), "a node");
  }

  tfdude::Node node_;
  std::vector<tfdude::HandleUpdate> edges_;
  tfdude::Covariance noise_ =
      must(tfdude::Covariance::from_stddev({1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3}), "a covariance");
  int steps_ = 0;
};

/// Ignores all samples.
class NoListener final : public fastdds::edds::DataReaderListener {};

/// Sends samples of a size in the way in which values are pushed, to all listeners.
class BareSender {
 public:
  BareSender(std::uint32_t domain, const std::string& profile, std::uint32_t bytes)
      : endpoints_(domain, profile, sending_end(), listener_) {
    ping_.filler().resize(bytes - kPingOverhead);
  }

  /// The sample begins with the moment of the call, as PushedRobot's stamps.
  void send(Clock::time_point called = Clock::now()) {
    const std::int64_t stamp = std::chrono::nanoseconds(called.time_since_epoch()).count();
    std::memcpy(ping_.filler().data(), &stamp, sizeof stamp);
    endpoints_.write(ping_);
  }

 private:
  NoListener listener_;
  wire::Ping ping_;
  FloorEndpoints endpoints_;
};

}  // namespace bench
