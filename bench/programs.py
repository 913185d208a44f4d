"""The stages of separate programs: the core compared with tf2, a reader beside a writer, memory, many daemons."""

import json
import os
import pathlib
import sys

import figures
import processes

SECONDS_FOR_A_STAGE = 900


def pinned():
    """The command that pins a program to the last core, because the first handles most of the interrupts."""
    return ["taskset", "-c", str(max(os.sched_getaffinity(0)))]


def core(quick, bin_dir, _work):
    """Google Benchmark's figures: each repetition is a value. The repetitions of all benchmarks are interleaved."""
    for name in ("core_bench", "time_bench"):
        program = bin_dir / name
        if not program.exists():
            raise processes.Skipped(f"{name} is not built")
        yield from google_benchmark(program, quick)


def google_benchmark(program, quick, options=(), repetitions=None):
    """Runs one program of Google Benchmark."""
    usual, seconds = (5, 0.02) if quick else (11, 0.2)
    printed = processes.output_of(
        pinned() + [program, *options, f"--benchmark_repetitions={repetitions or usual}",
                    f"--benchmark_min_time={seconds}", "--benchmark_format=json",
                    "--benchmark_enable_random_interleaving=true"], SECONDS_FOR_A_STAGE)
    measured = {}
    for run in json.loads(printed)["benchmarks"]:
        if run["run_type"] == "iteration":
            # Processor time: these benchmarks never wait, and the time of other programs must not count.
            value, unit = run["cpu_time"], run["time_unit"]
            if "bytes" in run:  # measures memory, not time
                value, unit = run["bytes"], "bytes"
            key = run["run_name"].removesuffix("/iterations:1")
            measured.setdefault(key, []).append((run["repetition_index"], value, unit))
    for key, entries in measured.items():
        yield figures.summary(key, entries[0][2], [value for _, value, _ in sorted(entries)])


def contention(quick, bin_dir, _work):
    """The program prints figures and pins its threads itself."""
    program = bin_dir / "contention_bench"
    if not program.exists():
        raise processes.Skipped("contention_bench is not built")
    seconds, repetitions = ("0.3", "5") if quick else ("3", "7")
    yield from printed_figures([program, seconds, repetitions])


def memory(_quick, bin_dir, _work):
    """The heap that a frame takes."""
    program = bin_dir / "memory_bench"
    if not program.exists():
        raise processes.Skipped("memory_bench is not built")
    yield from printed_figures([program])


def printed_figures(command):
    """The figures that a program prints, one line of JSON each."""
    for line in processes.output_of(command, SECONDS_FOR_A_STAGE).splitlines():
        if line.startswith("{"):
            yield json.loads(line)


# What bench/scaling.py calls a value, its key and unit.
OF_MANY = {"known_s": ("many/32/all_known", "s"), "new_participant_s": ("many/32/newcomer", "s"),
           "rss_kib": ("many/32/memory", "KiB")}


def many(quick, bin_dir, _work):
    """32 daemons with 100,000 frames: started at once, until a new participant has all frames; after that, until
    another one has them; the memory of a daemon."""
    rows = []
    for _ in range(1 if quick else 3):
        printed = processes.output_of([sys.executable, pathlib.Path(__file__).with_name("scaling.py"), "--bin", bin_dir,
                                       "--partitions", "32"], SECONDS_FOR_A_STAGE)
        rows += [row for row in map(json.loads, printed.splitlines()) if row["frames"] > row["daemons"]]
    for name, (key, unit) in OF_MANY.items():
        yield figures.summary(key, unit, [row[name] for row in rows])


def around(quick, bin_dir, _work):
    """What users have around the core: the bridge to ROS 2, the recorder, the Python package."""
    if os.geteuid() != 0:
        raise processes.Skipped("needs root, for a network of its own")
    here = pathlib.Path(__file__).parent
    seconds = "2" if quick else "10"
    environment = {**os.environ, "PYTHONPATH": str(bin_dir.parent / "python")}
    for program, options in (("ros/run.py", ["--seconds", seconds]), ("recorded.py", ["--seconds", seconds]),
                             ("python.py", ["--rounds", "3" if quick else "10"])):
        printed = processes.output_of([sys.executable, here / program, *options], SECONDS_FOR_A_STAGE, env=environment)
        yield from map(json.loads, printed.splitlines())
