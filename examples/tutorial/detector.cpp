// Finds a cup in three images of the camera, and tells the robot where it is.

#include <chrono>
#include <iostream>
#include <thread>

#include <tfdude/client/client.hpp>
#include <tfdude/client/message_filter.hpp>
#include <tfdude/math/conversions.hpp>

namespace {

using namespace std::chrono_literals;
using tfdude::value_or_throw;

struct Image {
  int number;
};

void run() {
  auto robot = value_or_throw(tfdude::Client::open());
  if (!value_or_throw(robot.whether_exists("cup"))) {
    // Without a covariance: nobody knows where.
    value_or_throw(robot.add("cup", "odom", {tfdude::Pose(), {}}));
  }
  // In odom: where it really stands, instead of an image.
  const auto cup =
      value_or_throw(tfdude::Pose::create(Eigen::Quaterniond::Identity(), {1.5, 0.3, 0.7}));
  const auto error = value_or_throw(
      tfdude::Covariance::from_stddev({0.004, 0.004, 0.01, 0.05, 0.05, 0.05}));  // [m, rad]

  tfdude::MessageFilter<Image> images(
      robot, {"odom"},
      [&](Image image, const tfdude::StampedTransform& X) {  // as soon as it is known where it was
        const tfdude::Pose seen = X.pose.inverse() * cup;
        const auto observed = robot.observe("camera", "cup", {seen, error}, X.stamp);
        std::cout << "image " << image.number << ": "
                  << (!observed            ? observed.error().message
                      : observed->accepted ? "used"
                                           : "an outlier")
                  << std::endl;
      },
      [](Image image, const tfdude::Error& why) {
        std::cout << "image " << image.number << " is dropped: " << why.message << std::endl;
      });
  for (int number = 0; number < 3; ++number) {
    images.push({number}, "camera", std::chrono::system_clock::now());
    std::this_thread::sleep_for(100ms);
  }
  while (images.waiting() > 0) std::this_thread::sleep_for(10ms);
}

}  // namespace

int main() {
  try {
    run();
  } catch (const tfdude::ErrorException& error) {
    std::cerr << "detector: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
