"""Writes the report from the results, and from nothing else: what was not measured is said to be missing."""

import os

import plots
import targets
import thesis
from figures import (NANOSECONDS, as_measured, growth, growth_in_words, microseconds, nanoseconds, number,
                     ratio)

MISSING = "missing"


def table(head, rows):
    """A table; the first column is text, the others are numbers."""
    lines = ["| " + " | ".join(head) + " |", "| --- |" + " ---: |" * (len(head) - 1)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def value(figures, key, which="median", convert=microseconds):
    """A figure's value as text."""
    return number(convert(figures[key], which)) if key in figures else MISSING


def has(figures, prefix):
    """Whether there is any figure whose key begins so."""
    return any(key.startswith(prefix) for key in figures)


def duration(seconds):
    """As a reader wants it."""
    return f"{seconds} seconds" if seconds < 120 else f"{seconds / 60:.0f} minutes"


def introduction(results):
    """Machine, method, and what was left out."""
    machine, settings = results["machine"], results["settings"]
    cores = f"{machine.get('cores')} cores"
    about = [machine.get("cpu"), cores, machine.get("vector instructions"), "Linux " + str(machine.get("kernel")),
             machine.get("distribution"), machine.get("compiler"), machine.get("build type"),
             machine.get("fastdds"), machine.get("tf2")]
    load = machine.get("load before") or [0]
    lines = [
        "# Benchmarks\n",
        f"Written by `scripts/bench` on {machine.get('date')}, commit {machine.get('commit')}: "
        f"{'a quick run' if settings.get('quick') else 'the full run'}, {duration(settings.get('seconds', 0))}. "
        "All text here is made from `results/latest.json`.\n",
        "**Machine.** " + "; ".join(str(item) for item in about) + ".\n"]
    if load[0] > 0.5:
        lines.append(f"**The machine was not idle**: its load was {load[0]:g} before the run. Read times with that "
                     "in mind; what waits for another process suffers most.\n")
    lines.append(
        "**Method.** The shipped library and daemons, one run, everything over the loopback interface. What is "
        "compared is measured in turns; a ratio of medians is the median of the ratios of each repetition. "
        "Warm-up is discarded. Of the core a value is a repetition's mean processor time. Elsewhere a value is one "
        "call; calls on own frames take hardly longer than reading the clock, so theirs is the mean of several. "
        "Where a table says p99, it is of all values of all repetitions.\n")
    skipped = [f"- {name}: {how}" for name, how in settings.get("stages", {}).items() if how != "done"]
    if skipped:
        lines.append("**Not measured in this run:**\n\n" + "\n".join(skipped) + "\n")
    return "\n".join(lines)


def targets_section(figures):
    """All targets; what is not reached stands first."""
    rows = list(targets.rows(figures))
    counted = {verdict: sum(row[3] == verdict for row in rows) for verdict in ("yes", "NO", "missing")}
    lines = ["## Targets\n",
             f"{counted['yes']} of {len(rows)} are reached, {counted['NO']} are not, {counted['missing']} have no "
             "figures in this run.\n"]
    lost = [f"- {target.group}: {target.name} is {found} ({bound})" for target, found, bound, verdict in rows
            if verdict == "NO"]
    if lost:
        lines.append("**Not reached:**\n\n" + "\n".join(lost) + "\n")
    lines.append(table(("target", "measured", "bound", "reached"),
                       [(f"{target.group}: {target.name}", found, bound,
                         f"**{verdict}**" if verdict == "NO" else verdict)
                        for target, found, bound, verdict in rows]))
    return "\n".join(lines)


def picture(drawn, name, home):
    """A plot, by a path relative to the report."""
    if name not in drawn:
        return ""
    return f"![{name}]({os.path.relpath(drawn[name], home)})\n"


def thesis_section(figures, drawn, home):
    """Figures 5.1 to 5.11."""
    lines = ["## The thesis's cases\n"]
    if not has(figures, "thesis/"):
        return "\n".join(lines + ["No figures in this run.\n"])
    rows = []
    for case in thesis.CASES:
        keys = [f"thesis/{case.key}/{side}" for side in ("centralized", "decentralized")]
        times = [value(figures, key, which) for key in keys for which in ("median", "p99")]
        ours = ratio(figures, *keys)
        theirs = f"{case.ratio:.2g}" if case.ratio else "none printed"
        rows.append((f"{case.figure} {case.title}".strip(), *times, number(ours),
                     theirs + (f" ({case.words})" if case.words else "")))
    lines.append("Microseconds. Centralized: one daemon owns all frames, the caller is a plain client. "
                 "Decentralized: the caller is the process named, and owns its frames. The ratio is centralized "
                 "over decentralized: above one the decentralized tree is faster.\n")
    lines.append(table(("case", "centralized", "p99", "decentralized", "p99", "ratio", "the thesis's"), rows))
    lines.append(picture(drawn, "thesis", home))
    return "\n".join(lines)


def wire_section(figures):
    """Table 5.1."""
    lines = ["## On the wire: the thesis's table 5.1\n"]
    if not has(figures, "wire/"):
        return "\n".join(lines + ["No figures in this run.\n"])
    names = {"add": "add", "remove": "remove", "lookup_other": "look up, one other owner",
             "lookup_across": "look up, two owners", "update": "update", "publish": "publish (no reply)"}
    rows = []
    for operation, name in names.items():
        sizes = [" / ".join(value(figures, f"wire/{operation}/{part}_{layer}", convert=as_measured)
                            for part in ("request", "reply")) for layer in ("payload", "rtps", "udp")]
        theirs = thesis.SIZES.get(operation)
        rows.append((name, f"{theirs[0]} / {theirs[1]}" if theirs else "-", *sizes,
                     value(figures, f"wire/{operation}/other_udp", convert=as_measured),
                     value(figures, f"wire/{operation}/packets", convert=as_measured)))
    lines.append("Bytes of request / reply, captured on the loopback interface; the caller owns nothing, ids have "
                 "ten characters. Payloads are CDR with its header of four bytes. \"Other\" is the news of the "
                 "structure, to everybody, and acknowledgements, as UDP packets.\n")
    lines.append(table(("operation", "thesis", "payload", "RTPS", "UDP", "other", "packets"), rows))
    vendor = figures.get("wire/update/vendor_rtps")
    if vendor and vendor["median"]:
        lines.append(f"Of an update's RTPS bytes {number(vendor['median'])} are what this build of Fast DDS adds "
                     "for its statistics.\n")
    paths = [(n, figures[key]) for n in (1, 2, 4)
             if (key := f"wire/lookup_over_{n}_partitions/total_udp") in figures]
    if paths:
        said = ", ".join(f"{number(figure['median'])} over {n}" for n, figure in paths)
        lines.append(f"Six partitions are there; a lookup's UDP bytes by those on the path: {said}. The thesis "
                     f"gives n x {thesis.WORST_CASE_PER_PROCESS} payload bytes as its worst case, n being all "
                     "processes.\n")
    if "wire/idle/udp_per_second" in figures:
        lines.append("Discovery and presence of two daemons and a client that do nothing: "
                     f"{value(figures, 'wire/idle/udp_per_second', convert=as_measured)} bytes a second.\n")
    return "\n".join(lines)


def floor_section(figures, drawn, home):
    """Ours beside bare DDS and bare UDP."""
    lines = ["## The floor\n"]
    rows = []
    for operation in ("update", "lookup"):
        for placement in ("one_core", "two_cores"):
            keys = [f"floor/{operation}/{who}/{placement}" for who in ("ours", "dds", "udp")]
            if not any(key in figures for key in keys):
                continue
            times = [f"{value(figures, key)} / {value(figures, key, 'p99')}" for key in keys]
            rows.append((f"{operation}, {placement.replace('_', ' ')}", *times,
                         number(ratio(figures, keys[0], keys[1])), number(ratio(figures, keys[0], keys[2]))))
    if not rows:
        return "\n".join(lines + ["No figures in this run.\n"])
    lines.append("Round trips in microseconds, median / p99, of equal payload, beside a bare Fast DDS ping-pong and "
                 "bare UDP.\n")
    lines.append(table(("call", "ours", "bare DDS", "bare UDP", "ours / DDS", "ours / UDP"), rows))
    lines.append(picture(drawn, "floor", home))
    return "\n".join(lines)


def stream_section(figures):
    """One publisher, one owner."""
    lines = ["## Streamed updates\n"]
    if not has(figures, "stream/"):
        return "\n".join(lines + ["No figures in this run.\n"])
    rows = []
    for key in sorted(key for key in figures if key.startswith("stream/")):
        figure = figures[key]
        cells = [number(figure[which]) for which in ("median", "p90", "p99", "max")]
        rows.append((f"{key.removeprefix('stream/').replace('_', ' ')} [{figure['unit']}]", *cells))
    lines.append("One publisher to one owner.\n")
    lines.append(table(("figure", "median", "p90", "p99", "max"), rows))
    return "\n".join(lines)


def core_rows(figures):
    """Each operation of ours with tf2's of the same, where tf2 has one."""
    looked_up = (("ours_by_handle", "by handle"), ("ours_by_name", "by name"),
                 ("ours_pose", "pose only, by handle"))
    operations = (("lookup", looked_up, "look up {who}, depth {depth} of {frames:,}"),
                  ("set", looked_up[:2], "set an edge {who}, {frames:,} frames"),
                  ("add_remove", (("ours", "node"), ("ours_forest", "forest")),
                   "add and remove a leaf, {who}, {frames:,} frames"))
    for operation, all_of_ours, name in operations:
        for ours, who in all_of_ours:
            for depth, frames, figure in plots.by_shape(figures, f"core/{operation}/{ours}"):
                shape = f"{depth}/{frames}"
                tf2 = f"core/{operation}/tf2/{shape}"
                quotient = ratio(figures, f"core/{operation}/{ours}/{shape}", tf2)
                yield (name.format(who=who, depth=depth, frames=frames), number(nanoseconds(figure)),
                       "cannot" if operation == "add_remove" else value(figures, tf2, convert=nanoseconds),
                       "-" if quotient is None else number(quotient))


def core_section(figures, drawn, home):
    """Beside tf2."""
    lines = ["## Own frames, beside tf2\n"]
    rows = list(core_rows(figures))
    if not rows:
        return "\n".join(lines + ["No figures in this run.\n"])
    lines.append("Nanoseconds. Ours carries a covariance unless it says pose only; tf2 has none.\n")
    lines.append(table(("operation", "ours", "tf2", "ours / tf2"), rows))
    lines.append(picture(drawn, "core", home))
    return "\n".join(lines)


def contention_section(figures, drawn, home):
    """Readers beside a writer."""
    lines = ["## A reader beside a writer\n"]
    keys = sorted(key for key in figures if key.startswith("contention/"))
    if not keys:
        return "\n".join(lines + ["No figures in this run.\n"])
    rows = []
    for key in keys:
        figure = figures[key]
        timed = figure["unit"] in NANOSECONDS
        cells = [number(microseconds(figure, which) if timed else figure[which])
                 for which in ("median", "p99", "p99.9", "max")]
        name = key.removeprefix("contention/").replace("/", ", ").replace("_", " ")
        rows.append((f"{name} [{'µs' if timed else figure['unit']}]", *cells))
    lines.append("A writer of 100 joints at 1 kHz, and a reader that looks up again and again.\n")
    lines.append(table(("figure", "median", "p99", "p99.9", "max"), rows))
    lines.append(picture(drawn, "contention", home))
    return "\n".join(lines)


def scale_section(figures, drawn, home):
    """What grows with what."""
    lines = ["## Cost as work grows\n"]
    said = [f"- {what}, {who.replace('_', ' ')}: {growth_in_words(exponent)}"
            for (what, who), exponent in plots.growths(figures).items()]
    said += [f"- {name}: {growth_in_words(growth([(x, figure['median']) for x, figure in points]))}"
             for name, points in plots.core_curves(figures)]
    if not said:
        return "\n".join(lines + ["No figures in this run.\n"])
    lines.append("How the median grows with the number of each; the exponent is that of a power law, fitted over all "
                 "that was measured, so a fixed cost at the small end lowers it.\n")
    lines.append("\n".join(said) + "\n")
    lines.append("Medians / p99:\n")
    lines += [scale_table(figures, what) for what in dict.fromkeys(scale[0] for scale in plots.SCALES)]
    lines.append(picture(drawn, "scale", home))
    return "\n".join(lines)


def scale_table(figures, what):
    """All that was measured over the numbers of one thing."""
    keys = [key.split("/") for key in figures if key.startswith(f"scale/{what}/")]
    if not keys:
        return ""
    curves = sorted({words[3] for words in keys})
    units = {who: figures[f"scale/{what}/{count}/{who}"]["unit"] for _, _, count, who in keys}
    rows = []
    for count in sorted({int(words[2]) for words in keys}):
        row = [figures.get(f"scale/{what}/{count}/{who}") for who in curves]
        rows.append((f"{count:,}", *(f"{number(one['median'])} / {number(one['p99'])}" if one else MISSING
                                     for one in row)))
    head = [f"{who.replace('_', ' ')} [{units[who]}]" for who in curves]
    return table((what, *head), rows)


def text(results, drawn, home):
    """The whole report, to be put into the folder `home`."""
    figures = results["figures"]
    return "\n".join([
        introduction(results), targets_section(figures), thesis_section(figures, drawn, home),
        wire_section(figures), floor_section(figures, drawn, home), stream_section(figures),
        core_section(figures, drawn, home), contention_section(figures, drawn, home),
        scale_section(figures, drawn, home)]).rstrip() + "\n"
