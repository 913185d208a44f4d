#!/usr/bin/env python3
"""Runs the benchmarks; writes results, plots and report. scripts/bench first builds them."""

import argparse
import json
import pathlib
import signal
import sys
import tempfile
import time
import traceback

import history
import machine
import narrow
import net_stage
import one_shot
import plots
import processes
import programs
import pushed
import report
import secured
import tables
import targets
import wire
import wire_table

BENCH = pathlib.Path(__file__).resolve().parent
RESULTS = BENCH / "results"
QUICK_STAGES = ("core", "contention", "memory", "net", "wire", "pushed")
STAGES = (*QUICK_STAGES, "narrow", "many", "secured", "around")


def on_the_wire(quick, bin_dir, work):
    """All that is captured."""
    yield from wire.run(quick, bin_dir, work)
    yield from wire_table.run(bin_dir, work)
    yield from one_shot.run(quick, bin_dir, work)


def stage(name):
    """The function of a stage: it yields figures, given quick, the binaries' folder and a working folder."""
    if name == "wire":
        return on_the_wire
    modules = {"net": net_stage, "pushed": pushed, "narrow": narrow, "secured": secured}
    if name in modules:
        return modules[name].run
    return getattr(programs, name)


def run_stage(name, quick, bin_dir, figures):
    """Adds a stage's figures to `figures`, by their keys; returns "done", or why it was skipped or failed."""
    with tempfile.TemporaryDirectory(prefix=f"tfdude-{name}-") as work:
        try:
            for figure in stage(name)(quick, bin_dir, pathlib.Path(work)):
                figure = dict(figure)
                key = figure.pop("key")
                if figure["n"] > 0:
                    figures[key] = figure
                else:
                    print(f"   {key} has no values")
            return "done"
        except processes.Skipped as reason:
            return f"skipped: {reason}"
        except Exception as error:  # the other stages can still run, whatever the error
            for log in sorted(pathlib.Path(work).glob("*.log")):
                print(f"--- {log.name}\n{log.read_text(errors='replace')[-2000:]}")
            traceback.print_exc()
            return f"failed: {error}"


def measure(names, quick, bin_dir):
    """Runs the stages; returns the figures by key, and the outcome of each stage by name."""
    figures, went = {}, {}
    for name in names:
        begin = time.monotonic()
        print(f"== {name}", flush=True)
        went[name] = run_stage(name, quick, bin_dir, figures)
        print(f"   {went[name]} ({time.monotonic() - begin:.0f} s)", flush=True)
    return figures, went


def write(results, folder, report_file):
    """Writes the results' file, the plots and the report; those of the repository also into its tables."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(results, indent=1, sort_keys=True)
    (folder / "latest.json").write_text(text + "\n", encoding="utf-8")
    past = history.with_entry(history.load(RESULTS / "history.json"), history.entry(results))
    history.save(folder / "history.json", past)
    drawn = plots.draw(results["figures"], folder)
    report_file.write_text(report.text(results, past, drawn, report_file.parent), encoding="utf-8")
    if folder.resolve() == RESULTS:
        tables.main()
    print(f"Results are in {folder}, the report is {report_file}")


def arguments():
    """The command line's arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer values: under 5 minutes")
    parser.add_argument("--check", action="store_true",
                        help="a quick run, compared with the targets; does not change the committed results")
    parser.add_argument("--from", dest="saved", type=pathlib.Path, metavar="FILE",
                        help="write plots and report from a saved latest.json, without measuring")
    parser.add_argument("--build", type=pathlib.Path, default=processes.ROOT / "build" / "release",
                        help="where the programs were built (%(default)s)")
    parser.add_argument("--stages", help=f"only these, of {','.join(STAGES)}; a quick run has the first "
                        f"{len(QUICK_STAGES)}, if nothing else is said")
    parser.add_argument("--results", type=pathlib.Path, default=RESULTS,
                        help="the folder to write to (%(default)s)")
    chosen = parser.parse_args()
    usual = QUICK_STAGES if chosen.quick or chosen.check else STAGES
    chosen.stages = chosen.stages.split(",") if chosen.stages else usual
    if unknown := set(chosen.stages) - set(STAGES):
        parser.error("no such stage: " + ", ".join(sorted(unknown)))
    return chosen


def main():
    # Exits in order, so that all started processes are stopped.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("terminated"))
    chosen = arguments()
    if chosen.saved:
        results = json.loads(chosen.saved.read_text(encoding="utf-8"))
    else:
        quick = chosen.quick or chosen.check
        about = machine.description(chosen.build)
        begin = time.monotonic()
        figures, went = measure(chosen.stages, quick, chosen.build / "bin")
        settings = {"quick": quick, "stages": went, "seconds": round(time.monotonic() - begin)}
        results = {"machine": about, "settings": settings, "figures": figures}
    if chosen.check:
        print(targets.table(results["figures"]))
    else:
        # The report of results in another folder is written there.
        home = BENCH if chosen.results.resolve() == RESULTS else chosen.results
        write(results, chosen.results, home / "REPORT.md")
    failed = [name for name, how in results["settings"]["stages"].items()
              if how.startswith("failed")]
    if failed and not chosen.saved:
        sys.exit("FAILED: " + ", ".join(failed))


if __name__ == "__main__":
    main()
