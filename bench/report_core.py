"""The sections of the report about own frames, growth, many daemons, and what is around the core."""

import plots
from figures import (NANOSECONDS, as_measured, growth, growth_in_words, microseconds, nanoseconds, number,
                     ratio)
from report_parts import both, picture, table, unit_of, value

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
MANY = """\
32 daemons with 100,000 frames in all, on the two cores of this machine. [docs/scaling.md](../docs/scaling.md) has other
numbers of daemons, and what they cost while idle.
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
