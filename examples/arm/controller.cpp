// Shows how a controller uses tf-dude. It drives the arm of examples/robots/mobile_arm.urdf along a
// path at 1 kHz, while its base drives in a circle. Sines replace the encoders of a robot.
//
//   arm_controller [--seconds S] [--domain N] [--local | --profile FILE]
//                  [--discovery-server HOST:PORT]

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <tfdude/client/client.hpp>

namespace {

using namespace std::chrono_literals;
using tfdude::Result;
using tfdude::Time;

const std::vector<std::string> kJoints{"shoulder_pan_joint", "shoulder_lift_joint",
                                       "elbow_joint",        "wrist_1_joint",
                                       "wrist_2_joint",      "wrist_3_joint"};
constexpr std::array<double, 6> kMean{0.0, -1.2, 1.6, -2.0, -1.57, 0.0};  // [rad]
constexpr std::array<double, 6> kReach{0.8, 0.3, 0.4, 0.3, 0.5, 1.5};     // [rad]
// Of the encoders [rad²]: their standard deviation is 0.05 degrees, in the wrist 0.1 degrees.
const std::vector<double> kVariances{7.6e-7, 7.6e-7, 7.6e-7, 3.0e-6, 3.0e-6, 3.0e-6};

// The readings of the encoders at time t [s].
std::vector<double> positions(double t) {
  std::vector<double> q(kJoints.size());
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i] = kMean[i] + kReach[i] * std::sin((0.4 + 0.1 * static_cast<double>(i)) * t);
  }
  return q;
}

// The odometry at time t [s]: a circle with a radius of 0.5 m, and standard deviations of 5 mm and
// 0.2 degrees.
Result<tfdude::Transform> base(double t) {
  const auto uncertainty = tfdude::Covariance::from_stddev({0.005, 0.005, 0, 0, 0, 0.0035});
  if (!uncertainty) return tl::unexpected(uncertainty.error());
  const Eigen::Vector3d place(0.5 * std::sin(0.2 * t), 0.5 - 0.5 * std::cos(0.2 * t), 0);
  const auto X_WB = tfdude::Pose::create(tfdude::from_rpy(0, 0, 0.2 * t), place);
  if (!X_WB) return tl::unexpected(X_WB.error());
  return tfdude::Transform{*X_WB, *uncertainty};
}

// Publishes one cycle. All values have the same stamp, so a lookup of the tool gets base and arm at
// the same instant.
Result<void> publish(tfdude::Client& client, double t) {
  const Time now = std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
  const auto X_WB = base(t);
  if (!X_WB) return tl::unexpected(X_WB.error());
  auto sent = client.publish_joints(kJoints, positions(t), kVariances, now);
  if (auto base_sent = client.publish({{"base_link", *X_WB}}, now); sent) sent = base_sent;
  return sent;
}

int run(const tfdude::Options& options, double seconds) {
  auto client = tfdude::Client::open(options);
  if (!client) {
    std::fprintf(stderr, "arm_controller: %s\n", client.error().message.c_str());
    return 1;
  }
  std::string trouble;
  const auto start = std::chrono::steady_clock::now();
  auto next = start;
  for (double t = 0; t < seconds; t = std::chrono::duration<double>(next - start).count()) {
    const auto sent = publish(*client, t);
    // An unreachable daemon may return; until then the other one still gets its values.
    const std::string problem = sent ? "" : sent.error().message;
    if (problem != trouble) {
      std::fprintf(stderr, "arm_controller: %s\n",
                   sent ? "all owners are reachable" : problem.c_str());
    }
    trouble = problem;
    // Missed cycles are skipped.
    next = std::max(next + 1ms, std::chrono::steady_clock::now());
    std::this_thread::sleep_until(next);
  }
  return trouble.empty() ? 0 : 1;
}

// @return whether the whole text is a number
bool read_number(const std::string& text, double& number) {
  char* end = nullptr;
  number = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == 0;
}

// @return whether the arguments are right
bool read_arguments(int argc, char** argv, tfdude::Options& options, double& seconds) {
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--local") {
      options.profile = tfdude::kLocalProfile;
      continue;
    }
    if (++i == argc) return false;
    const std::string value = argv[i];
    double domain = 0;
    if (name == "--seconds") {
      if (!read_number(value, seconds) || !(seconds > 0)) return false;
    } else if (name == "--domain") {
      if (!read_number(value, domain) || !(domain >= 0 && domain <= 232)) return false;
      options.domain = static_cast<std::uint32_t>(domain);
    } else if (name == "--profile") {
      options.profile = value;
    } else if (name == "--discovery-server") {
      options.discovery_server = value;
    } else {
      return false;
    }
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  tfdude::Options options;
  double seconds = 10;
  if (!read_arguments(argc, argv, options, seconds)) {
    std::fputs(
        "arm_controller: drives the arm of examples/robots/mobile_arm.urdf at 1 kHz\n"
        "usage: arm_controller [--seconds S] [--domain N] [--local | --profile FILE]\n"
        "                      [--discovery-server HOST:PORT]\n",
        stderr);
    return 2;
  }
  return run(options, seconds);
}
