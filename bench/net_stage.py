#!/usr/bin/env python3
"""The network benchmarks: starts the shipped daemons, pins all programs to cores, runs those of bench/net, and yields
their output, one dictionary per figure.

    python3 bench/net_stage.py [--quick] [--bin DIR]    prints the lines
"""

import argparse
import contextlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
from typing import Iterator

import figures
import processes
import usage

EXAMPLES = processes.ROOT / "examples" / "thesis"

ALL_CPUS = ",".join(map(str, sorted(os.sched_getaffinity(0))))

MEETING_S = 1.0  # time for many daemons to discover each other [s]
LEFT_S = 0.05  # time for the others to handle that a participant has left [s]


def patient_profile(work: pathlib.Path, profile: pathlib.Path) -> pathlib.Path:
    """The profile with a lease of 9 s, after which a silent participant counts as lost. A failed call ends a
    benchmark, and a virtual machine may stop for half a second within a quarter of an hour. The measured values do
    not depend on the lease."""
    shipped = profile.read_text()
    patient = shipped.replace("<leaseDuration><nanosec>450000000</nanosec>",
                              "<leaseDuration><sec>9</sec>")
    assert patient != shipped
    path = work / "patient.xml"
    path.write_text(patient)
    return path


class Stage:
    """Runs processes, and ends all of them."""

    def __init__(self, bin_dir: pathlib.Path, work: pathlib.Path, profile: pathlib.Path = processes.PROFILE):
        self.bin_dir = bin_dir
        self.work = work
        self.profile = patient_profile(work, profile)
        self.leases = {}

    def domain(self, name: str) -> int:
        """The DDS domain with this name in this stage; reserved at the first call."""
        if name not in self.leases:
            self.leases[name] = processes.lease_domain()
        return self.leases[name][0]

    def command(self, cpus: str, program: str, arguments: list) -> list[str]:
        return ["taskset", "-c", cpus, str(self.bin_dir / program), *map(str, arguments)]

    @contextlib.contextmanager
    def servers(self, commands: list[list[str]]) -> Iterator[list["Server"]]:
        """Starts all servers at once, and stops them at the end."""
        with open(self.work / "servers.log", "ab") as log, contextlib.ExitStack() as started:
            running = []
            for command in commands:
                server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, bufsize=0)
                running.append(server)
                started.callback(processes.end, server)
            # Sends the signal to all, before waiting for the first.
            started.callback(lambda: [server.terminate() for server in running])
            yield [Server(server, ready_line(server)) for server in running]

    def daemon(self, cpus: str, domain: int, config: pathlib.Path) -> list[str]:
        return self.command(
            cpus, "tfduded", ["--no-state", "--config", config, "--domain", domain, "--profile", self.profile]
        )

    def measured(self, command: list[str], deadline: float) -> Iterator[dict]:
        """Runs a benchmark for at most `deadline` seconds."""
        path = self.work / "benchmarks.log"
        with open(path, "ab") as log:
            benchmark = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
            try:
                lines, _ = benchmark.communicate(timeout=deadline)
            finally:
                processes.end(benchmark)
        if benchmark.returncode != 0:
            reasons = path.read_text().splitlines()[-3:]
            raise RuntimeError("\n".join([f"{' '.join(command)} failed:", *reasons]))
        for line in lines.splitlines():
            yield json.loads(line)


class Server:
    def __init__(self, process: subprocess.Popen, ready: str):
        self.ready = ready  # its line "ready ..."
        self.pid = process.pid

    def udp_port(self) -> str:
        return self.ready.split("udp_port=")[1].strip()

    def cpu(self) -> float:
        """Processor time used so far [s]."""
        return usage.seconds_of(self.pid)


def ready_line(server: subprocess.Popen) -> str:
    what = " ".join(server.args)
    line = processes.await_line(server.stdout, what)
    if not line.startswith("ready"):
        raise RuntimeError(f"{what} said: {line}")
    return line


def idle_cpu(key: str, servers: list[Server], seconds: float, repetitions: int) -> dict:
    """The processor time of all servers together while there are no requests [% of a core]."""
    shares = []
    for _ in range(repetitions):
        before, start = sum(server.cpu() for server in servers), time.monotonic()
        time.sleep(seconds)
        used = sum(server.cpu() for server in servers) - before
        shares.append(100 * used / (time.monotonic() - start))
    return figures.summary(key, "%", shares)


def merged(work: pathlib.Path, configs: list[pathlib.Path]) -> pathlib.Path:
    """A configuration of one partition, "central", with the frames of all configurations."""
    lines = ["partition: central", "frames:"]
    for config in configs:
        _, frames = config.read_text().split("\nframes:\n")
        lines.append(frames)
    path = work / "central.yaml"
    path.write_text("\n".join(lines))
    return path


