"""Draws the figures: box plots of what was timed, curves of what grows. Each as SVG and PNG.

Boxes are from the 25th to the 75th percentile with the median as a line, whiskers from the 5th to the 95th, and
a cross is the 99th.
"""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as pyplot  # noqa: E402  (after the choice of what draws)
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: E402

import thesis  # noqa: E402
from figures import growth, microseconds, numbered, ratio  # noqa: E402

BOXES = "Boxes: quartiles and median; whiskers: 5th to 95th percentile; cross: 99th."
COLOURS = {"centralized": "#b07040", "decentralized": "#2f6f9f", "ours": "#2f6f9f", "dds": "#7f7f7f",
           "udp": "#b9b9b9", "tf2": "#b07040", "alone": "#7f7f7f", "beside": "#2f6f9f"}
LOG_FROM = 10.0  # an axis is logarithmic where the largest median is more than this times the least

matplotlib.rcParams.update({
    "font.size": 8, "axes.titlesize": 8, "axes.grid": True, "grid.color": "#e4e4e4", "grid.linewidth": 0.6,
    "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False,
    # The same figures make the same file.
    "svg.hashsalt": "tf-dude", "svg.fonttype": "none",
})


def plain(value, _position=None):
    """A tick's number without powers of ten."""
    return f"{value:,.0f}" if value >= 1 or value == 0 else f"{value:.3f}".rstrip("0")


def boxes(axes, labelled, colours):
    """Draws a box for each (label, figure), in microseconds."""
    stats = []
    for label, figure in labelled:
        at = {name: microseconds(figure, name) for name in ("p5", "p25", "median", "p75", "p95", "p99")}
        stats.append({"label": label, "med": at["median"], "q1": at["p25"], "q3": at["p75"],
                      "whislo": at["p5"], "whishi": at["p95"], "fliers": [at["p99"]]})
    drawn = axes.bxp(stats, patch_artist=True, widths=0.55, medianprops={"color": "black"},
                     flierprops={"marker": "x", "markersize": 4})
    for patch, colour in zip(drawn["boxes"], colours):
        patch.set(facecolor=colour, alpha=0.75, linewidth=0.6)
    log_where_needed(axes, [one["med"] for one in stats])
    for position, one in enumerate(stats, 1):
        axes.annotate(three_digits(one["med"]), (position, one["med"]), xytext=(16, 0),
                      textcoords="offset points", fontsize=7, va="center")
    axes.set_xlim(0.5, len(stats) + 0.75)


def three_digits(value):
    """A median beside its box."""
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}"


def log_where_needed(axes, values, least=LOG_FROM):
    """Makes the upright axis logarithmic where the values span more than ten times; else it begins at zero."""
    values = [value for value in values if value > 0]
    if values and max(values) > least * min(values):
        axes.set_yscale("log")
        span = max(values) / min(values)
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0,) if span > 100 else (1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(plain))
        axes.yaxis.set_minor_formatter(NullFormatter())
    else:
        axes.set_ylim(bottom=0)


