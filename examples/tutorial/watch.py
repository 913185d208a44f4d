"""Prints how far the gripper is from the cup, five times. The owners push what changes.

python3 watch.py [FROM TO]
"""

import sys

import numpy as np
import tfdude


def main(a: str, b: str) -> None:
    with tfdude.Client() as robot:
        watch = robot.watch(a, b, rate=10, timeout=5)
        for _ in range(5):
            X = watch.wait_next(timeout=2)
            distance = np.linalg.norm(X.translation)
            error = np.sqrt(np.linalg.eigvalsh(X.covariance[:3, :3])[-1])
            print(f"{b} is {distance:.3f} m from {a}, +- {1000 * error:.1f} mm")


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["gripper", "cup"]))
