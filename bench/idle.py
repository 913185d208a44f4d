#!/usr/bin/env python3
"""Measures what idle daemons and clients cost, beside bare Fast DDS participants; run by scripts/scaling --idle.

  idle.py [--bin DIR] [--rounds N] [--sizes DAEMONS+CLIENTS,...]

For each size it starts, in turn, as many bare participants with the same readers and writers, and then daemons with one
frame each and clients that print events. It counts packets on the loopback interface and processor time while nothing
happens; then it measures how long a new participant needs for its answers. Needs root for its own network namespace;
otherwise packets of others are counted, too.
"""

import argparse
import contextlib
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import processes
import scaling

IDLE_S = 6.0
QUESTIONS = 15


@contextlib.contextmanager
def running(commands):
    """Starts programs one after the other; each says in a line that it is ready. Yields the processes."""
    started = []
    try:
        for command in commands:
            started.append(subprocess.Popen([str(part) for part in command], stdin=subprocess.PIPE,
                                            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0))
        for process in started:
            processes.await_line(process.stdout, process.args[0])
        yield started
    finally:
        for process in started:
            processes.end(process)


def settle(started):
    """Waits until they have discovered each other: two processors need some 0.3 s for each."""
    time.sleep(5 + 0.4 * len(started))


def cost_of(started):
    """What these processes cost while nothing happens."""
    settle(started)
    before = scaling.loopback(), [scaling.seconds_of(one.pid) for one in started], time.monotonic()
    time.sleep(IDLE_S)
    span = time.monotonic() - before[2]
    packets, size = scaling.loopback()
    used = sum(scaling.seconds_of(one.pid) for one in started) - sum(before[1])
    threads = [len(list(pathlib.Path(f"/proc/{one.pid}/task").iterdir())) for one in started]
    return {"packets_s": (packets - before[0][0]) / span, "kB_s": (size - before[0][1]) / span / 1000,
            "cores": used / span, "threads": statistics.median(threads),
            "rss_kib": statistics.median(scaling.status_of(one.pid, "VmRSS") for one in started),
            "anonymous_kib": statistics.median(scaling.status_of(one.pid, "RssAnon") for one in started)}


def milliseconds(command):
    """How long a new participant takes for its answer."""
    times = []
    for _ in range(QUESTIONS):
        begin = time.monotonic()
        subprocess.run([str(part) for part in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                       timeout=processes.PATIENCE_S, check=False)
        times.append((time.monotonic() - begin) * 1000)
    return statistics.median(times)


def measure(bin_dir, daemons, clients):
    """One row: bare participants, then ours."""
    domain, lease = processes.lease_domain()
    common = ["--domain", domain, "--profile", processes.PROFILE]
    with tempfile.TemporaryDirectory() as folder, lease:
        bare = [[bin_dir / "bare_participant", domain, processes.PROFILE, "owner"]] * daemons
        bare += [[bin_dir / "bare_participant", domain, processes.PROFILE, "client"]] * clients
        with running(bare) as started:
            control = cost_of(started)
        files = scaling.configurations(pathlib.Path(folder), daemons, daemons)
        ours = [[bin_dir / "tfduded", "--no-state", "--config", file, *common] for file in files]
        with running(ours) as owners:
            watch = [[bin_dir / "tfdude", *common, "events"]] * clients
            with contextlib.ExitStack() as all_of:
                listeners = []
                for command in watch:
                    listeners.append(all_of.enter_context(subprocess.Popen(
                        [str(part) for part in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)))
                try:
                    row = {"daemons": daemons, "clients": clients, "bare": control,
                           "ours": cost_of(owners + listeners), "new_participant_ms": {}}
                    tfdude = [bin_dir / "tfdude", *common]
                    for name, command in {"lookup": ["lookup", "p0_0", f"p{daemons - 1}_0"], "tree": ["tree"],
                                          "frames": ["frames"], "joints": ["joints"],
                                          "not there": ["lookup", "p0_0", "nowhere"]}.items():
                        row["new_participant_ms"][name] = milliseconds([*tfdude, *command])
                finally:
                    for one in listeners:
                        processes.end(one)
        return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--idle", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--bin", type=pathlib.Path, default=processes.ROOT / "build/release/bin")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--sizes", default="4+0,8+0,16+0,32+0,4+40,10+100")
    arguments = parser.parse_args()
    if not scaling.enter_namespace():
        print("idle: packets of others are counted, too: needs root and iproute2", file=sys.stderr)
    for size in arguments.sizes.split(","):
        daemons, _, clients = size.partition("+")
        for _ in range(arguments.rounds):
            print(json.dumps(measure(arguments.bin, int(daemons), int(clients or 0))), flush=True)


if __name__ == "__main__":
    main()
