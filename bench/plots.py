"""Draws the figures: box plots of times, curves of values that grow. Each plot is an SVG and a PNG file.

Boxes are from the 25th to the 75th percentile with the median as a line, whiskers from the 5th to
the 95th, and a cross is the 99th.
"""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as pyplot  # noqa: E402  (after the choice of the backend)
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator  # noqa: E402

import thesis  # noqa: E402
from figures import (as_measured, growth, microseconds, nanoseconds, number,  # noqa: E402
                     numbered, ratio)

BOXES = "Boxes: quartiles and median; whiskers: 5th to 95th percentile; cross: 99th."
BLUE, GREEN, BROWN, GREY = "#2f6f9f", "#3f9f6f", "#b07040", "#7f7f7f"
COLOURS = {"centralized": BROWN, "decentralized": BLUE, "ours": BLUE, "dds": GREY,
           "udp": "#b9b9b9", "tf2": BROWN, "alone": GREY, "beside": BLUE}
LOG_FROM = 10.0  # an axis is logarithmic if the ratio of its largest to its smallest value is above this

matplotlib.rcParams.update({
    "font.size": 8, "axes.titlesize": 8, "figure.titlesize": 9, "axes.grid": True,
    "grid.color": "#e4e4e4", "grid.linewidth": 0.6, "axes.axisbelow": True,
    "axes.spines.top": False, "axes.spines.right": False,
    "svg.hashsalt": "tf-dude", "svg.fonttype": "none",
})


def plain(value, _position=None):
    """A tick's number without powers of ten."""
    return f"{value:,.0f}" if value >= 1 or value == 0 else f"{value:.3f}".rstrip("0")


def boxes(axes, labelled, colours):
    """Draws a box for each (label, figure), in microseconds."""
    stats = []
    for label, figure in labelled:
        at = {which: microseconds(figure, which)
              for which in ("p5", "p25", "median", "p75", "p95", "p99")}
        stats.append({"label": label, "med": at["median"], "q1": at["p25"], "q3": at["p75"],
                      "whislo": at["p5"], "whishi": at["p95"], "fliers": [at["p99"]]})
    drawn = axes.bxp(stats, patch_artist=True, widths=0.55, medianprops={"color": "black"},
                     flierprops={"marker": "x", "markersize": 4})
    for patch, colour in zip(drawn["boxes"], colours):
        patch.set(facecolor=colour, alpha=0.75, linewidth=0.6)
    log_where_needed(axes, [one[end] for one in stats for end in ("whislo", "med")] +
                     [value for one in stats for value in one["fliers"]])
    for position, one in enumerate(stats, 1):
        axes.text(position + 0.3, one["med"], number(one["med"]), fontsize=7, va="center")
    axes.set_xlim(0.5, len(stats) + 0.8)


def log_where_needed(axes, values):
    """Makes the y axis logarithmic if the values span more than LOG_FROM; otherwise it starts at zero."""
    values = [value for value in values if value > 0]
    if values and max(values) > LOG_FROM * min(values):
        upright_log(axes)
    else:
        axes.set_ylim(bottom=0)
        axes.yaxis.set_major_formatter(FuncFormatter(plain))


def upright_log(axes):
    """Makes the y axis logarithmic, with enough ticks to read it."""
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0,) if high > 100 * low else (1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(plain))
    axes.yaxis.set_minor_locator(NullLocator())


