"""Finds a cup in three images of the camera, and tells the robot where it is."""

import time

import numpy as np
import tfdude

CUP = tfdude.Transform.exact((1.5, 0.3, 0.7))  # in odom: where it really stands, instead of an image
ERROR = np.diag([0.004, 0.004, 0.01, 0.05, 0.05, 0.05]) ** 2  # of the detector [m², rad²]


def main() -> None:
    with tfdude.Client() as robot:
        if not robot.exists("cup"):
            robot.add("cup", "odom", tfdude.Transform())  # without a covariance: nobody knows where
        images: tfdude.MessageFilter[int] = tfdude.MessageFilter(robot, "odom", max_age=2)
        for number in range(3):
            images.push(number, "camera", time.time_ns())
            time.sleep(0.1)
        images.close()
        for number, X_odom_camera in images:  # as soon as it is known where the camera was then
            seen = (X_odom_camera.inverse() @ CUP).with_covariance(ERROR)
            result = robot.observe("camera", "cup", seen, X_odom_camera.stamp)
            print(f"image {number}: {'used' if result.accepted else 'an outlier'}")


if __name__ == "__main__":
    main()
