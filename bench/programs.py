"""The stages that are one program each: the core beside tf2, and readers beside a writer."""

import json
import os

import figures
import processes

SECONDS_FOR_A_STAGE = 900


def pinned():
    """The command that keeps a program on the last core: the first has most of the interrupts."""
    return ["taskset", "-c", str(max(os.sched_getaffinity(0)))]


def core(quick, bin_dir, _work):
    """Google Benchmark's figures: a repetition is a value. Repetitions of all are interleaved."""
    for name in ("core_bench", "time_bench"):
        program = bin_dir / name
        if not program.exists():
            raise processes.Skipped(f"{name} is not built")
        yield from google_benchmark(program, quick)


def google_benchmark(program, quick):
    """Runs one such program."""
    repetitions, seconds = (5, 0.02) if quick else (11, 0.2)
    printed = processes.output_of(
        pinned() + [program, f"--benchmark_repetitions={repetitions}",
                    f"--benchmark_min_time={seconds}", "--benchmark_format=json",
                    "--benchmark_enable_random_interleaving=true"], SECONDS_FOR_A_STAGE)
    measured = {}
    for run in json.loads(printed)["benchmarks"]:
        if run["run_type"] == "iteration":
            # Of the processor: nothing in these waits, and what else runs is not theirs.
            value, unit = run["cpu_time"], run["time_unit"]
            if "bytes" in run:  # what is weighed, not timed
                value, unit = run["bytes"], "bytes"
            key = run["run_name"].removesuffix("/iterations:1")
            measured.setdefault(key, []).append((run["repetition_index"], value, unit))
    for key, entries in measured.items():
        yield figures.summary(key, entries[0][2], [value for _, value, _ in sorted(entries)])


def contention(quick, bin_dir, _work):
    """Prints figures itself; it places its threads itself, too."""
    program = bin_dir / "contention_bench"
    if not program.exists():
        raise processes.Skipped("contention_bench is not built")
    seconds, repetitions = ("0.3", "5") if quick else ("3", "7")
    printed = processes.output_of([program, seconds, repetitions], SECONDS_FOR_A_STAGE)
    for line in printed.splitlines():
        if line.startswith("{"):
            yield json.loads(line)
