#!/usr/bin/env python3
"""Writes the tables of figures in the README and in docs/performance.md from bench/results/latest.json, so that they
cannot grow old. scripts/bench calls it after a run; a test compares the pages with the results.

A table stands between two comments: "<!-- figures: NAME -->" and "<!-- end of figures -->".
"""

import json
import pathlib
import re

import processes
from figures import as_measured, microseconds, number, ratio

RESULTS = processes.ROOT / "bench" / "results" / "latest.json"
PAGES = ("README.md", "docs/performance.md")
PLACE = re.compile(r"(<!-- figures: (\w+) -->\n).*?(<!-- end of figures -->)", re.DOTALL)

TF2 = "tf2, without covariance"
BARE = "bare Fast DDS"
# What, in which tables, our key, and the name and key of what it is compared with.
ROWS = (
    ("look up 30 own edges, with covariance", "short long", "core/lookup/ours_by_handle/30/100",
     TF2, "core/lookup/tf2/30/100"),
    ("the pose alone", "long", "core/lookup/ours_pose/30/100", TF2, "core/lookup/tf2/30/100"),
    ("look up 2 own edges, with covariance", "long", "core/lookup/ours_by_handle/2/10",
     TF2, "core/lookup/tf2/2/10"),
    ("look up 30 edges in the past, between samples of 100 Hz", "short long",
     "core/lookup_at_100hz/ours_by_handle/30/100", TF2, "core/lookup_at_100hz/tf2/30/100"),
    ("look up 30 edges in the past, between samples of 1 kHz", "long", "core/lookup_at/ours_by_handle/30/100",
     TF2, "core/lookup_at/tf2/30/100"),
    ("set an own edge", "short long", "core/set/ours_by_handle/30/100", "tf2", "core/set/tf2/30/100"),
    ("add a sample to an own edge with a full history", "long", "core/set_history/ours_by_handle/2/100",
     "tf2", "core/set_history/tf2/2/100"),
    ("read a watched path of 10 edges, with covariance", "short long", "pushed/latest", None, None),
    ("add and remove a frame among 100,000", "long", "core/add_remove/ours/1000/100000", None, None),
    ("look up in another process", "short long", "floor/lookup/ours/two_cores", BARE, "floor/lookup/dds/two_cores"),
    ("update in another process", "long", "floor/update/ours/two_cores", BARE, "floor/update/dds/two_cores"),
    ("from `update()` until a watcher in another process has the value", "long", "pushed/latency/ours",
     BARE, "pushed/latency/dds"),
    ("look up over 16 partitions", "short long", "scale/partitions/16/decentralized",
     "one central server", "scale/partitions/16/centralized"),
    ("100 edges at 1 kHz, streamed: the owner's share of a core", "short long", "stream/1khz/owner_cpu", None, None),
)


def of(figure):
    """A figure's median with its unit."""
    if figure["unit"] == "%":
        return f"{number(as_measured(figure))} %"
    return f"{number(microseconds(figure))} µs"


def table(figures, name):
    """The table of this name; rows without figures are left out."""
    lines = ["| median | tf-dude | for comparison | ratio |", "| --- | ---: | ---: | ---: |"]
    for what, where, ours, other, theirs in ROWS:
        if name not in where.split() or ours not in figures or (other and theirs not in figures):
            continue
        compared = [f"{other}: {of(figures[theirs])}", number(ratio(figures, ours, theirs))] if other else ["", ""]
        lines.append(f"| {what} | {of(figures[ours])} | {compared[0]} | {compared[1]} |")
    return "\n".join(lines) + "\n"


def filled(text, results):
    """A page's text with its tables written anew."""
    machine = results["machine"]
    when = f"\nMeasured on {machine['date'].split()[0]} on a virtual machine with {machine['cores']} cores " \
           f"({machine['cpu']}; Debian's Fast DDS and tf2).\nThe ratios differ between machines.\n"
    return PLACE.sub(lambda found: found[1] + table(results["figures"], found[2]) + when + found[3], text)


def main():
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    for page in PAGES:
        path = pathlib.Path(processes.ROOT / page)
        path.write_text(filled(path.read_text(encoding="utf-8"), results), encoding="utf-8")


if __name__ == "__main__":
    main()