def thesis(stage: Stage, quick: bool) -> Iterator[dict]:
    """The caller has one core, the daemons have the other."""
    central_domain = stage.domain("central")
    decentral_domain = stage.domain("decentral")
    calls, repetitions = (1000, 5) if quick else (60000, 5)  # full: 300,000 per case, as in the thesis
    configs = {name: EXAMPLES / f"{name}.yaml" for name in ("robot", "arms")}
    central = stage.daemon("1", central_domain, merged(stage.work, list(configs.values())))
    for asking, other in (("robot", "arms"), ("arms", "robot")):
        with stage.servers([central, stage.daemon("1", decentral_domain, configs[other])]):
            yield from stage.measured(
                stage.command("0", "thesis_bench",
                              ["--as", asking, "--config", configs[asking],
                               "--central", central_domain, "--domain", decentral_domain,
                               "--profile", stage.profile,
                               "--calls", calls, "--repetitions", repetitions]),
                60 if quick else 1200)


def floor(stage: Stage, quick: bool) -> Iterator[dict]:
    """On one core a wake-up is cheap, so the time is that of the programs' own work. Two cores are the usual case."""
    central_domain = stage.domain("central")
    floor_domain = stage.domain("floor")
    calls, repetitions = (1000, 5) if quick else (20000, 5)
    config = merged(stage.work, [EXAMPLES / "robot.yaml", EXAMPLES / "arms.yaml"])
    for placement, cpu in (("one_core", "0"), ("two_cores", "1")):
        floor_echo = stage.command(cpu, "floor_echo", ["--domain", floor_domain, "--profile", stage.profile,
                                                     "--partition", ""])
        with stage.servers([stage.daemon(cpu, central_domain, config), floor_echo]) as (_, echo):
            yield from stage.measured(
                stage.command("0", "floor_bench",
                              ["--placement", placement, "--central", central_domain,
                               "--domain", floor_domain, "--udp-port", echo.udp_port(), "--profile", stage.profile,
                               "--calls", calls, "--repetitions", repetitions]),
                60 if quick else 300)


def stream(stage: Stage, quick: bool) -> Iterator[dict]:
    """The publisher has one core, the owner has the other."""
    stream_domain = stage.domain("stream")
    seconds, repetitions = (1, 5) if quick else (8, 5)
    common = ["--shared", stage.work / "stream", "--domain", stream_domain, "--profile", stage.profile]
    with stage.servers([stage.command("1", "stream_bench", ["--mode", "own", *common])]):
        yield from stage.measured(
            stage.command("0", "stream_bench",
                          ["--mode", "publish", *common, "--seconds", seconds,
                           "--repetitions", repetitions]),
            60 if quick else 400)


def chain_config(work: pathlib.Path, partition: str, first: int, count: int,
                 others: int = 0) -> pathlib.Path:
    """`count` frames of the chain chain_0, chain_1... from `first` on, and `others` frames below chain_0."""
    value = "xyz: [0.1, 0.2, 0.3], rpy: [0.1, 0.2, 0.3], stddev: [0.01, 0.01, 0.01, 0.01, 0.01, 0.01]"
    lines = [f"partition: {partition}", "frames:"]
    for number in range(first, first + count):
        parent = f", parent: chain_{number - 1}, {value}" if number else ""
        lines.append(f"  - {{id: chain_{number}{parent}}}")
    lines += [f"  - {{id: other_{k}, parent: chain_0, {value}}}" for k in range(others)]
    path = work / f"{partition}.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


def scale_partitions(stage: Stage, quick: bool) -> Iterator[dict]:
    """The caller and the daemon of all frames have a core each; the partitions' daemons and the echoes share both
    cores. Two cores are few, because each daemon stands for a computer. The daemons of 32 partitions keep them busy
    with their presence alone (idle_cpu), so that row measures the machine."""
    central_domain = stage.domain("central")
    decentral_domain = stage.domain("decentral")
    floor_domain = stage.domain("floor")
    repetitions = 5
    for count in (2, 4, 8, 16) if quick else (1, 2, 4, 8, 16, 32):
        configs = [chain_config(stage.work, f"p{k}", 2 * k, 2) for k in range(count)]
        central = chain_config(stage.work, "central", 0, 2 * count)
        daemons = [stage.daemon(ALL_CPUS, decentral_domain, config) for config in configs]
        daemons.append(stage.daemon("1", central_domain, central))
        echoes = [stage.command(ALL_CPUS, "floor_echo",
                                ["--domain", floor_domain, "--profile", stage.profile, "--partition", k])
                  for k in range(count)]
        with stage.servers(daemons + echoes) as servers:
            time.sleep(MEETING_S)
            yield idle_cpu(f"scale/partitions/{count}/idle_cpu", servers[:count],
                           1 if quick else 2, repetitions)
            ports = ",".join(echo.udp_port() for echo in servers[-count:])
            yield from stage.measured(
                stage.command("0", "scale_bench",
                              ["--mode", "partitions", "--partitions", count,
                               "--central", central_domain, "--domain", decentral_domain,
                               "--floor", floor_domain, "--udp-ports", ports,
                               "--profile", stage.profile,
                               "--calls", (800 if quick else 8000) // count,
                               "--repetitions", repetitions]),
                60 if quick else 200)


