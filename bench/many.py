#!/usr/bin/env python3
"""Measures calls for many frames, instants and points beside what users write without them, and beside numpy.

  PYTHONPATH=build/release/python bench/many.py [--rounds N]

Pairs take turns, in one process on one core; each figure is the median of the rounds. Prints a line of JSON for each
pair: what, ours [ms], the other's [ms], and what the other is.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import time

import numpy as np
import tfdude
from tfdude import FrameSpec, Transform

EDGES = 10
SAMPLES = 1000
INSTANTS = 300_000
POINTS = 1_000_000
STEP = 1_000_000
START = 1_000_000_000_000_000_000


def paired(rounds, *functions, clock=time.thread_time):
    """Medians [ms] of functions that take turns: time of this thread's processor, so that others do not count."""
    times = [[] for _ in functions]
    for _ in range(rounds):
        for function, all_of_it in zip(functions, times):
            began = clock()
            function()
            all_of_it.append((clock() - began) * 1e3)
    return [statistics.median(one) for one in times]


def report(what, ours, other, peer):
    print(json.dumps({"what": what, "ours_ms": round(ours, 3), "other_ms": round(other, 3), "other": peer}), flush=True)


def chain(network):
    """Ten edges that swing by half a radian, once in 2 s, with covariance; each with 1,000 samples at 1 kHz."""
    sigma = np.eye(6) * 1e-6
    frames = [FrameSpec("f0")] + [FrameSpec(f"f{i + 1}", f"f{i}", Transform()) for i in range(EDGES)]
    node = tfdude.Node("bench", frames, network=network)
    ids = [f"f{i + 1}" for i in range(EDGES)]
    rng = np.random.default_rng(1)
    axes = rng.normal(0, 1, (EDGES, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    phases = rng.uniform(0, 2 * np.pi, EDGES)
    poses = np.zeros((EDGES, 7))
    for k in range(SAMPLES):
        half = 0.25 * np.sin(np.pi * k * STEP / 1e9 + phases)
        poses[:, :3] = 0.1
        poses[:, 3:6] = axes * np.sin(half)[:, None]
        poses[:, 6] = np.cos(half)
        node.update_many(ids, poses, sigma, START + k * STEP)
    return node


def trajectories(node, rounds):
    ends = ("f0", f"f{EDGES}")
    stamps = START + np.random.default_rng(2).integers(0, (SAMPLES - 1) * STEP, INSTANTS)

    def ours():
        found = node.trajectory(*ends, stamps)
        return found.poses, found.covariances

    few = stamps[: INSTANTS // 100]

    def loop():
        return [node.lookup(*ends, int(t)) for t in few]

    a, b = paired(rounds, ours, loop)
    report(f"{INSTANTS} past lookups over {EDGES} moving edges, with (N, 7) and (N, 6, 6)", a, b * 100,
           "a loop over lookup(), 100 times that of 1 %")


def clouds(node, rounds):
    X = node.lookup("f0", f"f{EDGES}")
    for kind in (np.float64, np.float32):
        points = np.random.default_rng(3).uniform(-20, 20, (POINTS, 3)).astype(kind)
        R = X.matrix[:3, :3].astype(kind)
        t = X.translation.astype(kind)
        Sigma = X.covariance

        def numpy_pose():
            return points @ R.T + t

        cloud = X.transform_cloud(points, covariance=True)
        a, b = paired(rounds, lambda: X.transform_cloud(points, out=cloud).points, numpy_pose)
        report(f"{POINTS} points, {kind.__name__}", a, b, "numpy: points @ R.T + t")

        def numpy_covariances():
            p = points.astype(np.float64)
            J = np.zeros((len(p), 3, 6))
            J[:, 0, 0] = J[:, 1, 1] = J[:, 2, 2] = 1
            J[:, 0, 4], J[:, 0, 5], J[:, 1, 3] = p[:, 2], -p[:, 1], -p[:, 2]
            J[:, 1, 5], J[:, 2, 3], J[:, 2, 4] = p[:, 0], p[:, 1], -p[:, 0]
            RJ = X.matrix[:3, :3] @ J
            return numpy_pose(), RJ @ Sigma @ RJ.transpose(0, 2, 1)

        a, b = paired(max(rounds // 3, 2), lambda: X.transform_cloud(points, covariance=True, out=cloud).upper,
                      numpy_covariances)
        report(f"{POINTS} points with covariance, {kind.__name__}", a, b, "numpy: R J Sigma J' R'")
        few = points[: POINTS // 100]
        a, b = paired(max(rounds // 3, 2), lambda: X.transform_cloud(few, covariance=True).upper,
                      lambda: X.transform(few).covariance)
        report(f"{len(few)} points with covariance, {kind.__name__}", a, b, "transform() of single points")


def spinning(node, rounds):
    """A turn of a lidar: 1,800 stamps, 128 points each."""
    stamps = np.repeat(START + np.linspace(0, 99 * STEP, 1800).astype(np.int64), 128)
    points = np.random.default_rng(4).uniform(-20, 20, (len(stamps), 3))
    ends = ("f0", f"f{EDGES}")

    def loop():
        out = np.empty_like(points)
        for i in range(0, len(points), 128 * 10):
            out[i : i + 128] = node.lookup(*ends, int(stamps[i])).apply(points[i : i + 128])

    a, b = paired(rounds, lambda: node.transform_cloud(*ends, points, stamps=stamps).points, loop)
    report(f"{len(points)} points with 1,800 stamps", a, b * 10,
           "a loop over lookup() and apply(), ten times that of 10 %")


def many(network, rounds):
    frames = [FrameSpec("base")] + [FrameSpec(f"link{i}", "base", Transform.exact((0, 0, i))) for i in range(100)]
    with tfdude.Node("many", frames), tfdude.Client() as client:
        names = [f"link{i}" for i in range(100)]
        client.lookup("base", "link0", timeout=5)
        a, b = paired(
            rounds * 5,
            lambda: client.lookup_many("base", names),
            lambda: [client.lookup("base", name) for name in names],
            clock=time.perf_counter,
        )
        report("100 frames of another owner over DDS", a, b, "a loop over lookup()")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    rounds = parser.parse_args().rounds
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    network = tfdude.LoopbackNetwork()
    with chain(network) as node:
        trajectories(node, rounds)
        clouds(node, rounds)
        spinning(node, rounds)
    os.sched_setaffinity(0, range(os.cpu_count()))
    many(network, rounds)


if __name__ == "__main__":
    main()
