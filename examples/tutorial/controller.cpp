// Publishes the joints and the odometry of the robot at 100 Hz. Sines stand for its sensors.
//
//   controller [SECONDS]

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include <tfdude/client/client.hpp>
#include <tfdude/math/conversions.hpp>

namespace {

using namespace std::chrono_literals;
using tfdude::value_or_throw;
using Steady = std::chrono::steady_clock;

const std::vector<std::string> kJoints{"shoulder", "elbow", "head_pan"};
const std::vector<double> kVariances{1e-6, 1e-6, 4e-6};  // of the encoders [rad²]

// The odometry at time t [s]: the base drives in a circle.
tfdude::Pose base(double t) {
  const double turn = 0.1 * t;
  return value_or_throw(
      tfdude::Pose::create(tfdude::from_rpy(0, 0, turn), {std::sin(turn), 1 - std::cos(turn), 0}));
}

void run(double seconds) {
  auto robot = value_or_throw(tfdude::Client::open());
  const auto begin = Steady::now();
  std::string trouble;
  for (double t = 0; t < seconds;
       t = std::chrono::duration<double>(Steady::now() - begin).count()) {
    const tfdude::Time stamp = std::chrono::system_clock::now();  // better: of the encoders
    const std::vector<double> positions{0.5 * std::sin(0.5 * t), 0.3 + 0.4 * std::sin(0.7 * t),
                                        0.2 * std::sin(0.3 * t)};
    const auto driven = robot.publish({{"base_link", tfdude::Transform::exact(base(t))}}, stamp);
    const auto moved = robot.publish_joints(kJoints, positions, kVariances, stamp);
    // An owner that is down may come back; the others have their values.
    const std::string problem = !driven  ? driven.error().message
                                : !moved ? moved.error().message
                                         : std::string();
    if (problem != trouble) {
      std::cout << (problem.empty() ? "all owners are reachable" : problem) << std::endl;
    }
    trouble = problem;
    std::this_thread::sleep_for(10ms);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc > 1 ? std::atof(argv[1]) : INFINITY);
  } catch (const tfdude::ErrorException& error) {
    std::cerr << "controller: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
