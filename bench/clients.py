#!/usr/bin/env python3
"""Measures what clients cost beside daemons with many frames; run by scripts/scaling --clients.

  clients.py [--bin DIR] [--frames N] [--daemons N] [--rounds N]

The program compares clients that keep all frames with clients that follow one tree: the bytes on the loopback interface
until they know their frames, and per second while nothing happens, each without those of the daemons; and resident
memory. Then it measures one-shot commands: time, bytes and the maximum of resident memory. Needs root for its own
network namespace; otherwise packets of others are counted, too.
"""

import argparse
import contextlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import processes
import scaling
import usage

START_S = 8.0
IDLE_S = 6.0
ROUNDS = 15


def received(span):
    """Bytes per second on the loopback interface."""
    before, begin = usage.loopback()[1], time.monotonic()
    time.sleep(span)
    return (usage.loopback()[1] - before) / (time.monotonic() - begin)


@contextlib.contextmanager
def client(command):
    """Runs a client that says in a line that it knows its frames. Yields the process."""
    with subprocess.Popen([str(part) for part in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          bufsize=0) as process:
        try:
            processes.await_line(process.stdout, "scale_load")
            yield process
        finally:
            processes.end(process)


def idle_client(command, quiet):
    """What one client costs. `quiet`: bytes per second without it."""
    before, begin = usage.loopback()[1], time.monotonic()
    with client(command) as process:
        ready = time.monotonic() - begin
        time.sleep(START_S - ready)
        start = usage.loopback()[1] - before - quiet * (time.monotonic() - begin)
        idle = received(IDLE_S) - quiet
        return {"ready_s": ready, "start_kB": start / 1000, "idle_kB_s": idle / 1000,
                "rss_MiB": usage.status_of(process.pid, "VmRSS") / 1024,
                "anonymous_MiB": usage.status_of(process.pid, "RssAnon") / 1024}


def one_shot(command, quiet):
    """What a command costs that ends by itself: medians."""
    rows = []
    for _ in range(ROUNDS):
        before, begin = usage.loopback()[1], time.monotonic()
        process = subprocess.Popen([str(part) for part in command], stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        took = time.monotonic() - begin
        rows.append((took * 1000, (usage.loopback()[1] - before - quiet * took) / 1000, used.ru_maxrss / 1024))
        time.sleep(0.2)
    ms, kilobytes, memory = (statistics.median(row[i] for row in rows) for i in range(3))
    return {"ms": ms, "kB": kilobytes, "max_rss_MiB": memory}


def measure(bin_dir, count, frames, rounds):
    """Prints one line for each kind of client and round."""
    domain, lease = processes.lease_domain()
    profile = ["--profile", str(processes.PROFILE)]
    options = ["--domain", str(domain), "--timeout", "20000", *profile]
    with tempfile.TemporaryDirectory() as folder, lease:
        work = pathlib.Path(folder)
        files = scaling.configurations(work, count, frames)
        with processes.daemons(bin_dir, files, domain, work, profile) as running:
            scaling.Run(bin_dir, running, domain, profile).await_known(frames)
            time.sleep(5)
            quiet = received(IDLE_S)
            load = [bin_dir / "scale_load", "idle", "--calls", "0", *options]
            tfdude = [bin_dir / "tfdude", *options]
            last = f"p{count - 1}_{frames // count - 1}"
            for _ in range(rounds):
                for name, command in {"keeps all": load, "follows one tree": [*load, "--follow", "p1_100"]}.items():
                    print(json.dumps({"client": name, **idle_client(command, quiet)}), flush=True)
                for name, command in {"lookup": ["lookup", "p0_100", last], "exists": ["exists", last],
                                      "not there": ["exists", "nowhere"], "frames": ["frames"]}.items():
                    print(json.dumps({"command": name, **one_shot([*tfdude, *command], quiet)}), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clients", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--bin", type=pathlib.Path, default=processes.ROOT / "build/release/bin")
    parser.add_argument("--frames", type=int, default=100000)
    parser.add_argument("--daemons", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=1)
    arguments = parser.parse_args()
    if not scaling.enter_namespace():
        print("clients: packets of others are counted, too: needs root and iproute2", file=sys.stderr)
    measure(arguments.bin, arguments.daemons, arguments.frames, arguments.rounds)


if __name__ == "__main__":
    main()