def scale_clients(stage: Stage, quick: bool) -> Iterator[dict]:
    central_domain = stage.domain("central")
    calls, repetitions = (500, 5) if quick else (20000, 5)
    with stage.servers([stage.daemon("1", central_domain, chain_config(stage.work, "central", 0, 10))]):
        yield from stage.measured(
            stage.command("0", "scale_bench",
                          ["--mode", "clients", "--domain", central_domain, "--profile", stage.profile,
                           "--calls", calls, "--repetitions", repetitions]),
            60 if quick else 200)


def scale_frames(stage: Stage, quick: bool) -> Iterator[dict]:
    calls, repetitions = (200, 5) if quick else (5000, 5)
    frames = (10, 100, 1000, 10000)
    domains = [stage.domain(f"{count} frames") for count in frames]
    daemons = [stage.daemon("1", domain, chain_config(stage.work, f"n{count}", 0, 4, count - 4))
               for domain, count in zip(domains, frames)]
    named = [word for k, domain in enumerate(domains) for word in (f"--domain-{k}", domain)]
    with stage.servers(daemons):
        yield from stage.measured(
            stage.command("0", "scale_bench",
                          ["--mode", "frames", "--frames", ",".join(map(str, frames)), *named,
                           "--profile", stage.profile,
                           "--calls", calls, "--repetitions", repetitions]),
            60 if quick else 200)


def first_answer(stage: Stage, quick: bool) -> Iterator[dict]:
    """The whole run of a command that looks up a path over two daemons, and that of a bare client that asks two bare
    servers with the same readers and writers; in turn."""
    runs = 15 if quick else 100
    domain, bare_domain = stage.domain("decentral"), stage.domain("floor")
    bare = [bare_domain, stage.profile]
    daemons = [stage.daemon(ALL_CPUS, domain, chain_config(stage.work, f"p{k}", 2 * k, 2)) for k in range(2)]
    servers = [stage.command(ALL_CPUS, "bare_participant", [*bare, "server", k]) for k in range(2)]
    commands = {
        "ours": stage.command(ALL_CPUS, "tfdude", ["--domain", domain, "--profile", stage.profile,
                                                   "lookup", "chain_0", "chain_3"]),
        "dds": stage.command(ALL_CPUS, "bare_participant", [*bare, "asker", 0, 1])}
    with stage.servers(daemons + servers):
        time.sleep(MEETING_S)
        times = {who: [] for who in commands}
        for _ in range(runs):
            for who, command in commands.items():
                begin = time.monotonic()
                subprocess.run(command, stdout=subprocess.DEVNULL, check=True)  # with a timeout it polls
                times[who].append((time.monotonic() - begin) * 1000)
                time.sleep(LEFT_S)
    for who, values in times.items():
        yield figures.summary(f"first_answer/{who}", "ms", values)


PARTS = {
    "thesis": thesis,
    "floor": floor,
    "stream": stream,
    "scale_partitions": scale_partitions,
    "scale_clients": scale_clients,
    "scale_frames": scale_frames,
    "first_answer": first_answer,
}


def run(quick: bool, bin_dir: pathlib.Path, work: pathlib.Path) -> Iterator[dict]:
    stage = Stage(bin_dir, work)
    for part in PARTS.values():
        yield from part(stage, quick)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--bin", type=pathlib.Path, default=processes.ROOT / "build" / "release" / "bin")
    parser.add_argument("parts", nargs="*", metavar="part", help=f"of {', '.join(PARTS)}")
    arguments = parser.parse_args()
    # Exits in order, so that all started processes are stopped.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with tempfile.TemporaryDirectory(prefix="tfdude-bench-") as work:
        stage = Stage(arguments.bin, pathlib.Path(work))
        try:
            for name in arguments.parts or PARTS:
                for line in PARTS[name](stage, arguments.quick):
                    print(json.dumps(line), flush=True)
        except RuntimeError as error:
            sys.exit(str(error))


if __name__ == "__main__":
    main()
