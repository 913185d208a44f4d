#!/usr/bin/env python3
"""What a recorder costs beside a bare DDS reader of as many bytes: 100 edges of one owner that move at 1 kHz.

    python3 bench/recorded.py [--edges N] [--rate HZ] [--seconds S]     needs push_load of bench/net

The program prints a line of JSON for each figure, and runs in a network of its own. Processor time is that of the whole
process that records or reads, from /proc. That of zstd alone is measured on the uncompressed file.
"""

import argparse
import json
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time

import figures
import usage

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = ROOT / "build" / "release" / "bin"
COMMON = ["--domain", "80", "--profile", str(ROOT / "profiles" / "loopback.xml")]
WARM_UP_S = 2
HEADERS = 110  # of Ethernet, IP, UDP and RTPS on each datagram [bytes]


def start(program, *arguments):
    return subprocess.Popen([BIN / program, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)


def load(mode, arguments, *more):
    return start("push_load", "--mode", mode, *COMMON, "--joints", arguments.edges, "--rate", arguments.rate, *more)


def measured(process, seconds):
    """Processor time per second of a process, and packets and bytes per second of the network."""
    time.sleep(WARM_UP_S)
    before = time.monotonic(), usage.seconds_of(process.pid), usage.loopback()
    time.sleep(seconds)
    after = time.monotonic(), usage.seconds_of(process.pid), usage.loopback()
    span = after[0] - before[0]
    return (after[1] - before[1]) / span, [(b - a) / span for a, b in zip(before[2], after[2])]


def end(process, how=signal.SIGTERM):
    process.send_signal(how)
    process.communicate(timeout=30)


def zstd_seconds(file):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(["zstd", "-1", "--single-thread", "-q", "-c", file], stdout=subprocess.DEVNULL, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edges", type=int, default=100)
    parser.add_argument("--rate", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=10)
    arguments = parser.parse_args()
    if "TFDUDE_OWN_NETWORK" not in os.environ:
        os.environ["TFDUDE_OWN_NETWORK"] = "1"
        os.execvp("unshare", ["unshare", "--net", "sh", "-c", 'ip link set lo up && exec "$0" "$@"', sys.executable,
                              *sys.argv])
    share, size, zstd = {}, {}, 0
    owner = load("own", arguments)
    owner.stdout.readline()
    with tempfile.TemporaryDirectory() as folder:
        for way, options in (("compressed", ()), ("raw", ("--raw",))):
            file = pathlib.Path(folder) / f"{way}.mcap"
            begin = time.monotonic()
            recorder = start("tfdude", *COMMON, "record", file, *options)
            share[way], (packets, bytes_rate) = measured(recorder, arguments.seconds)
            end(recorder, signal.SIGINT)
            size[way] = file.stat().st_size / (time.monotonic() - begin)
            if way == "raw":
                zstd = zstd_seconds(file) / (time.monotonic() - begin)
    end(owner)
    per_message = int((bytes_rate - packets * HEADERS) / arguments.rate)
    listener = load("listen", arguments, "--watchers", 1)
    sender = load("send", arguments, "--bytes", per_message)
    share["bare"], _ = measured(listener, arguments.seconds)
    end(sender)
    end(listener)
    cores = {"bare": share["bare"], "zstd": zstd, "raw": share["raw"], "compressed": share["compressed"]}
    lines = [(f"{name}/cpu", "%", 100 * core) for name, core in cores.items()]
    lines += [(f"{name}/file", "bytes/s", rate) for name, rate in size.items()]
    for key, unit, value in lines:
        print(json.dumps(figures.summary(f"recorded/{key}", unit, [value])))


if __name__ == "__main__":
    main()
