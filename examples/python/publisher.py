#!/usr/bin/env python3
"""Publishes six joints of an arm at 1 kHz, and says how well the rate was kept.

By default it also owns the arm, in one process, without a network; with --dds it streams to a daemon that has joints of
these names, as of `tfduded examples/arm/arm.yaml`:

    python3 publisher.py --seconds 5
    python3 publisher.py --dds --joints shoulder elbow wrist
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import tfdude
from tfdude import FrameSpec, Joint, Transform

RATE = 1000.0  # [Hz]


def arm(names: list[str]) -> list[FrameSpec]:
    frames = [FrameSpec("base")]
    for name in names:
        X = Transform.exact((0, 0, 0.2))
        frames.append(FrameSpec(f"{name}_link", frames[-1].id, X, joint=Joint(name, axis=(0, 1, 0), limits=(-3, 3))))
    return frames


def publish(client: tfdude.Client, names: list[str], seconds: float) -> None:
    stream = client.stream_joints(names)
    phases = np.arange(len(names)) * 0.5
    variances = np.full(len(names), 1e-6)  # of an encoder [rad²]
    lost = 0
    late = np.empty(int(seconds * RATE))
    begin = time.monotonic()
    for i in range(len(late)):
        due = begin + i / RATE
        time.sleep(max(0.0, due - time.monotonic()))
        late[i] = time.monotonic() - due
        positions = 0.5 * np.sin(due + phases)
        lost += bool(stream.publish(positions, variances, time.time_ns()))
    print(
        f"{len(late)} samples of {len(names)} joints in {time.monotonic() - begin:.2f} s, {lost} not sent;"
        f" late by {1e3 * np.median(late):.3f} ms (median), {1e3 * np.quantile(late, 0.99):.3f} ms (99 %)"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--dds", action="store_true", help="stream to the owners of the joints in the DDS domain")
    parser.add_argument("--joints", nargs="+", default=[f"joint{i}" for i in range(1, 7)])
    arguments = parser.parse_args()
    if arguments.dds:
        with tfdude.Client() as client:
            client.partitions()  # waits until the owners are known
            publish(client, arguments.joints, arguments.seconds)
        return
    frames = arm(arguments.joints)
    with tfdude.Node("arm", frames, network=tfdude.LoopbackNetwork()) as node:
        publish(node, arguments.joints, arguments.seconds)
        X = node.lookup("base", frames[-1].id)
        print(f"{frames[-1].id} at {X.translation} m, ±{1000 * X.stddev_in_parent[:3].max():.2f} mm")


if __name__ == "__main__":
    main()
