"""Writes the report from the results only; values that were not measured are marked as missing."""

import os

import history
import plots
import summary
import targets
import thesis
from figures import (NANOSECONDS, as_measured, growth, growth_in_words, microseconds, nanoseconds,
                     number, ratio)

MISSING = "missing"
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
THESIS = """\
Microseconds. Centralized: one daemon owns all frames, and the caller is a plain client.
Decentralized: the caller is the process `robot` (the thesis's main process), or `arms` if the case
names it, and owns its frames. The ratio is centralized / decentralized: above one the decentralized
tree is faster. The thesis took {calls:,} values for each case; the last column has ours. A value of a
call on own frames is the mean of 32 calls.
"""
THESIS_NOTES = """\
- **What the thesis says.** It prints two medians, for 5.10. For 5.1, 5.5, 5.6, 5.7 and 5.8 its text has a ratio or a
  difference, and for the others a comparison with another case. Ratios that follow: 5.1 "three times as long", so 3;
  5.5 "about double the time", so 1 / 2; 5.10: 57.597 / 14.022 = 4.1. For 5.2 it says that an add takes six times its
  add in the own process: with 5.1's ratio of 3 that is 3 / 6 = 0.5. For 5.8 the difference is 12 µs;
  with the centralized median of 5.10 that is 57.6 / (57.6 + 12) = 0.83.
- **5.6** is the path that is asked for by the arms' process. The text of this case refers to figure 5.7. It explains
  the advantage of 15 µs by the smaller trees of the parts. That cause does not exist here: the time of a lookup does
  not depend on the number of frames ("Cost as work grows" below), and the two sides take the same time.
- **5.11** names no caller, so both are measured. Here the connector belongs to the owner of its child, so the owner of
  the parent pays a round trip for it.
- **The tree** is that of the thesis's figure 4.1, and the arm of its figure 1.1 is that of the pictures. Both figures
  are drawings without numbers: names and links are theirs, all poses and covariances are ours.
"""
NARROW = """\
Milliseconds. The same cases over a link of 1 Mbit/s that delays each packet by 20 ms in each direction.
The caller is the process `robot`. Its host has its own frames; at the other end are the daemon of the arms and the
central server. A round trip of such a link takes 40 ms, and 8 µs more for each byte. While nobody asks, discovery
and presence of the two daemons send {bytes} bytes and {packets} packets a second over it, both directions together.
"""
WIRE = """\
Bytes of request / reply, captured on the loopback interface; the caller owns no frames, and ids
have ten characters. Payloads are CDR with its header of four bytes. "Other" is UDP packets with
changes of the structure, which go to all participants, and acknowledgements.
"""
FLOOR = """\
Round trips in microseconds, median / p99, compared with a bare Fast DDS ping-pong and with bare UDP,
both with the same payload.
"""
FIRST_ANSWER = """\
Whole runs of a process, from its start until it has ended: a lookup over two daemons, and a bare
Fast DDS client with the same readers, writers and QoS that asks two servers once each.
"""
CORE = """\
Nanoseconds. Our values include a covariance unless the row says "pose only"; tf2 has none.
"""
HISTORY = """\
For lookups at an earlier instant, all edges are dynamic and turn at 1 rad/s. Both sides repeat
lookups of the same instant, between the same samples. Both keep the samples of ten seconds by
default. A sample of an edge with a full history takes {ours} bytes according to `history()`, and
{heap} bytes measured by the growth of the heap, if its covariance is that of the one before; in
tf2, without a covariance, {tf2} bytes.
"""
CONTENTION = """\
A writer of 100 joints at 1 kHz, and a reader that repeatedly looks up a path of 30 of them.
"""
PUSHED = """\
A path of ten edges that another process watches; its owner updates all of them at 1 kHz. Each
process has its own core. Microseconds from just before `update()` until a waiting thread has read
the new value. Measured in turns with a bare Fast DDS sample of the same size and QoS: from just
before `write()` until a waiting thread has it, and until the listener has it, which needs one
wake-up less.
"""
PUSHED_BYTES = """\
Bytes of a robot with 30 joints, which all move at once. With tf-dude, the path from base to tip is
watched, as if all joints were one chain: every edge (240 bytes, of which 168 are its covariance), or
the path composed to one transform. tf2's middleware is not part of this comparison: the size of its
message is computed ({tf2} CDR bytes: one `TFMessage` of all 30 `TransformStamped`, with names such
as `left_shoulder_pan_link`), and bare Fast DDS sends samples of that size to the same number of
listeners. Counted on the loopback interface; UDP includes acknowledgements, and for tf-dude the
watchers' renewals. Each watcher is a separate participant and receives its own copy. Presence and
discovery are left out on both sides.
"""
MANY = """\
32 daemons with 100,000 frames in all, on the two cores of this machine. [docs/scaling.md](../docs/scaling.md) has other
numbers of daemons, and what they cost while idle.
"""
KEYS = """\
Medians with keys and without, in turns: a whole run of `tfdude lookup`, calls with both programs on one core, and 100
edges at 1 kHz.
"""
AROUND = """\
Latency is that from the write to the reading, in microseconds, with 100 edges at 100 Hz in messages of all edges or of
one. The relay takes a message of `/tf` by bare Fast DDS and writes it again.
"""
RECORDED = """\
A recorder of 100 edges at 1 kHz takes {compressed} % of a core ({raw} % without compression). A bare DDS reader of as
many bytes takes {bare} %, and zstd alone {zstd} %.
"""
PYTHON = """\
The same calls in Python and C++: 30 own edges, the same edges of another process, and 30 joints in a stream.
"""
SCALE = """\
How the median grows with each number. The exponent is that of a power law fitted to all measured
points, so a fixed cost at the small end lowers it.
"""


