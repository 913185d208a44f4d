#!/usr/bin/env python3
"""Measures the bridge to ROS 2: bench/ros/run.py [--edges 100] [--rate 100] [--seconds 20]

Needs build/release with the benchmarks: scripts/build --bench ros_bench tfdude_ros

For each way it prints, as lines of JSON, the latency from the write to the reading, the share of a core that the bridge
(or the bare relay) takes, and the bytes on the loopback interface, all with one message for all edges, and with one
for each edge. Values that the next one overtook before the reader looked are not in the latency. Runs in a network
namespace of its own, because of the bytes, so it needs root.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import figures  # noqa: E402
import usage  # noqa: E402

BIN = pathlib.Path(__file__).resolve().parents[2] / "build/release/bin"
ROS_DOMAIN, DOMAIN = 231, 230


def end(process):
    if process.stdin:
        process.stdin.close()
    else:
        process.terminate()
    process.wait(timeout=30)


def measure(way, per_message, arguments):
    options = ["--ros-domain", str(ROS_DOMAIN), "--domain", str(DOMAIN), "--edges", str(arguments.edges), "--rate",
               str(arguments.rate), "--per-message", str(per_message), "--seconds", str(arguments.seconds)]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(ROS_DOMAIN), "ROS_LOCALHOST_ONLY": "1"}
    if way == "bare":
        middle = subprocess.Popen([BIN / "ros_bench", "relay", *options], text=True, stdin=subprocess.PIPE,
                                  stdout=subprocess.PIPE)
    else:
        ways = {"in": [], "out": ["--no-tf-in", "--export", "robot", "--rate", "0"]}[way]
        middle = subprocess.Popen([BIN / "tfdude-ros", "--local", "--domain", str(DOMAIN), *ways], text=True,
                                  env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    middle.stdout.readline()
    with subprocess.Popen([BIN / "ros_bench", way, *options], text=True, stdout=subprocess.PIPE) as ends:
        assert ends.stdout.readline().strip() == "begin"
        before = time.monotonic(), usage.seconds_of(middle.pid), usage.loopback()[1]
        assert ends.stdout.readline().strip() == "end"
        after = time.monotonic(), usage.seconds_of(middle.pid), usage.loopback()[1]
        result = json.loads(ends.stdout.readline())
    end(middle)
    seconds = after[0] - before[0]
    result["core"] = (after[1] - before[1]) / seconds
    result["bytes_per_edge"] = (after[2] - before[2]) / seconds / arguments.rate / arguments.edges
    return result


def figures_of(way, per_message, one):
    """The figures of one way; its quantiles come from the program."""
    key = f"ros/{way}/{per_message}"
    latency = {"key": f"{key}/latency", "unit": "us", "n": one["read"], "median": one["p50"], "p90": one["p90"],
               "p99": one["p99"], "medians": [one["p50"]]}
    return [latency, figures.summary(f"{key}/cpu", "%", [100 * one["core"]]),
            figures.summary(f"{key}/bytes_per_edge", "bytes", [one["bytes_per_edge"]])]


def replay(arguments):
    """The memory of the bridge during a replay that jumps back every 10 s."""
    environment = {**os.environ, "ROS_DOMAIN_ID": str(ROS_DOMAIN), "ROS_LOCALHOST_ONLY": "1"}
    bridge = subprocess.Popen([BIN / "tfdude-ros", "--local", "--domain", str(DOMAIN)], text=True, env=environment,
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    bridge.stdout.readline()
    command = [BIN / "ros_bench", "replay", "--ros-domain", str(ROS_DOMAIN), "--domain", str(DOMAIN), "--edges",
               str(arguments.edges), "--rate", str(arguments.rate), "--per-message", str(arguments.edges), "--seconds",
               str(arguments.seconds)]
    with subprocess.Popen(command, text=True, stdout=subprocess.PIPE) as ends:
        begin = time.monotonic()
        while ends.poll() is None:
            time.sleep(min(10, arguments.seconds / 6))
            print(f"{time.monotonic() - begin:.0f} s: {usage.status_of(bridge.pid, 'VmRSS')} KiB", flush=True)
        print(ends.stdout.read().splitlines()[-1])
    end(bridge)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edges", type=int, default=100)
    parser.add_argument("--rate", type=int, default=100)
    parser.add_argument("--seconds", type=int, default=20)
    parser.add_argument("--replay", action="store_true", help="memory while stamps run fast and jump back, instead")
    arguments = parser.parse_args()
    if "TFDUDE_OWN_NETWORK" not in os.environ:
        os.environ["TFDUDE_OWN_NETWORK"] = "1"
        os.execvp("unshare", ["unshare", "--net", "sh", "-c", 'ip link set lo up && exec "$0" "$@"', *sys.argv])
    if arguments.replay:
        replay(arguments)
        return
    for per_message in (arguments.edges, 1):
        for way in ("bare", "in", "out"):
            if way == "out" and per_message == 1:
                continue  # the bridge sends one message
            for figure in figures_of(way, per_message, measure(way, per_message, arguments)):
                print(json.dumps(figure), flush=True)


if __name__ == "__main__":
    main()