def grid(count, columns, width, height):
    """A page of panels: the figure and `count` axes."""
    rows = -(-count // columns)
    page, axes = pyplot.subplots(rows, columns, figsize=(width * columns, height * rows),
                                 squeeze=False, layout="constrained")
    every = list(axes.flat)
    for spare in every[count:]:
        spare.set_axis_off()
    return page, every[:count]


def draw_thesis(figures):
    """The thesis's figures 5.1 to 5.11: centralized compared with decentralized."""
    sides = ("centralized", "decentralized")
    cases = [case for case in thesis.CASES
             if case.figure and all(f"thesis/{case.key}/{side}" in figures for side in sides)]
    if not cases:
        return None
    page, panels = grid(len(cases), 4, 2.8, 2.5)
    for case, axes in zip(cases, panels):
        keys = [f"thesis/{case.key}/{side}" for side in sides]
        boxes(axes, [(side, figures[key]) for side, key in zip(sides, keys)],
              [COLOURS[side] for side in sides])
        ours = ratio(figures, *keys)
        theirs = f"{case.ratio:.2g}" if case.ratio else case.words
        if case.medians:
            theirs += " ({:.3g}, {:.3g} µs)".format(*case.medians)
        axes.set_title(f"{case.figure} {case.title}\nratio {number(ours)}; thesis: {theirs}")
        axes.set_ylabel("µs")
    page.suptitle("The thesis's cases; the ratio is centralized / decentralized.\n" + BOXES)
    return page


FLOOR_PANELS = tuple((operation, placement) for operation in ("update", "lookup")
                     for placement in ("one_core", "two_cores"))


def draw_floor(figures):
    """tf-dude, bare DDS and bare UDP, a panel for each operation and placement."""
    panels = []
    for operation, placement in FLOOR_PANELS:
        found = [(who, figures[key]) for who in ("ours", "dds", "udp")
                 if (key := f"floor/{operation}/{who}/{placement}") in figures]
        if found:
            panels.append((f"{operation}, {placement.replace('_', ' ')}", found))
    if not panels:
        return None
    page, every = grid(len(panels), 2, 3.6, 2.6)
    for (title, found), axes in zip(panels, every):
        boxes(axes, found, [COLOURS[who] for who, _ in found])
        axes.set(title=title, ylabel="round trip [µs]")
    page.suptitle("The floor: a remote call beside a bare round trip.\n" + BOXES)
    return page


def curve(axes, points, label, colour=None, style="-", convert=microseconds):
    """Draws the medians of [(x, figure)] with a band from the 5th to the 95th percentile."""
    if not points:
        return
    xs = [x for x, _ in points]
    line, = axes.plot(xs, [convert(figure) for _, figure in points], style, marker="o",
                      markersize=3, linewidth=1.2, color=colour, label=label)
    low, high = ([convert(figure, which) for _, figure in points] for which in ("p5", "p95"))
    axes.fill_between(xs, low, high, color=line.get_color(), alpha=0.15, linewidth=0)
    # matplotlib considers lines, but not bands, when it looks for a free place for the legend.
    for edge in (low, high):
        axes.plot(xs, edge, alpha=0)


def by_shape(figures, prefix):
    """[(depth, frames, figure)] of the keys PREFIX/DEPTH/FRAMES, sorted."""
    found = []
    for key, figure in figures.items():
        words = key.split("/")
        if key.startswith(prefix + "/") and len(words) == prefix.count("/") + 3:
            found.append((int(words[-2]), int(words[-1]), figure))
    return sorted(found, key=lambda entry: entry[:2])


def finish_curves(axes, x_label, y_label):
    """Makes the x axis logarithmic, with a tick at each measured x, and the y axis if needed."""
    xs = sorted({x for line in axes.lines for x in line.get_xdata()})
    if not xs:
        return
    axes.set(xscale="log", xlabel=x_label, ylabel=y_label)
    axes.set_xticks(xs, [f"{x:,}" for x in xs])
    log_where_needed(axes, [y for line in axes.lines for y in line.get_ydata()])
    if axes.get_yscale() == "linear":
        axes.set_ylim(top=1.4 * axes.get_ylim()[1])  # room for the legend
    axes.xaxis.set_minor_locator(NullLocator())
    axes.legend(frameon=False, fontsize=7)


CORE_STYLES = (("ours_by_handle", "ours, covariance, by handle", BLUE, "-"),
               ("ours_by_name", "ours, covariance, by name", BLUE, ":"),
               ("ours_pose", "ours, pose only", GREEN, "-"),
               ("tf2", "tf2, no covariance", BROWN, "-"),
               ("ours", "ours, through a node", BLUE, "-"),
               ("ours_forest", "ours, in the forest", GREEN, "-"))
CORE_DEPTH = 30  # the depth for which the number of frames is varied
CORE_PANELS = ("look up by depth", "look up by frames", "set by frames", "add and remove by frames")


def core_points(figures, panel, who):
    """[(x, figure)] of one curve, sorted."""
    operation = {"lo": "lookup", "se": "set", "ad": "add_remove"}[panel[:2]]
    shapes = by_shape(figures, f"core/{operation}/{who}")
    if panel == "look up by depth":  # the largest tree of each depth
        return sorted({depth: figure for depth, _, figure in shapes}.items())
    if panel == "look up by frames":
        shapes = [shape for shape in shapes if shape[0] == CORE_DEPTH]
    return sorted({frames: figure for _, frames, figure in shapes}.items())


def core_curves(figures):
    """Yields all curves of own frames: (name, points)."""
    for panel in CORE_PANELS:
        for who, label, _, _ in CORE_STYLES:
            if points := core_points(figures, panel, who):
                yield f"own frames, {panel}, {label}", points


def draw_core(figures):
    """A process's own frames compared with tf2."""
    if not any(key.startswith("core/") for key in figures):
        return None
    page, panels = grid(len(CORE_PANELS), 2, 4.2, 3.0)
    for panel, axes in zip(CORE_PANELS, panels):
        for who, label, colour, style in CORE_STYLES:
            curve(axes, core_points(figures, panel, who), label, colour, style, nanoseconds)
        by_depth = panel.endswith("depth")
        deep = f", {CORE_DEPTH} edges deep" if panel == "look up by frames" else ""
        axes.set_title(panel + deep)
        finish_curves(axes, "edges of the path" if by_depth else "frames", "ns")
    page.suptitle("Own frames, beside tf2's BufferCore. Medians of the repetitions; "
                  "bands: 5th to 95th percentile.")
    return page


def draw_contention(figures):
    """Readers alone and concurrently with a writer."""
    readers = [key.removesuffix("/alone") for key in sorted(figures)
               if key.startswith("contention/") and key.endswith("/alone")]
    labelled, colours = [], []
    for reader in readers:
        for how in ("alone", "beside_writer"):
            if figure := figures.get(f"{reader}/{how}"):
                who = reader.removeprefix("contention/").replace("/", ", ")
                labelled.append((f"{who}\n{how.replace('_', ' ')}", figure))
                colours.append(COLOURS[how.split("_")[0]])
    if not labelled:
        return None
    page, (axes,) = grid(1, 1, 1.0 + 1.1 * len(labelled), 3.0)
    boxes(axes, labelled, colours)
    axes.set_ylabel("lookup [µs]")
    page.suptitle("A reader, alone and beside a writer of 100 joints at 1 kHz.\n" + BOXES)
    return page


# The varied quantity, the labels of both axes, the conversion of the figures, and key and label of each curve.
SCALES = (
    ("partitions", "partitions on the path", "lookup [µs]", microseconds, (
        ("decentralized", "decentralized"), ("centralized", "centralized"),
        ("dds_floor", "bare DDS"), ("udp_floor", "bare UDP"))),
    ("clients", "clients at once", "lookup [µs]", microseconds, (("latency", "latency"),)),
    ("clients", "clients at once", "calls a second, of all", as_measured, (("rate", "rate"),)),
    ("frames", "frames", "call [µs]", microseconds, (("lookup", "lookup"), ("update", "update"))),
)


def growths(figures):
    """{(what, who): exponent} of everything that was measured over a range."""
    found = {}
    for what, _, _, _, curves in SCALES:
        for who, _ in curves:
            points = numbered(figures, f"scale/{what}/*/{who}")
            if points:
                found[what, who] = growth([(x, figure["median"]) for x, figure in points])
    return found


def draw_scale(figures):
    """Network calls by partitions, clients and frames, with the fitted growth."""
    exponents = growths(figures)
    shown = [scale for scale in SCALES if any((scale[0], who) in exponents for who, _ in scale[4])]
    if not shown:
        return None
    page, panels = grid(len(shown), 2, 4.2, 3.0)
    for (what, x_label, y_label, convert, curves), axes in zip(shown, panels):
        for who, label in curves:
            exponent = exponents.get((what, who))
            fitted = "" if exponent is None else f", ~n^{exponent:.2f}"
            curve(axes, numbered(figures, f"scale/{what}/*/{who}"), label + fitted,
                  COLOURS.get(who.removesuffix("_floor")), convert=convert)
        finish_curves(axes, x_label, y_label)
    page.suptitle("Cost as work grows. Medians; bands: 5th to 95th percentile.")
    return page


PLOTS = {"thesis": draw_thesis, "floor": draw_floor, "core": draw_core,
         "contention": draw_contention, "scale": draw_scale}


def draw(figures, folder):
    """Draws the plots for which there are figures, and removes the files of others. Returns {name: PNG file}."""
    drawn = {}
    for name, function in PLOTS.items():
        files = [folder / f"{name}.{ending}" for ending in ("svg", "png")]
        page = function(figures)
        for file in files:
            if page is None:
                file.unlink(missing_ok=True)
            else:
                # Without a date, equal figures give equal files.
                dateless = {"Date": None} if file.suffix == ".svg" else None
                page.savefig(file, dpi=130, metadata=dateless)
        if page is not None:
            drawn[name] = files[1]
            pyplot.close(page)
    return drawn
