#!/usr/bin/env python3
"""Measures calls of the Python package beside the same calls of C++ (bench/python/calls_bench.cpp).

  PYTHONPATH=build/release/python bench/python.py [--bin DIR] [--calls N] [--rounds N]

Lookups over 30 own edges; lookups of the same frames from their owner, in another process over DDS; and 30 joints
streamed to that owner from an array of numpy. Python and C++ take turns. Prints a line of JSON for each figure, whose
values are the medians of the rounds. Then the lookup of tf2_py over the same 30 edges, if Debian's python3-tf2 is
installed.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import time

import numpy as np
import tfdude
from tfdude import FrameSpec, Joint, Transform

import figures

JOINTS = [f"joint{i}" for i in range(30)]
DOMAIN = 217
PATH = ("link0", "link30")


def robot():
    """As in calls_bench.cpp."""
    frames = [FrameSpec("link0", "", Transform.exact())]
    for i, name in enumerate(JOINTS):
        joint = Joint(name, variance=1e-6)
        frames.append(FrameSpec(f"link{i + 1}", f"link{i}", Transform.exact((0, 0, 0.1)), joint=joint))
    return frames


def own(domain):
    """The other process: owns the robot until its input ends."""
    with tfdude.Node("robot", robot(), domain=domain, profile="local"):
        print("ready", flush=True)
        sys.stdin.read()


def median_us(count, call):
    clock = time.perf_counter_ns
    times = []
    for _ in range(count):
        begin = clock()
        call()
        times.append(clock() - begin)
    return statistics.median(times) / 1000


def python_calls(domain):
    """The calls, by name; they keep what they need."""
    node = tfdude.Node("own", robot(), network=tfdude.LoopbackNetwork())
    client = tfdude.Client(domain=domain, profile="local")
    client.lookup(*PATH, timeout=10)
    stream = client.stream_joints(JOINTS)
    positions = np.zeros(30)
    variances = np.full(30, 1e-6)

    def publish():
        positions[0] += 1e-6
        stream.publish(positions, variances)

    return {"own": lambda: node.lookup(*PATH), "remote": lambda: client.lookup(*PATH), "publish": publish}


def tf2_lookup():
    """The lookup of tf2_py over 30 edges, or None."""
    try:
        import geometry_msgs.msg
        import rospy
        import tf2_py
    except ImportError as error:
        print(f"tf2_py cannot be run: {error}", file=sys.stderr)
        return None
    buffer = tf2_py.BufferCore()
    for i in range(30):
        edge = geometry_msgs.msg.TransformStamped()
        edge.header.frame_id, edge.child_frame_id = f"link{i}", f"link{i + 1}"
        edge.transform.translation.z, edge.transform.rotation.w = 0.1, 1
        buffer.set_transform_static(edge, "bench")
    latest = rospy.Time(0)
    return lambda: buffer.lookup_transform_core(*PATH, latest)


def measure(cpp, calls, count, rounds):
    """(medians of Python, medians of C++), by name, one for each round."""
    medians = {name: ([], []) for name in calls}
    for i in range(rounds):
        for name, call in calls.items():
            for side in (0, 1) if i % 2 else (1, 0):
                if side == 0:
                    medians[name][0].append(median_us(count, call))
                else:
                    print(name, count, file=cpp.stdin, flush=True)
                    medians[name][1].append(float(cpp.stdout.readline()))
    return medians


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    root = pathlib.Path(__file__).resolve().parent.parent
    parser.add_argument("--bin", type=pathlib.Path, default=root / "build/release/bin")
    parser.add_argument("--calls", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--domain", type=int, default=DOMAIN)
    parser.add_argument("--own", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.own:
        own(arguments.domain)
        return
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with (
        subprocess.Popen([sys.executable, __file__, "--own", "--domain", str(arguments.domain)], **pipes) as owner,
        subprocess.Popen([arguments.bin / "calls_bench", str(arguments.domain)], **pipes) as cpp,
    ):
        if owner.stdout.readline() != "ready\n":
            sys.exit("the owner did not start")
        medians = measure(cpp, python_calls(arguments.domain), arguments.calls, arguments.rounds)
        cpp.stdin.close()
        owner.stdin.close()
    for name, sides in medians.items():
        for side, values in zip(("python", "cpp"), sides):
            print(json.dumps(figures.summary(f"python/{name}/{side}", "us", values)))
    if lookup := tf2_lookup():
        values = [median_us(arguments.calls, lookup) for _ in range(arguments.rounds)]
        print(json.dumps(figures.summary("python/own/tf2", "us", values)))


if __name__ == "__main__":
    main()