def table(head, rows):
    """A table; the first column is text, the others are numbers."""
    lines = ["| " + " | ".join(head) + " |", "| --- |" + " ---: |" * (len(head) - 1)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def value(figures, key, which="median", convert=microseconds):
    """A figure's value as text."""
    return number(convert(figures[key], which)) if key in figures else MISSING


def both(figures, key, convert=microseconds):
    """Median and 99th percentile as text."""
    return f"{value(figures, key, 'median', convert)} / {value(figures, key, 'p99', convert)}"


def unit_of(figure):
    """A figure's unit as text."""
    return {"us": "µs"}.get(figure["unit"], figure["unit"])


def picture(drawn, name, home):
    """A plot, by a path relative to the report."""
    return f"![{name}]({os.path.relpath(drawn[name], home)})\n" if name in drawn else ""


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
    reports = "; ".join(f"{one['date'].split()[0]}, commit {one['commit']}" for one in past[:-1])
    lines.append(f"Earlier reports, the oldest first: {reports or 'none'} (`results/history.json`).\n")
    return "\n".join(lines)


def thesis_section(figures, drawn, home):
    """Figures 5.1 to 5.11."""
    rows = []
    for case in thesis.CASES:
        keys = [f"thesis/{case.key}/{side}" for side in ("centralized", "decentralized")]
        ours = ratio(figures, *keys)
        theirs = [f"{case.ratio:.2g}" if case.ratio else "", case.words]
        values = [figures[key]["n"] for key in keys if key in figures]
        rows.append((f"{case.figure} {case.title}".strip(), *(both(figures, key) for key in keys),
                     number(ours), ": ".join(word for word in theirs if word) or "-",
                     number(min(values)) if values else MISSING))
    head = ("case", "centralized, median / p99", "decentralized, median / p99", "ratio",
            "the thesis's", "values")
    return [THESIS.format(calls=thesis.CALLS), table(head, rows), THESIS_NOTES, picture(drawn, "thesis", home)]


def narrow_section(figures, _drawn, _home):
    """The thesis's cases over a narrow link."""
    def milliseconds(figure, which):
        return microseconds(figure, which) / 1e3

    rows = []
    for case in thesis.CASES:
        keys = [f"narrow/{case.key}/{side}" for side in ("centralized", "decentralized")]
        if keys[0] in figures:
            rows.append((f"{case.figure} {case.title}".strip(),
                         *(both(figures, key, milliseconds) for key in keys), number(ratio(figures, *keys))))
    head = ("case", "centralized, median / p99", "decentralized, median / p99", "ratio")
    idle = {name: value(figures, f"narrow/idle/{name}_per_second", convert=as_measured)
            for name in ("bytes", "packets")}
    return [NARROW.format(**idle), table(head, rows)]


WIRE_NAMES = {"add": "add", "remove": "remove", "lookup_other": "look up, one other owner",
              "lookup_across": "look up, two owners", "update": "update",
              "publish": "publish (has no reply)",
              "publish_joint": "publish a joint's position"}


WIRE_TABLE = """\
### Who sends what, centralized and decentralized

UDP bytes: request + reply + other, and all packets. Centralized: one daemon owns all frames, and a
client asks. By the owner: the process that owns the frame. By another: a client, beside the owners.
`2`: the thesis's example; `5` and `16`: partitions of two frames each.
"""
ONE_SHOT = """\
### A program that asks once

`tfdude lookup` beside two daemons, from its start until nothing of it is left: UDP bytes. Bare: a
participant of Fast DDS with the same readers and writers that asks one of two others.
"""


def wire_table(figures):
    """The whole of table 5.1: each operation in systems of several sizes."""
    hows = (("centralized", "centralized"), ("by_owner", "by the owner"), ("by_other", "by another"))
    rows = []
    for system in ("2", "5", "16"):
        for operation in ("add", "remove", "lookup", "update", "publish"):
            cells = []
            for how, _ in hows:
                key = f"wire/table/{system}/{how}/{operation}"
                parts = " + ".join(value(figures, f"{key}/{part}_udp", convert=as_measured)
                                   for part in ("request", "reply", "other"))
                cells.append(f"{parts}; {value(figures, f'{key}/packets', convert=as_measured)}")
            rows.append((f"{system}: {operation}", *cells))
        idle = [value(figures, f"wire/table/{system}/{where}/idle/udp_per_second", convert=as_measured)
                for where in ("centralized", "decentralized")]
        rows.append((f"{system}: discovery and presence, a second", idle[0], idle[1], idle[1]))
    return table(("operation", *(title for _, title in hows)), rows)


def one_shot_table(figures):
    """The parts of the traffic of one question."""
    rows = [(name, *(value(figures, f"wire/one_shot/{side}/{key}", convert=as_measured) for side in ("ours", "bare")))
            for key, name in (("total_udp", "all"), ("packets", "packets"),
                              ("participants_udp", "announcements of participants"),
                              ("endpoints_udp", "announcements of readers and writers"),
                              ("acknowledgements_udp", "heartbeats and acknowledgements"),
                              ("presence_udp", "presence"), ("structure_udp", "structure"),
                              ("question_udp", "requests and replies"))]
    return table(("part", "ours", "bare"), rows)


def wire_section(figures, _drawn, _home):
    """Table 5.1."""
    def size(name):
        return value(figures, f"wire/{name}", convert=as_measured)

    rows = []
    for operation, name in WIRE_NAMES.items():
        sizes = [f"{size(f'{operation}/request_{layer}')} / {size(f'{operation}/reply_{layer}')}"
                 for layer in ("payload", "rtps", "udp")]
        theirs = "{} / {}".format(*thesis.SIZES.get(operation, ("-", "-")))
        rows.append((name, theirs, *sizes, size(f"{operation}/other_udp"),
                     size(f"{operation}/packets")))
    head = ("operation", "thesis", "payload", "RTPS", "UDP", "other", "packets")
    paths = ", ".join(f"{size(f'lookup_over_{count}_partitions/total_udp')} over {count}"
                      for count in (1, 2, 4))
    return [WIRE, table(head, rows),
            "- More than the thesis counts: a request to remove names its sender's last change, so that "
            "changes of one client keep their order, and all requests a number, below which no answer is "
            "awaited any more. A lookup names both ends of its segment. The thesis's answers have one "
            "byte; ours have the number of the request and the epoch of the structure that shows it.\n"
            "- An added frame on a page of 60 frames or fewer: "
            f"{size('full_page/add/other_udp')} bytes of changes and acknowledgements to two participants; "
            f"removed: {size('full_page/remove/other_udp')}.\n"
            f"- UDP bytes of a lookup with six partitions in the domain, by the number of partitions on "
            f"its path: {paths}. The thesis's worst case is {thesis.WORST_CASE_PER_PROCESS} payload "
            "bytes for each existing process.\n"
            "- Discovery and presence of two daemons and a client that do nothing: "
            f"{size('idle/udp_per_second')} UDP bytes a second.\n",
            WIRE_TABLE, wire_table(figures), ONE_SHOT, one_shot_table(figures)]


def floor_section(figures, drawn, home):
    """tf-dude compared with bare DDS and bare UDP."""
    rows = []
    for operation, placement in plots.FLOOR_PANELS:
        ours, dds, udp = (f"floor/{operation}/{who}/{placement}" for who in ("ours", "dds", "udp"))
        rows.append((f"{operation}, {placement.replace('_', ' ')}",
                     *(both(figures, key) for key in (ours, dds, udp)),
                     number(ratio(figures, ours, dds)), number(ratio(figures, ours, udp))))
    head = ("call", "ours", "bare DDS", "bare UDP", "ours / DDS", "ours / UDP")
    return [FLOOR, table(head, rows), picture(drawn, "floor", home)]


def first_answer_section(figures, _drawn, _home):
    """One-shot commands beside a bare client."""
    rows = [(name, *(value(figures, f"first_answer/{who}", which, as_measured)
                     for which in ("median", "p90", "max")))
            for who, name in (("ours", "`tfdude lookup` [ms]"), ("dds", "bare DDS [ms]"))]
    return [FIRST_ANSWER, table(("process", "median", "p90", "max"), rows)]


def stream_section(figures, _drawn, _home):
    """One publisher, one owner."""
    rows = []
    for key in sorted(key for key in figures if key.startswith("stream/")):
        name = f"{key.removeprefix('stream/').replace('_', ' ')} [{unit_of(figures[key])}]"
        rows.append((name, *(value(figures, key, which, as_measured)
                             for which in ("median", "p90", "p99", "max"))))
    return ["One publisher to one owner, 100 edges per message; `joints`: positions of 30 joints.\n",
            table(("figure", "median", "p90", "p99", "max"), rows)]


def core_rows(figures):
    """Each operation of ours with the same of tf2, if tf2 has it."""
    found = (("ours_by_handle", "by handle"), ("ours_by_name", "by name"),
             ("ours_pose", "pose only, by handle"))
    operations = (("lookup", found, "look up {who}, depth {depth:,} of {frames:,}"),
                  ("lookup_at", found, "look up {who} 18.5 samples ago at 1 kHz, depth {depth:,}"),
                  ("lookup_at_far", found,
                   "look up {who} 200.5 samples ago at 1 kHz, depth {depth:,}"),
                  ("lookup_at_100hz", found,
                   "look up {who} 18.5 samples ago at 100 Hz, depth {depth:,}"),
                  ("set", found[:2], "set an edge {who}, {frames:,} frames"),
                  ("set_history", found, "set an edge {who} whose history is full"),
                  ("add_remove", (("ours", "node"), ("ours_forest", "forest")),
                   "add and remove a leaf, {who}, {frames:,} frames"))
    for operation, all_of_ours, name in operations:
        for ours, who in all_of_ours:
            for depth, frames, figure in plots.by_shape(figures, f"core/{operation}/{ours}"):
                shape = f"{depth}/{frames}"
                tf2 = f"core/{operation}/tf2/{shape}"
                cells = ("cannot", "-")
                if operation != "add_remove":
                    cells = (value(figures, tf2, convert=nanoseconds),
                             number(ratio(figures, f"core/{operation}/{ours}/{shape}", tf2)))
                yield (name.format(who=who, depth=depth, frames=frames),
                       number(nanoseconds(figure)), *cells)


def core_section(figures, drawn, home):
    """Own frames compared with tf2."""
    def bytes_of(who):
        return value(figures, f"core/history_bytes/{who}/2/100", convert=as_measured)

    memory = HISTORY.format(ours=bytes_of("ours"), heap=bytes_of("ours_heap"),
                         tf2=bytes_of("tf2_heap"))
    return [CORE, table(("operation", "ours", "tf2", "ours / tf2"), core_rows(figures)), memory,
            picture(drawn, "core", home)]


def contention_section(figures, drawn, home):
    """Readers concurrent with a writer."""
    rows = []
    for key in sorted(key for key in figures if key.startswith("contention/")):
        timed = figures[key]["unit"] in NANOSECONDS
        convert, unit = (microseconds, "µs") if timed else (as_measured, unit_of(figures[key]))
        name = key.removeprefix("contention/").replace("/", ", ").replace("_", " ")
        rows.append((f"{name} [{unit}]", *(value(figures, key, which, convert)
                                           for which in ("median", "p99", "p99.9", "max"))))
    return [CONTENTION, table(("figure", "median", "p99", "p99.9", "max"), rows),
            picture(drawn, "contention", home)]


def pushed_section(figures, _drawn, _home):
    """Watched paths: latency compared with bare DDS, bytes with tf2."""
    ours = "pushed/latency/ours"
    rows = [(name, *(value(figures, key, which) for which in ("median", "p90", "p99")),
             number(ratio(figures, ours, key)), number(ratio(figures, ours, key, "p99")))
            for name, key in (("ours", ours), ("bare DDS, waiting thread", "pushed/latency/dds"),
                              ("bare DDS by a woken thread", "pushed/latency/dds_woken"))]
    head = ("latency", "median", "p90", "p99", "ours / this, median", "ours / this, p99")
    latest = value(figures, "pushed/latest", convert=nanoseconds)
    cases = sorted({tuple(map(int, key.split("/")[3:])) for key in figures
                    if key.startswith("pushed/udp/")})
    sizes = []
    for rate, watchers in cases:
        def kilobytes(what, who, case=f"{rate}/{watchers}"):
            return value(figures, f"pushed/{what}/{who}/{case}",
                         convert=lambda figure, which: figure[which] / 1e3)
        sizes.append((f"{rate:,} Hz, {watchers} watching",
                      *(f"{kilobytes('payload', who)} / {kilobytes('udp', who)}"
                        for who in ("edges", "composed", "tf2"))))
    return [PUSHED, table(head, rows),
            f"Reading the newest value at the same time, with covariance: {latest} ns.\n",
            PUSHED_BYTES.format(tf2=value(figures, "pushed/message/tf2", convert=as_measured)),
            table(("payload / UDP, kB a second", "ours, edges", "ours, composed", "tf2's size"),
                  sizes)]


def keys_section(figures, _drawn, _home):
    """What keys cost."""
    rows = []
    for name, key in (("first lookup of a new process [ms]", "first_meeting"), ("lookup [µs]", "lookup"),
                      ("update [µs]", "update"), ("100 edges at 1 kHz: latency [µs]", "stream/1khz/latency"),
                      ("100 edges at 1 kHz: the owner's share of a core [%]", "stream/1khz/owner_cpu")):
        rows.append((name, *(value(figures, f"secured/{key}/{how}", convert=as_measured)
                             for how in ("plain", "signed", "encrypted"))))
    return [KEYS, table(("call", "plain", "signed", "encrypted"), rows)]


def around_section(figures, _drawn, _home):
    """The bridge to ROS 2, the recorder, the Python package."""
    bridge = []
    for edges in (100, 1):
        for way, name in (("bare", "bare relay"), ("in", "into tf-dude"), ("out", "out of tf-dude")):
            key = f"ros/{way}/{edges}"
            if f"{key}/latency" in figures:
                bridge.append((f"{name}, messages of {edges}", both(figures, f"{key}/latency"),
                               value(figures, f"{key}/cpu", convert=as_measured),
                               value(figures, f"{key}/bytes_per_edge", convert=as_measured)))
    python = [(name, value(figures, f"python/{key}/python"), value(figures, f"python/{key}/cpp"),
               number(ratio(figures, f"python/{key}/python", f"python/{key}/cpp")))
              for name, key in (("look up own edges [µs]", "own"), ("look up edges of another process [µs]", "remote"),
                                ("publish joints [µs]", "publish"))]
    shares = {name: value(figures, f"recorded/{name}/cpu", convert=as_measured)
              for name in ("compressed", "raw", "bare", "zstd")}
    return ["### The bridge to ROS 2\n", AROUND,
            table(("way", "latency, median / p99", "share of a core [%]", "bytes an edge"), bridge),
            "### The recorder\n", RECORDED.format(**shares),
            "### Python\n", PYTHON, table(("call", "Python", "C++", "ratio"), python)]


def scale_table(figures, what):
    """All measurements for which one number was varied."""
    keys = [key.split("/") for key in figures if key.startswith(f"scale/{what}/")]
    curves = sorted({who for _, _, _, who in keys})
    units = {who: unit_of(figures[f"scale/{what}/{count}/{who}"]) for _, _, count, who in keys}
    head = [f"{who.replace('_', ' ')} [{units[who]}]" for who in curves]
    rows = [(f"{count:,}", *(both(figures, f"scale/{what}/{count}/{who}", as_measured)
                             for who in curves))
            for count in sorted({int(count) for _, _, count, _ in keys})]
    return table((f"{what}; median / p99", *head), rows) if rows else ""


def many_section(figures, _drawn, _home):
    """32 daemons."""
    rows = [(name, *(value(figures, key, which, as_measured) for which in ("median", "min", "max")))
            for name, key in (("started at once: until a new participant has all frames [s]", "many/32/all_known"),
                              ("after that: a new participant has all frames [s]", "many/32/newcomer"),
                              ("resident memory of a daemon [KiB]", "many/32/memory"))]
    return [MANY, table(("figure", "median", "least", "most"), rows)]


def scale_section(figures, drawn, home):
    """How values grow with the number of partitions, clients and frames."""
    fitted = {f"{what}, {who.replace('_', ' ')}": exponent
              for (what, who), exponent in plots.growths(figures).items()}
    for name, points in plots.core_curves(figures):
        fitted[name] = growth([(x, figure["median"]) for x, figure in points])
    said = [f"- {name}: {growth_in_words(exponent)}" for name, exponent in fitted.items()
            if exponent is not None]
    if few := [name for name, exponent in fitted.items() if exponent is None]:
        said.append("- too few points for a fit: " + "; ".join(few))
    of = dict.fromkeys(scale[0] for scale in plots.SCALES)
    return [SCALE, "\n".join(said) + "\n", *(scale_table(figures, what) for what in of),
            picture(drawn, "scale", home)]


# The heading of a section, the prefixes of its keys, and the function that writes it. It needs at least one such key.
SECTIONS = (
    ("The thesis's cases", ("thesis/",), thesis_section),
    ("The thesis's cases over a narrow link", ("narrow/",), narrow_section),
    ("On the wire: the thesis's table 5.1", ("wire/",), wire_section),
    ("The floor", ("floor/",), floor_section),
    ("The first answer", ("first_answer/",), first_answer_section),
    ("Streamed updates", ("stream/",), stream_section),
    ("Pushed paths", ("pushed/",), pushed_section),
    ("Own frames, beside tf2", ("core/",), core_section),
    ("A reader beside a writer", ("contention/",), contention_section),
    ("Cost as work grows", ("scale/", "core/"), scale_section),
    ("Many daemons", ("many/",), many_section),
    ("Keys", ("secured/",), keys_section),
    ("Around the core", ("ros/", "recorded/", "python/"), around_section),
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
