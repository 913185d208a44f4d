#!/usr/bin/env python3
"""Measures the cost of large numbers of partitions and frames; run by scripts/scaling.

  scaling.py [--bin DIR] [--frames N] [--partitions N,N,...] [--discovery-server]

For each number of daemons, which share the frames evenly, it measures: the time until all of them serve, the time of a
new participant to list all frames, memory, the cost of idling, the cost of an added frame for the other daemons, and
which daemons are woken by requests. With the rights for it, it runs in its own network namespace, so that only its own
packets are counted.
"""

import argparse
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import processes
from usage import loopback, seconds_of, status_of

IDLE_S = 5.0
ADDED = 200
LOOKUPS = 2000
SERVER_PORT = 11811


def enter_namespace():
    """Restarts this program in its own network namespace. Returns whether it runs in one."""
    if os.environ.get("TFDUDE_SCALING_ALONE"):
        subprocess.run(["ip", "link", "set", "lo", "up", "multicast", "on"], check=True)
        subprocess.run(["ip", "route", "add", "239.0.0.0/8", "dev", "lo"], check=True)
        return True
    if shutil.which("unshare") is None or shutil.which("ip") is None:
        return False
    if subprocess.run(["unshare", "-n", "ip", "link", "set", "lo", "up"], stderr=subprocess.DEVNULL).returncode != 0:
        return False
    os.environ["TFDUDE_SCALING_ALONE"] = "1"
    os.execvp("unshare", ["unshare", "-n", sys.executable, *sys.argv])


def wakes_of(pid):
    """How often the threads of a process have gone to sleep, which is how often they were woken."""
    total = 0
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        for line in (task / "status").read_text().splitlines():
            if line.startswith("voluntary_ctxt_switches:"):
                total += int(line.split()[1])
    return total


def configurations(work, count, frames):
    """One file per daemon. The first frames of all daemons form a chain; each frame has up to ten others below it."""
    files = []
    for number in range(count):
        own = frames // count + (1 if number < frames % count else 0)
        lines = [f"partition: p{number}", "frames:", f"  - {{id: p{number}_0"
                 + (f", parent: p{number - 1}_0}}" if number else "}")]
        for frame in range(1, own):
            lines.append(f"  - {{id: p{number}_{frame}, parent: p{number}_{(frame - 1) // 10}, xyz: [0.1, 0, 0]}}")
        path = work / f"p{number}.yaml"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        files.append(path)
    return files


class Run:
    """The running daemons, and the measurements of them."""

    def __init__(self, bin_dir, running, domain, options):
        self.bin_dir, self.running, self.options = bin_dir, running, options
        self.common = ["--domain", str(domain), "--timeout", "20000", *options]

    def tfdude(self, *arguments):
        return processes.output_of([self.bin_dir / "tfdude", *self.common, *arguments], 60)

    def listed(self):
        """The number of frames that a new process lists; 0 if it discovers nobody in time."""
        try:
            return len(self.tfdude("frames").splitlines())
        except RuntimeError:
            return 0

    def await_known(self, frames):
        """Waits until a new process lists all frames, after the daemons have started all at once."""
        deadline = time.monotonic() + processes.PATIENCE_S
        while self.listed() != frames:
            if time.monotonic() > deadline:
                raise RuntimeError(f"no new participant lists {frames} frames")

    def list_all(self, frames):
        """Seconds until a new process has listed all frames."""
        begin = time.monotonic()
        listed = self.listed()
        if listed != frames:
            raise RuntimeError(f"a new participant lists {listed} frames of {frames}")
        return time.monotonic() - begin

    def over(self, work):
        """Measures while work() runs: seconds, packets, bytes, and per daemon wake-ups and processor time."""
        pids = [process.pid for process in self.running]
        before = loopback(), [(wakes_of(pid), seconds_of(pid)) for pid in pids], time.monotonic()
        work()
        span = time.monotonic() - before[2]
        after = loopback()
        each = [(wakes_of(pid) - wakes, seconds_of(pid) - seconds)
                for pid, (wakes, seconds) in zip(pids, before[1])]
        return {"seconds": span, "packets": after[0] - before[0][0], "bytes": after[1] - before[0][1],
                "wakes": [one[0] for one in each], "cpu": [one[1] for one in each]}


