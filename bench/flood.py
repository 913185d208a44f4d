#!/usr/bin/env python3
"""Measures another client's lookup beside one that floods the same owner, and beside a process that only uses as much
processor time: flood.py [--bin DIR] [--calls N]. Prints a line of JSON for each, with p50 and p99 in microseconds."""

import argparse
import contextlib
import json
import pathlib
import subprocess
import tempfile

import processes

ROBOT = processes.ROOT / "examples" / "thesis" / "robot.yaml"


@contextlib.contextmanager
def running(command):
    with subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          bufsize=0) as process:
        try:
            processes.await_line(process.stdout, command[0])
            yield process
        finally:
            processes.end(process)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, default=processes.ROOT / "build" / "bench" / "bin")
    parser.add_argument("--calls", type=int, default=3000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory():
        for load in ("none", "burn", "flood", "large"):
            domain, lease = processes.lease_domain()
            common = ["--domain", domain, "--profile", processes.PROFILE]
            bench = arguments.bin / "flood_bench"
            with lease, running([arguments.bin / "tfduded", "--no-state", "--config", ROBOT, *common]):
                with contextlib.ExitStack() as loads:
                    if load != "none":
                        loads.enter_context(running([bench, "--mode", load, *common]))
                    result = subprocess.run(
                        [str(part) for part in [bench, "--mode", "probe", *common, "--calls", arguments.calls]],
                        stdout=subprocess.PIPE, check=True, timeout=600)
            figure = json.loads(result.stdout)
            figure["load"] = load
            print(json.dumps(figure), flush=True)


if __name__ == "__main__":
    main()
