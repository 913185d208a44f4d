// Prints how far the gripper is from the cup, five times. The owners push what changes.
//
//   watch [FROM TO]

#include <cmath>
#include <cstdio>
#include <string>

#include <Eigen/Eigenvalues>
#include <tfdude/client/client.hpp>
#include <tfdude/client/watch.hpp>
#include <tfdude/math/conversions.hpp>

namespace {

using tfdude::Milliseconds;
using tfdude::value_or_throw;

void run(const std::string& a, const std::string& b) {
  auto robot = value_or_throw(tfdude::Client::open());
  tfdude::WatchOptions options;
  options.rate = 10;
  auto watch = value_or_throw(robot.watch(a, b, options, Milliseconds(5000)));
  for (int i = 0; i < 5; ++i) {
    const auto X = value_or_throw(watch.wait_next(Milliseconds(2000)));
    const Eigen::Matrix3d sigma = X.covariance.of_specified().matrix().topLeftCorner<3, 3>();
    const double error =
        std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sigma).eigenvalues().maxCoeff());
    std::printf("%s is %.3f m from %s, +- %.1f mm%s\n", b.c_str(), X.pose.translation().norm(),
                a.c_str(), 1000 * error, X.covariance.complete() ? "" : " of what is specified");
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc > 2 ? argv[1] : "gripper", argc > 2 ? argv[2] : "cup");
  } catch (const tfdude::ErrorException& error) {
    std::fprintf(stderr, "watch: %s\n", error.what());
    return 1;
  }
  return 0;
}
