#!/usr/bin/env python3
"""Measures what idle daemons and clients cost, beside bare Fast DDS participants; run by scripts/scaling --idle.

  idle.py [--bin DIR] [--rounds N] [--sizes DAEMONS+CLIENTS,...] [--questions N]

For each size it starts, in turn, as many bare participants with the same readers and writers, and then daemons with one
frame each and clients that print events. It counts packets on the loopback interface and processor time while nothing
happens; then it measures how long a new participant needs for its answers: among the bare ones, until one of them has
answered one request. Needs root for its own network namespace; otherwise packets of others are counted, too.
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
import usage

IDLE_S = 6.0
ANNOUNCED_EVERY_S = 0.3  # by each participant (profiles/loopback.xml)
SETTLED_WITHIN_S = 60
CONSTANT_FOR_S = 3
MOST_IDLE_CORES = 1.6  # more means that they still discover each other
NOT_THERE = 1  # exit status of tfdude


def settle(started):
    """Waits until they have discovered each other: traffic is constant, and the processors are not busy. Returns how
    long that took, or None if it did not end in time."""
    begin = time.monotonic()
    counts = []
    while time.monotonic() < begin + SETTLED_WITHIN_S:
        before = usage.loopback()[0], sum(usage.seconds_of(one.pid) for one in started)
        time.sleep(1)
        counts.append(usage.loopback()[0] - before[0])
        busy = sum(usage.seconds_of(one.pid) for one in started) - before[1] > MOST_IDLE_CORES
        last = counts[-CONSTANT_FOR_S:]
        if len(last) == CONSTANT_FOR_S and not busy and max(last) < 1.2 * min(last) + 20:
            return time.monotonic() - begin
    return None


def await_idle(packets_s):
    """Waits until no more packets are sent than while the processes were idle: the last participant has left, and the
    others have handled that."""
    deadline = time.monotonic() + processes.PATIENCE_S
    while time.monotonic() < deadline:
        before = usage.loopback()[0]
        time.sleep(ANNOUNCED_EVERY_S)
        if usage.loopback()[0] - before < 1.2 * packets_s * ANNOUNCED_EVERY_S + 20:
            return
    raise RuntimeError(f"the processes have not become idle within {processes.PATIENCE_S} s")


def cost_of(started):
    """What these processes cost while nothing happens."""
    settled = settle(started)
    before = usage.loopback(), [usage.seconds_of(one.pid) for one in started], time.monotonic()
    time.sleep(IDLE_S)
    span = time.monotonic() - before[2]
    packets, size = usage.loopback()
    used = sum(usage.seconds_of(one.pid) for one in started) - sum(before[1])
    threads = [len(list(pathlib.Path(f"/proc/{one.pid}/task").iterdir())) for one in started]
    return {"settled_s": settled, "packets_s": (packets - before[0][0]) / span,
            "kB_s": (size - before[0][1]) / span / 1000, "cores": used / span, "threads": statistics.median(threads),
            "rss_kib": statistics.median(usage.status_of(one.pid, "VmRSS") for one in started),
            "anonymous_kib": statistics.median(usage.status_of(one.pid, "RssAnon") for one in started)}


def milliseconds(command, questions, packets_s, status=0):
    """How long a new participant takes for its answer, with this exit status, beside processes that send so many
    packets while they are idle."""
    times = []
    for _ in range(questions):
        await_idle(packets_s)
        begin = time.monotonic()
        run = subprocess.run([str(part) for part in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                             timeout=processes.PATIENCE_S, check=False)
        times.append((time.monotonic() - begin) * 1000)
        if run.returncode != status:
            raise RuntimeError(f"{command[-3:]} ended with {run.returncode}: {run.stderr.decode()}")
    return {"median": statistics.median(times), "longest": max(times)}


def measure(bin_dir, daemons, clients, questions):
    """One row: bare participants, then ours."""
    domain, lease = processes.lease_domain()
    common = ["--domain", domain, "--profile", processes.PROFILE]
    with tempfile.TemporaryDirectory() as folder, lease:
        program = [bin_dir / "bare_participant", domain, processes.PROFILE]
        bare = [[*program, "server", "asked"]]
        bare += [[*program, "owner"]] * (daemons - 1) + [[*program, "client"]] * clients
        with processes.running(bare) as started:
            control = cost_of(started)
            control["new_participant_ms"] = milliseconds([*program, "asker", "asked"], questions,
                                                         control["packets_s"])
        files = scaling.configurations(pathlib.Path(folder), daemons, daemons)
        ours = [[bin_dir / "tfduded", "--no-state", "--config", file, *common] for file in files]
        with processes.running(ours) as owners:
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
                    for name, command in {"lookup of one owner": ["lookup", "p0_0", "p1_0"],
                                          "lookup of all owners": ["lookup", "p0_0", f"p{daemons - 1}_0"],
                                          "tree": ["tree"], "frames": ["frames"], "joints": ["joints"]}.items():
                        row["new_participant_ms"][name] = milliseconds(
                            [*tfdude, *command], questions, row["ours"]["packets_s"])
                    row["new_participant_ms"]["not there"] = milliseconds(
                        [*tfdude, "lookup", "p0_0", "nowhere"], questions, row["ours"]["packets_s"], status=NOT_THERE)
                finally:
                    for one in listeners:
                        processes.end(one)
        return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--idle", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--bin", type=pathlib.Path, default=processes.ROOT / "build/release/bin")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--questions", type=int, default=15, help="new participants for each median")
    parser.add_argument("--sizes", default="4+0,8+0,16+0,32+0,4+40,10+100")
    arguments = parser.parse_args()
    if not scaling.enter_namespace():
        print("idle: packets of others are counted, too: needs root and iproute2", file=sys.stderr)
    for size in arguments.sizes.split(","):
        daemons, _, clients = size.partition("+")
        for _ in range(arguments.rounds):
            row = measure(arguments.bin, int(daemons), int(clients or 0), arguments.questions)
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
