#!/usr/bin/env python3
"""A camera is mounted on a head, a few millimetres and degrees from where its drawing says.

Each measurement of the mount, as of a board at a known place, corrects the edge by its uncertainty; the covariance
shrinks. Runs in one process, without a network: python3 calibration.py
"""

import numpy as np
import tfdude
from tfdude import FrameSpec, Transform

MEASUREMENTS = 100
ASSUMED = Transform((0, 0, 0.1), stddev=[0.01] * 3 + [0.03] * 3)  # the drawing, and how far it may be off
TRUE = ASSUMED @ Transform.exp([0.004, -0.006, 0.003, 0.01, -0.02, 0.005])
NOISE = np.diag([0.002] * 3 + [0.005] * 3) ** 2  # of one measurement [m², rad²]


def main() -> None:
    rng = np.random.default_rng(2)
    frames = [FrameSpec("head"), FrameSpec("camera", "head", ASSUMED)]
    with tfdude.Node("head", frames, network=tfdude.LoopbackNetwork()) as node:
        print("measurements  error [mm]  stddev [mm]  error [deg]  stddev [deg]")
        for i in range(MEASUREMENTS + 1):
            if i in (0, 1, 2, 5, 10, 20, 50, 100):
                X = node.lookup("head", "camera")
                error = np.abs((TRUE.inverse() @ X).log())
                print(
                    f"{i:12}  {1000 * error[:3].max():10.3f}  {1000 * X.stddev[:3].max():11.3f}"
                    f"  {np.rad2deg(error[3:].max()):11.3f}  {np.rad2deg(X.stddev[3:].max()):12.3f}"
                )
            noise = Transform.exp(rng.multivariate_normal(np.zeros(6), NOISE))
            observed = node.observe("head", "camera", (TRUE @ noise).with_covariance(NOISE))
            if not observed.accepted:
                print(f"measurement {i} is an outlier: {observed.distance_squared:.1f} > {observed.limit:.1f}")


if __name__ == "__main__":
    main()
