#!/usr/bin/env python3
"""Compares this tree with another commit: builds both, runs them in turn, and prints what is faster or slower beyond
the noise of the machine. scripts/bench --compare COMMIT calls it, on an idle machine; under 10 minutes with a warm
ccache.

Both run once in each round, in alternating order. A figure's ratio is that of one round, present / commit; the table
has the median of the rounds and its interval. The interval leaves out the lowest and the highest round: with ten
rounds it contains the true median with a probability of 98 %. A figure has changed if its interval does not contain 1
and its median differs from 1 by at least 2 %.
"""

import argparse
import dataclasses
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import figures
import net_stage
import processes
import programs

TREE = processes.ROOT / "build" / "compare"
TARGETS = ("core_bench", "time_bench", "contention_bench", "floor_bench", "floor_echo", "stream_bench")
LEAST_CHANGE = 0.02
# Figures that say how well the rest was measured, and those of other programs.
LEFT_OUT = ("tf2", "/dds/", "/udp/", "lost", "torn")


def counts(figure):
    """Whether less of it is better, and it is ours."""
    return figure["n"] > 0 and figure["unit"] != "Hz" and not any(word in figure["key"] for word in LEFT_OUT)


@dataclasses.dataclass(frozen=True)
class Change:
    """A figure in both builds; the ratio is present / commit."""

    key: str
    unit: str
    before: float
    after: float
    ratio: float
    low: float
    high: float

    @property
    def verdict(self):
        """"slower" or "faster", or an empty text if it is within the noise."""
        if abs(self.ratio - 1) < LEAST_CHANGE or self.low <= 1 <= self.high:
            return ""
        return "slower" if self.ratio > 1 else "faster"


def changes(before, after):
    """The changes of all figures that both have; each side is a list of rounds, a dict of figures by key."""
    for key in sorted(set(before[0]) & set(after[0])):
        pairs = [(b[key]["median"], a[key]["median"]) for b, a in zip(before, after) if key in b and key in a]
        ratios = sorted(now / then for then, now in pairs if then > 0)
        if len(ratios) < 4:
            continue
        yield Change(key, before[0][key]["unit"], statistics.median(then for then, _ in pairs),
                     statistics.median(now for _, now in pairs), statistics.median(ratios), ratios[1], ratios[-2])


def table(found):
    """All changes as text: first those beyond the noise, the greatest first."""
    order = sorted(found, key=lambda change: (not change.verdict, -abs(change.ratio - 1)))
    width = max((len(change.key) for change in order), default=0)
    lines = [f"{'':8}{'':{width}}  {'commit':>10} {'present':>10}      ratio  interval"]
    for change in order:
        lines.append(f"{change.verdict:8}{change.key:{width}}  {figures.number(change.before):>10} "
                     f"{figures.number(change.after):>10} {change.unit:3} {change.ratio:7.3f}  "
                     f"{change.low:.3f} to {change.high:.3f}")
    return "\n".join(lines)


def checked_out(commit):
    """A clone of this repository below build/, at the commit; one folder for all commits, so that builds are short."""
    git = ["git", "-C", str(processes.ROOT)]
    sha = subprocess.run([*git, "rev-parse", "--verify", f"{commit}^{{commit}}"], check=True, text=True,
                         stdout=subprocess.PIPE).stdout.strip()
    if not (TREE / ".git").exists():
        subprocess.run(["git", "clone", "--quiet", "--shared", "--no-checkout", str(processes.ROOT), str(TREE)],
                       check=True)
    subprocess.run(["git", "-C", str(TREE), "checkout", "--quiet", "--force", sha], check=True)
    return sha


def built(root):
    """Builds the benchmarks of a tree; returns the folder of its programs."""
    subprocess.run([str(root / "scripts" / "build"), "--bench", *TARGETS], cwd=root, check=True)
    return root / "build" / "release" / "bin"


def one_round(bin_dir):
    """The figures of one short run of a build, by key."""
    measured = {}
    with tempfile.TemporaryDirectory(prefix="tfdude-compare-") as work:
        stage = net_stage.Stage(bin_dir, pathlib.Path(work))
        sources = [*(programs.google_benchmark(bin_dir / name, True, ["--benchmark_filter=-tf2"], 1)
                     for name in ("core_bench", "time_bench")),
                   programs.contention(True, bin_dir, work), net_stage.floor(stage, True),
                   net_stage.stream(stage, True)]
        for source in sources:
            for figure in source:
                if counts(figure):
                    measured[figure["key"]] = figure
    return measured


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", help="the commit to compare with, such as HEAD~1")
    parser.add_argument("--rounds", type=int, default=10, help="%(default)s; at least 4")
    chosen = parser.parse_args()
    sha = checked_out(chosen.commit)
    builds = built(TREE), built(processes.ROOT)
    rounds = [], []
    begin = time.monotonic()
    for number in range(chosen.rounds):
        print(f"round {number + 1} of {chosen.rounds}", flush=True)
        for side in (0, 1) if number % 2 == 0 else (1, 0):
            rounds[side].append(one_round(builds[side]))
    found = list(changes(*rounds))
    print(f"\nThis tree beside {sha[:12]}, {chosen.rounds} rounds in {time.monotonic() - begin:.0f} s; "
          "lower is better")
    print(table(found))
    slower = [change.key for change in found if change.verdict == "slower"]
    sys.exit(f"slower: {', '.join(slower)}" if slower else 0)


if __name__ == "__main__":
    main()
