#!/usr/bin/env python3
"""Plots the uncertainty of a watched hand over time, with matplotlib.

    python3 watch_plot.py hand.png            # an arm of its own, in one process
    python3 watch_plot.py hand.png base hand  # frames of the DDS domain
"""

from __future__ import annotations

import asyncio
import sys
import time

import numpy as np
import tfdude
from tfdude import FrameSpec, Joint, Transform

SECONDS = 3.0


# --- Collect: asyncio is woken whenever an owner has pushed something new. ---


async def collect(client: tfdude.Client, a: str, b: str) -> list[tuple[float, float]]:
    """(time [s], largest standard deviation of the position [mm]) of each transform."""
    points: list[tuple[float, float]] = []
    watch = client.watch(a, b, rate=100)

    async def follow() -> None:
        async for X in watch:
            if X.stamp is None or not X.complete:
                print(f"nothing to plot: {X.unspecified or 'the path is static'}")
                continue
            points.append((X.stamp / 1e9, 1000 * np.sqrt(np.linalg.eigvalsh(X.covariance[:3, :3])[-1])))

    try:
        await asyncio.wait_for(follow(), SECONDS)
    except asyncio.TimeoutError:
        pass
    return points


# --- Move: an arm whose joints are known the less, the faster they move. ---


def arm() -> list[FrameSpec]:
    frames = [FrameSpec("base")]
    for name in ("shoulder", "elbow"):
        X = Transform.exact((0.4, 0, 0) if name == "elbow" else (0, 0, 0))
        frames.append(FrameSpec(name + "_link", frames[-1].id, X, joint=Joint(name, axis=(0, 0, 1))))
    frames.append(FrameSpec("hand", "elbow_link", Transform((0.3, 0, 0), stddev=[0.0005] * 6)))
    return frames


async def move(node: tfdude.Node) -> None:
    stream = node.stream_joints(["shoulder", "elbow"])
    while True:
        t = time.time()
        velocities = np.array([np.cos(t), 2 * np.cos(2 * t)])
        stream.publish([np.sin(t), np.sin(2 * t)], (0.001 + 0.002 * velocities) ** 2, t)
        await asyncio.sleep(0.01)


async def move_and_collect() -> list[tuple[float, float]]:
    network = tfdude.LoopbackNetwork()
    with tfdude.Node("arm", arm(), network=network) as node, tfdude.Client(network=network) as client:
        moving = asyncio.create_task(move(node))
        await asyncio.sleep(0.1)
        points = await collect(client, "base", "hand")
        moving.cancel()
        return points


# --- Plot. ---


def plot(points: list[tuple[float, float]], file: str) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    times, deviations = np.transpose(points)
    figure, axes = pyplot.subplots(figsize=(8, 3), layout="constrained")
    axes.plot(times - times[0], deviations)
    axes.set(xlabel="time [s]", ylabel="position ± [mm]", title="one standard deviation along the worst axis", ylim=0)
    figure.savefig(file)
    print(f"{len(points)} transforms in {file}")


def main() -> None:
    if len(sys.argv) not in (2, 4):
        sys.exit(__doc__)
    if len(sys.argv) == 4:
        with tfdude.Client() as client:
            points = asyncio.run(collect(client, sys.argv[2], sys.argv[3]))
    else:
        points = asyncio.run(move_and_collect())
    plot(points, sys.argv[1])


if __name__ == "__main__":
    main()
