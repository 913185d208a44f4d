#!/usr/bin/env python3
"""Draws the figures of docs/accuracy.md and writes its tables, from results of the library.

The page's text is written by hand; this program writes the tables between two markers.
"""

import argparse
import json
import pathlib
import re
import subprocess
import sys

import uncertainty_figures

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "accuracy.md"
FIGURES = ROOT / "docs" / "uncertainty"

# Results of an earlier reference run with its own 10^6 samples.
TWO_POSES_BEFORE = {1.0: ("29.8", "3.63", "0.395"), 0.2: ("", "0.143", "0.015")}
CHAIN_BEFORE = {"xx": ("0", "1.678"), "yy": ("295.5", ""), "ytheta": ("-4.455", ""),
                "thetatheta": ("0.09", "")}
CHAIN_NAMES = {"xx": "xx [m²]", "yy": "yy [m²]", "ytheta": "yθ [m·rad]",
               "thetatheta": "θθ [rad²]"}


def text(value, digits=3):
    """A number with so many significant digits, not as a power of ten."""
    shown = f"{value:.{digits}g}"
    if "e" in shown:
        shown = f"{value:.0f}" if abs(value) >= 1 else f"{value:.6f}".rstrip("0")
    return shown


def percent(share):
    return f"{100 * share:.1f} %"


def table(head, rows):
    """A Markdown table; the first column is left-aligned, the others are right-aligned."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1)] + rows
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def two_poses(results):
    rows = []
    for row in results["two_poses"]["rows"]:
        before = TWO_POSES_BEFORE.get(row["alpha"], ("", "", ""))
        ours = [row["norm"], row["second"]["error"], row["fourth"]["error"]]
        cells = [text(row["alpha"])]
        for mine, theirs in zip(ours, before):
            cells += [theirs, text(mine)]
        rows.append(cells + [f"{100 * ours[1] / ours[0]:.2g} %", f"{100 * ours[2] / ours[0]:.2g} %"])
    return table(["α", "‖Σ‖ recalled", "ours", "error of second order, recalled", "ours",
                  "error of fourth order, recalled", "ours", "second, relative",
                  "fourth, relative"], rows)


def chain(results):
    found = results["chain"]
    rows = []
    for key, name in CHAIN_NAMES.items():
        before = CHAIN_BEFORE[key]
        rows.append([name, before[0], text(found["second"][key], 4), before[1],
                     text(found["fourth"][key], 4), text(found["drawn"][key], 4)])
    return table(["", "second, recalled", "ours", "fourth, recalled", "ours", "sampled"], rows)


def chain_within(results):
    names = {"second": "second order, in (y, yaw)", "fourth": "fourth order, in (x, y, yaw)",
             "moments": "Gaussian with the samples' own mean and moments, in (x, y)"}
    rows = []
    for key, name in names.items():
        one, three = results["chain"]["within"][key]
        rows.append([name, percent(one["expected"]), percent(one["drawn"]),
                     percent(three["expected"]), percent(three["drawn"])])
    return table(["", "within 1σ, claimed", "sampled", "within 3σ, claimed", "sampled"], rows)


def fusion(results):
    trials = results["fusion"]["trials"]
    rows = [[text(row["alpha"]), f"{row['cost']:.2f}", text(row["error"]), text(row["claimed"]),
             f"{row['nees']:.2f}", f"{row['failed']} of {trials}"]
            for row in results["fusion"]["rows"]]
    return table(["α", "cost (12)", "error", "claimed", "NEES (6)", "failed"], rows)


CORRELATION_ROWS = (-0.9, -0.5, 0.0, 0.5, 0.9, 1.0)
ASSUMPTIONS = ("independent", "second", "fourth", "bound")


def correlation(results):
    rows = []
    for row in results["correlation"]["rows"]:
        if row["correlation"] not in CORRELATION_ROWS:
            continue
        rows.append([text(row["correlation"]), text(row["norm"])] +
                    [text(row[one]["error"], 2) for one in ASSUMPTIONS] +
                    [f"{row[one]['nees']:.2f}" for one in ASSUMPTIONS])
    return table(["correlation", "‖Σ‖ sampled", "error: independent", "shared, second",
                  "shared, fourth", "unknown", "NEES/6 independent", "shared, second",
                  "shared, fourth", "unknown"], rows)


def trajectory(results):
    keys = ("driven", "second_driven", "fourth_driven", "joint", "second", "fourth",
            "independent", "bound")
    rows = [[text(row["steps"], 4), f"{text(row['metres_A'])}, {text(row['radians_A'])}"] +
            [text(row[key]["metres"]) for key in keys] for row in results["trajectory"]["rows"]]
    return table(["steps to A", "σ of A [m, rad]", "driven: true", "shared, second",
                  "shared, fourth", "joint Gaussian: sampled", "shared, second", "shared, fourth",
                  "independent", "unknown"], rows)


TABLES = {"two_poses": two_poses, "chain": chain, "chain_within": chain_within, "fusion": fusion,
          "correlation": correlation, "trajectory": trajectory}


def filled(page, results):
    """The page, with its tables filled from these results."""
    for name, make in TABLES.items():
        begin = f"<!-- scripts/uncertainty: {name} -->"
        pattern = re.compile(re.escape(begin) + r"\n.*?<!-- end -->", re.DOTALL)
        written = f"{begin}\n{make(results)}\n<!-- end -->"
        page, times = pattern.subn(lambda _, written=written: written, page)
        if times != 1:
            sys.exit(f"uncertainty: {PAGE} has {times} places for the table {name}, not one")
    return page


def arguments():
    """The command line's arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true",
                        help="write nothing; fail if the page's tables differ from the results")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build" / "release",
                        help="where the program was built (%(default)s)")
    return parser.parse_args()


def main():
    chosen = arguments()
    program = chosen.build / "bin" / "uncertainty_experiments"
    run = subprocess.run([program], check=True, capture_output=True, text=True)
    results = json.loads(run.stdout)
    before = PAGE.read_text(encoding="utf-8")
    after = filled(before, results)
    if chosen.check:
        sys.exit("uncertainty: the page's tables differ from the library's results; run scripts/uncertainty"
                 if after != before else 0)
    uncertainty_figures.draw(results, FIGURES)
    PAGE.write_text(after, encoding="utf-8")
    print(f"Figures are in {FIGURES.relative_to(ROOT)}, tables in {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
