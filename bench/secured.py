#!/usr/bin/env python3
"""Measures what keys cost: no keys, signed and encrypted messages in turns; run by scripts/scaling --secured.

  secured.py [--bin DIR] [--calls N] [--seconds N]

Prints a line of JSON per figure: the first meeting, which is a whole run of `tfdude lookup`; lookups and updates by
request, with both programs on one core; and a stream of 100 edges at 1 kHz, with a core for each program.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile
import time

import figures
import net_stage

HOW = ("plain", "signed", "encrypted")
MEETINGS = 40
REPETITIONS = 5
ONE_CORE = "0"
OWNER_CORE = "1"


def make_keys(stage, how):
    """A key store for the daemon of `base`, the owner of the stream, and a client of both. Returns its directory."""
    store = stage.work / how

    def keys(*arguments):
        subprocess.run([stage.bin_dir / "tfdude", "keys", *arguments], check=True, stdout=subprocess.DEVNULL)

    keys("init", store, *(["--sign"] if how == "signed" else []))
    keys("daemon", store, "base")
    keys("daemon", store, "joints")
    keys("client", store, "asker", "--move", "base", "--move", "joints")
    return store


def options_of(stores, how, identity):
    """The options of a program that is this identity."""
    return ["--keys", stores[how] / identity] if how in stores else []


def first_meetings(stage, stores):
    """How long a new process takes for its first lookup."""
    times = {how: [] for how in HOW}
    for _ in range(MEETINGS):
        for how in HOW:
            begin = time.monotonic()
            subprocess.run([stage.bin_dir / "tfdude", "--domain", str(stage.domain(how)), "--profile", stage.profile,
                            *options_of(stores, how, "asker"), "lookup", "chain_0", "chain_1"],
                           check=True, stdout=subprocess.DEVNULL)
            times[how].append((time.monotonic() - begin) * 1000)
    for how in HOW:
        yield figures.summary(f"secured/first_meeting/{how}", "ms", times[how])


def requests(stage, stores, calls):
    """Lookups and updates by request."""
    more = [word for how in stores for word in (f"--keys-{how}", stores[how] / "asker")]
    more += [word for how in HOW for word in (f"--domain-{how}", stage.domain(how))]
    yield from stage.measured(stage.command(ONE_CORE, "secured_bench", [
        "--profile", stage.profile, "--calls", calls, "--repetitions", REPETITIONS, *more]), 300)


def streams(stage, stores, seconds):
    """A stream of 100 edges, and of 30 joints, at 1 kHz."""
    for how in HOW:
        common = ["--shared", stage.work / f"stream_{how}", "--domain", stage.domain(f"stream {how}"),
                  "--profile", stage.profile]
        own = ["--mode", "own", *common, *options_of(stores, how, "joints")]
        publish = ["--mode", "publish", *common, *options_of(stores, how, "asker"), "--seconds", seconds,
                   "--repetitions", REPETITIONS]
        with stage.servers([stage.command(OWNER_CORE, "stream_bench", own)]):
            for line in stage.measured(stage.command(ONE_CORE, "stream_bench", publish), 300):
                yield {**line, "key": f"secured/{line['key']}/{how}"}


def measure(stage, calls, seconds):
    """Yields all figures."""
    stores = {how: make_keys(stage, how) for how in HOW if how != "plain"}
    config = net_stage.chain_config(stage.work, "base", 0, 2)
    daemons = [[*stage.daemon(ONE_CORE, stage.domain(how), config), *map(str, options_of(stores, how, "base"))]
               for how in HOW]
    with stage.servers(daemons):
        yield from first_meetings(stage, stores)
        yield from requests(stage, stores, calls)
    yield from streams(stage, stores, seconds)


def run(quick, bin_dir, work):
    """Yields the figures, as a stage of scripts/bench."""
    yield from measure(net_stage.Stage(bin_dir, work), 500 if quick else 5000, 1 if quick else 4)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--secured", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--bin", type=pathlib.Path, default=net_stage.processes.ROOT / "build/release/bin")
    parser.add_argument("--calls", type=int, default=2000)
    parser.add_argument("--seconds", type=int, default=2)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="tfdude-secured-") as work:
        for line in measure(net_stage.Stage(arguments.bin, pathlib.Path(work)), arguments.calls, arguments.seconds):
            print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
