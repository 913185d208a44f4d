"""Writes the report from the results only; values that were not measured are marked as missing."""

import history
import report_core
import report_network
import summary
import targets
from figures import number
from report_parts import MISSING, table

NOTHING = "No figures in this run.\n"
IDLE_UP_TO = 5  # percent of the processors' time
METHOD = """\
**Method.** The shipped library and daemons, one run, everything over the loopback interface. Values
that are compared are measured in turns; a ratio of medians is the median of the ratios of each
repetition. Warm-up is discarded. For own frames compared with tf2, a value is the mean processor
time of a repetition. Elsewhere a value is one call; calls on own frames take hardly longer than
reading the clock, so their value is the mean of several calls. The 99th percentile (p99) is that of
all values of all repetitions.
"""
NOT_IDLE = """\
**The machine was not idle**: other programs used {busy:g} % of its processors before the run. That
affects times, most of all those of calls that wait for another process.
"""


def duration(seconds):
    """A duration as text."""
    return f"{seconds} seconds" if seconds < 120 else f"{seconds / 60:.0f} minutes"


def introduction(results):
    """Machine, method, and stages that were not measured."""
    machine, settings = results["machine"], results["settings"]
    about = [machine.get(name, "unknown") for name in (
        "cpu", "vector instructions", "distribution", "compiler", "build type", "fastdds", "tf2")]
    about[1:1] = [f"{machine.get('cores')} cores"]
    about.append(f"Linux {machine.get('kernel')}")
    extent = "a quick run" if settings.get("quick") else "the full run"
    lines = ["# Benchmarks\n",
             f"Written by `scripts/bench` on {machine.get('date')}; commit "
             f"{machine.get('commit')}; {extent}, {duration(settings.get('seconds', 0))}.\n"
             "All figures here are from `results/latest.json`.\n",
             "**Machine.** " + "; ".join(about) + ".\n"]
    busy = machine.get("busy before [%]") or 0
    if busy > IDLE_UP_TO:
        lines.append(NOT_IDLE.format(busy=busy))
    lines.append(METHOD)
    left_out = [f"- {name}: {how}" for name, how in settings.get("stages", {}).items()
                if how != "done"]
    if left_out:
        lines.append("**Not measured in this run:**\n\n" + "\n".join(left_out) + "\n")
    return "\n".join(lines)


def targets_section(figures, past):
    """All targets with their values in earlier reports; first those that are not reached."""
    rows = list(targets.rows(figures))
    groups = []
    for group in (*targets.GROUPS, "All"):
        verdicts = [row[3] for row in rows if group in (row[0].group, "All")]
        groups.append((group, *(str(verdicts.count(one)) for one in ("yes", "NO", MISSING))))
    lines = ["## Targets\n", table(("group", "reached", "not reached", "no figures"), groups)]
    lost = [f"- {target.full_name} is **{found}** ({bound}). {targets.why(target)}".rstrip()
            for target, found, bound, verdict in rows if verdict == "NO"]
    if lost:
        lines.append("**Not reached:**\n\n" + "\n".join(lost) + "\n")
    lines.append(table(("target", "measured", "bound", "reached", "in earlier reports"),
                       [(target.full_name, found, bound, f"**{verdict}**" if verdict == "NO" else verdict,
                         ", ".join(number(value) for _, value in history.before(past, target.full_name)) or "-")
                        for target, found, bound, verdict in rows]))
    reports = "; ".join(f"{one['date'].split()[0]}, commit {one['commit']}"
                        + (", a quick run" if one.get("quick") else "") for one in past[:-1])
    lines.append(f"Earlier reports, the oldest first: {reports or 'none'} (`results/history.json`).\n")
    return "\n".join(lines)


# The heading of a section, the prefixes of its keys, and the function that writes it. It needs at least one such key.
SECTIONS = (
    ("The thesis's cases", ("thesis/",), report_network.thesis_section),
    ("The thesis's cases over a narrow link", ("narrow/",), report_network.narrow_section),
    ("On the wire: the thesis's table 5.1", ("wire/",), report_network.wire_section),
    ("The floor", ("floor/",), report_network.floor_section),
    ("The first answer", ("first_answer/",), report_network.first_answer_section),
    ("Streamed updates", ("stream/",), report_network.stream_section),
    ("Pushed paths", ("pushed/",), report_network.pushed_section),
    ("Own frames, beside tf2", ("core/",), report_core.core_section),
    ("A reader beside a writer", ("contention/",), report_core.contention_section),
    ("Cost as work grows", ("scale/", "core/"), report_core.scale_section),
    ("Many daemons", ("many/",), report_core.many_section),
    ("Keys", ("secured/",), report_network.keys_section),
    ("Around the core", ("ros/", "recorded/", "python/"), report_core.around_section),
)


def text(results, past, drawn, home):
    """The whole report, as a file in the folder `home`. The last entry of the history `past` is that of the results."""
    figures = results["figures"]
    parts = [introduction(results), summary.text(figures), targets_section(figures, past)]
    for heading, prefixes, section in SECTIONS:
        parts.append(f"## {heading}\n")
        there = any(key.startswith(prefixes) for key in figures)
        parts += section(figures, drawn, home) if there else [NOTHING]
    return "\n".join(part for part in parts if part).rstrip() + "\n"
