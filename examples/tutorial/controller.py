"""Publishes the joints and the odometry of the robot at 100 Hz. Sines stand for its sensors.

python3 controller.py [SECONDS]
"""

import math
import sys
import time

import tfdude

JOINTS = ["shoulder", "elbow", "head_pan"]
VARIANCES = [1e-6, 1e-6, 4e-6]  # of the encoders [rad²]


def main(seconds: float) -> None:
    with tfdude.Client() as robot:
        begin = time.monotonic()
        trouble = ""
        while (t := time.monotonic() - begin) < seconds:
            stamp = time.time_ns()  # better: when the encoders were read
            positions = [0.5 * math.sin(0.5 * t), 0.3 + 0.4 * math.sin(0.7 * t), 0.2 * math.sin(0.3 * t)]
            turn = 0.1 * t
            pose = [math.sin(turn), 1 - math.cos(turn), 0, 0, 0, math.sin(turn / 2), math.cos(turn / 2)]
            problem = ""
            try:
                robot.publish(["base_link"], [pose], "exact", stamp)  # x y z, qx qy qz qw
                robot.publish_joints(JOINTS, positions, VARIANCES, stamp)
            except tfdude.TransformException as error:
                problem = str(error)  # an owner that is down may come back; the others have their values
            if problem != trouble:
                print(problem or "all owners are reachable", flush=True)
            trouble = problem
            time.sleep(0.01)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else math.inf)