def grid(count, columns, width, height):
    """A page of panels: the figure and as many axes as are wanted."""
    rows = -(-count // columns)
    page, axes = pyplot.subplots(rows, columns, figsize=(width * columns, height * rows),
                                 squeeze=False, layout="constrained")
    every = list(axes.flat)
    for spare in every[count:]:
        spare.set_axis_off()
    return page, every[:count]


def draw_thesis(figures):
    """The thesis's figures 5.1 to 5.11: centralized beside decentralized."""
    sides = ("centralized", "decentralized")
    cases = [case for case in thesis.CASES
             if all(f"thesis/{case.key}/{side}" in figures for side in sides)]
    if not cases:
        return None
    page, panels = grid(len(cases), 4, 2.7, 2.5)
    for case, axes in zip(cases, panels):
        keys = [f"thesis/{case.key}/{side}" for side in sides]
        boxes(axes, [(side, figures[key]) for side, key in zip(sides, keys)],
              [COLOURS[side] for side in sides])
        ours = ratio(figures, *keys)
        theirs = f"{case.ratio:.2g}" if case.ratio else case.words or "no such figure"
        axes.set_title(f"{case.figure} {case.title}".strip() +
                       f"\ncentr./decentr.: ours {three_digits(ours)}; thesis: {theirs}")
        axes.set_ylabel("us")
    page.suptitle("The thesis's cases, centralized and decentralized. " + BOXES)
    return page


def draw_floor(figures):
    """Ours, bare DDS and bare UDP, a panel for each operation and placement."""
    panels = []
    for operation in ("update", "lookup"):
        for placement in ("one_core", "two_cores"):
            found = [(who, figures[key]) for who in ("ours", "dds", "udp")
                     if (key := f"floor/{operation}/{who}/{placement}") in figures]
            if found:
                panels.append((f"{operation}, {placement.replace('_', ' ')}", found))
    if not panels:
        return None
    page, every = grid(len(panels), 2, 3.6, 2.6)
    for (title, found), axes in zip(panels, every):
        boxes(axes, found, [COLOURS[who] for who, _ in found])
        axes.set(title=title, ylabel="round trip [us]")
    page.suptitle("The floor: a remote call beside a bare round trip.\n" + BOXES)
    return page


def curve(axes, points, label, colour=None, style="-"):
    """Draws medians with a band from the 5th to the 95th percentile: points are [(x, figure)] by x."""
    if not points:
        return
    xs = [x for x, _ in points]
    line, = axes.plot(xs, [microseconds(figure) for _, figure in points], style, marker="o",
                      markersize=3, linewidth=1.2, color=colour, label=label)
    axes.fill_between(xs, [microseconds(figure, "p5") for _, figure in points],
                      [microseconds(figure, "p95") for _, figure in points],
                      color=line.get_color(), alpha=0.15, linewidth=0)


def by_shape(figures, prefix):
    """[(depth, frames, figure)] of the keys PREFIX/DEPTH/FRAMES, sorted."""
    found = []
    for key, figure in figures.items():
        words = key.split("/")
        if key.startswith(prefix + "/") and len(words) == prefix.count("/") + 3:
            found.append((int(words[-2]), int(words[-1]), figure))
    return sorted(found, key=lambda entry: entry[:2])


def deepest(figures, prefix):
    """[(depth, figure)], of the largest tree of each depth."""
    return sorted({depth: figure for depth, _, figure in by_shape(figures, prefix)}.items())


def logarithmic(axes, xs, x_label, y_label="us"):
    """Both axes logarithmic, with a tick at each x that was measured."""
    axes.set(xscale="log", yscale="log", xlabel=x_label, ylabel=y_label)
    axes.set_xticks(sorted(set(xs)), [f"{x:,}" for x in sorted(set(xs))])
    axes.minorticks_off()
    axes.yaxis.set_major_formatter(FuncFormatter(plain))
    axes.legend(frameon=False, fontsize=7)


CORE_CURVES = (("ours_by_handle", "ours, with covariance, by handle", "#2f6f9f", "-"),
               ("ours_by_name", "ours, with covariance, by name", "#2f6f9f", ":"),
               ("ours_pose", "ours, pose only, by handle", "#3f9f6f", "-"),
               ("tf2", "tf2, no covariance", "#b07040", "-"))


def draw_core(figures):
    """A process's own frames beside tf2: lookup by depth; set, add and remove by the number of frames."""
    if not deepest(figures, "core/lookup/ours_by_handle"):
        return None
    page, (lookup, edge, leaf) = grid(3, 3, 3.6, 3.0)
    for who, label, colour, style in CORE_CURVES:
        curve(lookup, deepest(figures, f"core/lookup/{who}"), label, colour, style)
    depths = [depth for depth, _ in deepest(figures, "core/lookup/ours_by_handle")]
    lookup.set_title("look up")
    logarithmic(lookup, depths, "edges of the path")
    frames = []
    for who, label, colour, style in CORE_CURVES:
        points = [(count, figure) for _, count, figure in by_shape(figures, f"core/set/{who}")]
        points = sorted(dict(points).items())
        curve(edge, points, label.replace("with covariance, ", ""), colour, style)
        frames += [count for count, _ in points]
    edge.set_title("set an edge")
    logarithmic(edge, frames, "frames")
    frames = []
    for who, label, colour in (("ours", "through a node", "#2f6f9f"),
                               ("ours_forest", "in the forest", "#3f9f6f")):
        points = [(count, figure) for _, count, figure in by_shape(figures, f"core/add_remove/{who}")]
        curve(leaf, points, label, colour)
        frames += [count for count, _ in points]
    leaf.set_title("add and remove a leaf (tf2 cannot)")
    logarithmic(leaf, frames, "frames")
    page.suptitle("Own frames, beside tf2's BufferCore. Medians; bands: 5th to 95th percentile of the repetitions.")
    return page


def draw_contention(figures):
    """Readers alone and beside a writer."""
    alone = [key.split("/")[1] for key in sorted(figures)
             if key.startswith("contention/") and key.endswith("/alone")]
    labelled, colours = [], []
    for who in alone:
        for how in ("alone", "beside_writer"):
            if figure := figures.get(f"contention/{who}/{how}"):
                labelled.append((f"{who}\n{how.replace('_', ' ')}", figure))
                colours.append(COLOURS[how.split("_")[0]])
    if not labelled:
        return None
    page, (axes,) = grid(1, 1, 1.2 + 1.1 * len(labelled), 3.0)
    boxes(axes, labelled, colours)
    axes.set_ylabel("lookup [us]")
    page.suptitle("A reader, alone and beside a writer of 100 joints at 1 kHz.\n" + BOXES, fontsize=7)
    return page


SCALES = (
    ("partitions", "partitions on the path", (
        ("decentralized", "decentralized"), ("centralized", "centralized"), ("udp_floor", "bare UDP"))),
    ("clients", "clients at once", (("latency", "lookup"),)),
    ("frames", "frames", (("lookup", "lookup"), ("update", "update"))),
)


def growths(figures):
    """{(what, who): exponent} of all that was measured over a range."""
    found = {}
    for what, _, curves in SCALES:
        for who, _ in curves + ((("rate", ""),) if what == "clients" else ()):
            points = numbered(figures, f"scale/{what}/*/{who}")
            if points:
                found[what, who] = growth([(x, figure["median"]) for x, figure in points])
    return found


def draw_scale(figures):
    """Network calls by partitions, clients and frames, with the fitted growth."""
    exponents = growths(figures)
    shown = [scale for scale in SCALES if any(what == scale[0] for what, _ in exponents)]
    if not shown:
        return None
    page, panels = grid(len(shown), 3, 3.6, 3.0)
    for (what, x_label, curves), axes in zip(shown, panels):
        xs = []
        for who, label in curves:
            points = numbered(figures, f"scale/{what}/*/{who}")
            exponent = exponents.get((what, who))
            fitted = "" if exponent is None else f", ~n^{exponent:.2f}"
            curve(axes, points, label + fitted)
            xs += [x for x, _ in points]
        if xs:
            logarithmic(axes, xs, x_label)
    page.suptitle("Cost as work grows. Medians; bands: 5th to 95th percentile.")
    return page


PLOTS = {"thesis": draw_thesis, "floor": draw_floor, "core": draw_core,
         "contention": draw_contention, "scale": draw_scale}


def draw(figures, folder):
    """Draws what there are figures for; returns {name: PNG file}. An earlier run's plots do not stay."""
    drawn = {}
    for name, function in PLOTS.items():
        files = [folder / f"{name}.{ending}" for ending in ("svg", "png")]
        page = function(figures)
        for file in files:
            if page is None:
                file.unlink(missing_ok=True)
            else:
                page.savefig(file, dpi=130, metadata={"Date": None} if file.suffix == ".svg" else None)
        if page is not None:
            drawn[name] = files[1]
            pyplot.close(page)
    return drawn
