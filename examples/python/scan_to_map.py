#!/usr/bin/env python3
"""A node that brings the points of a turning lidar to the map: docs/coming-from-tf2.md has it beside tf2.

    scan_to_map.py [--scans N]

Everything runs in this process, so that the example needs no robot: a base drives along x at 10 m/s, its odometry comes
at 100 Hz, and a lidar measures a wall at x = 30 m, ten times a second. Each of the 360 points of a turn is measured at
an instant of its own. The odometry comes later than the scans, as it does on robots.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import tfdude
from tfdude import FrameSpec, Transform

SPEED = 10.0  # [m/s]
WALL = 30.0  # [m]
MS = 1_000_000
TURN = 100 * MS


def drive(node: tfdude.Node, start: int, begin: int, end: int) -> None:
    """Odometry at 100 Hz, with a standard deviation of 2 cm and 1 mrad."""
    for t in range(begin, end, 10 * MS):
        X_OB = Transform((SPEED * (t - start) / 1e9, 0, 0), stddev=[0.02] * 3 + [1e-3] * 3)
        node.update("base", X_OB, t)


Array = np.ndarray[Any, Any]


def measure(start: int, begin: int) -> tuple[Array, Array]:
    """The points (360, 3) of a turn, in the lidar where it was at each, and their stamps (360,)."""
    stamps = begin + np.arange(360, dtype=np.int64) * TURN // 360
    points = np.zeros((360, 3))
    points[:, 0] = WALL - 0.5 - SPEED * (stamps - start) / 1e9
    points[:, 1] = np.linspace(-5, 5, 360)
    return points, stamps


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scans", type=int, default=5)
    scans = parser.parse_args().scans
    network = tfdude.LoopbackNetwork()
    frames = [
        FrameSpec("map"),
        FrameSpec("base", "map", moving=True),
        FrameSpec("lidar", "base", Transform((0.5, 0, 0), stddev=[1e-3] * 6)),
    ]
    with tfdude.Node("car", frames, network=network) as car, tfdude.Client(network=network) as client:
        start = client.now() - 10 * TURN
        # A scan is held back until the transform at its end can be had.
        waiting: tfdude.MessageFilter[tuple[Array, Array]] = tfdude.MessageFilter(client, "map", max_age=5)
        for k in range(scans):
            points, stamps = measure(start, start + k * TURN)
            waiting.push((points, stamps), "lidar", int(stamps[-1]))
            drive(car, start, start + k * TURN, start + (k + 1) * TURN)
        drive(car, start, start + scans * TURN, start + scans * TURN + 10 * MS)
        waiting.close()
        for (points, stamps), X_ML in waiting:
            rigid = X_ML.transform_cloud(points).points
            cloud = client.transform_cloud("map", "lidar", points, stamps=stamps, covariance=True)
            x = cloud.points[:, 0]
            sigma = np.sqrt(cloud.covariances[:, 0, 0])
            print(
                f"wall at {x.mean():.3f} m, {np.ptp(x):.3f} m thick, std dev {sigma.mean():.3f} m; "
                f"by one pose {np.ptp(rigid[:, 0]):.3f} m thick"
            )


if __name__ == "__main__":
    main()