def measure(bin_dir, count, frames, server):
    """One row of the table."""
    options = ["--profile", str(processes.PROFILE)]
    if server:
        options += ["--discovery-server", f"127.0.0.1:{SERVER_PORT}"]
    domain, lease = processes.lease_domain()
    with tempfile.TemporaryDirectory() as folder, lease:
        work = pathlib.Path(folder)
        files = configurations(work, count, frames)
        begin = time.monotonic()
        with processes.daemons(bin_dir, files, domain, work, options) as running:
            started = time.monotonic() - begin
            run = Run(bin_dir, running, domain, options)
            run.await_known(frames)
            row = {"daemons": count, "frames": frames, "started_s": started,
                   "known_s": time.monotonic() - begin,
                   "new_participant_s": statistics.median(run.list_all(frames) for _ in range(5)),
                   "rss_kib": statistics.median(status_of(one.pid, "VmRSS") for one in running)}
            idle = run.over(lambda: time.sleep(IDLE_S))
            row["idle_packets_s"] = idle["packets"] / idle["seconds"]
            row["idle_bytes_s"] = idle["bytes"] / idle["seconds"]
            row["idle_cores"] = sum(idle["cpu"]) / idle["seconds"]
            row["idle_wakes_s"] = statistics.median(idle["wakes"]) / idle["seconds"]
            row.update(changes(run, idle))
            return row


def changes(run, idle):
    """The cost of frames added to the second daemon, and of lookups that it answers, for it and for the others."""
    def load(mode, calls):
        processes.output_of([run.bin_dir / "scale_load", mode, "--calls", str(calls), *run.common], 120)

    def calls_of(mode, calls):
        """The cost of a call, without that of a client's start and end."""
        none, all_of = run.over(lambda: load(mode, 1)), run.over(lambda: load(mode, calls + 1))
        span = all_of["seconds"] - none["seconds"]
        quiet = {key: idle[key] / idle["seconds"] * span for key in ("packets", "bytes")}
        wakes = [(b - a - i / idle["seconds"] * span) / calls
                 for a, b, i in zip(none["wakes"], all_of["wakes"], idle["wakes"])]
        return {"packets": (all_of["packets"] - none["packets"] - quiet["packets"]) / calls,
                "bytes": (all_of["bytes"] - none["bytes"] - quiet["bytes"]) / calls,
                "owner": wakes[1], "others": statistics.median(wakes[:1] + wakes[2:])}

    adding, looking = calls_of("add", ADDED), calls_of("lookup", LOOKUPS)
    return {"add_packets": adding["packets"], "add_bytes": adding["bytes"], "add_wakes_other": adding["others"],
            "lookup_packets": looking["packets"], "lookup_wakes_owner": looking["owner"],
            "lookup_wakes_other": looking["others"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=processes.ROOT / "build/release/bin")
    parser.add_argument("--frames", type=int, default=100000)
    parser.add_argument("--partitions", default="2,4,8,16,32")
    parser.add_argument("--discovery-server", action="store_true", help="discovery by Fast DDS's discovery server")
    arguments = parser.parse_args()
    if not enter_namespace():
        print("scaling: packets of others are counted, too: needs root and iproute2", file=sys.stderr)
    server = None
    if arguments.discovery_server:
        server = subprocess.Popen(["fast-discovery-server", "-i", "0", "-l", "127.0.0.1", "-p", str(SERVER_PORT)],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for count in map(int, arguments.partitions.split(",")):
            for frames in sorted({count, arguments.frames}):
                print(json.dumps(measure(arguments.bin, count, frames, server is not None)), flush=True)
    finally:
        if server is not None:
            processes.end(server)


if __name__ == "__main__":
    main()
