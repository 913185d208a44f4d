"""Draws the figures of docs/accuracy.md as SVG; equal results give equal files."""

import io
import re

from matplotlib import pyplot
from matplotlib.ticker import FuncFormatter, NullLocator

from plots import BLUE, BROWN, GREEN, GREY

RED = "#b03a48"
WAYS = (("independent", "as if independent", BROWN, "o"), ("second", "shared, second order", BLUE, "s"),
        ("fourth", "shared, fourth order", GREEN, "^"), ("bound", "unknown (bound)", GREY, "D"))


def page_of(columns, height=3.1):
    """A figure with its panels side by side."""
    page, axes = pyplot.subplots(1, columns, figsize=(3.9 * columns, height), squeeze=False,
                                 layout="constrained")
    return page, list(axes.flat)


def logarithmic(axes, x=True, y=True):
    """Makes axes logarithmic, with plain numbers instead of powers of ten."""
    for wanted, axis, scale in ((x, axes.xaxis, axes.set_xscale), (y, axes.yaxis, axes.set_yscale)):
        if wanted:
            scale("log")
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_minor_locator(NullLocator())


def curve(axes, rows, across, up, label, colour, marker):
    """A line with markers at its points."""
    axes.plot([across(row) for row in rows], [up(row) for row in rows], label=label, color=colour,
              marker=marker, markersize=3.5, linewidth=1.2)


def two_poses(results):
    rows = results["two_poses"]["rows"]
    page, (off, nees) = page_of(2)
    for order, colour, marker in (("second", BLUE, "s"), ("fourth", GREEN, "^")):
        curve(off, rows, lambda row: row["alpha"],
              lambda row, order=order: row[order]["error"] / row["norm"], f"{order} order", colour,
              marker)
        curve(nees, rows, lambda row: row["alpha"], lambda row, order=order: row[order]["nees"],
              f"{order} order", colour, marker)
    logarithmic(off)
    off.set_title("Distance from the sampled covariance, relative")
    off.set_ylabel("‖Σ − Σ sampled‖ / ‖Σ sampled‖")
    logarithmic(nees, y=False)
    nees.axhline(1, color="black", linewidth=0.8)
    nees.set_title("NEES / 6: above one too small, below too large")
    for axes in (off, nees):
        axes.axvline(1, color=RED, linewidth=0.8, linestyle=":", label="an axis with σ = 1 rad")
        axes.set_xlabel("α")
        axes.legend(frameon=False)
    return page


def outline(axes, points, label, colour, style, width=1.3):
    """A closed curve."""
    axes.plot([x for x, _ in points], [y for _, y in points], label=label, color=colour,
              linestyle=style, linewidth=width)


def dots(axes, points, label, colour):
    """Many points as one path of short strokes, because markers would make the file large."""
    places = [(place, y) for x, y in points for place in (x, x + 0.05, float("nan"))]
    axes.plot([x for x, _ in places], [y for _, y in places], color=colour, linewidth=1.7,
              solid_capstyle="round", zorder=1)
    axes.plot([], [], ".", color=colour, markersize=4, label=label)


def chain(results):
    found = results["chain"]
    page, every = page_of(3, 4.6)
    titles = ("Second order, mapped through Exp", "Fourth order, mapped through Exp",
              "Gaussians of x and y")
    for axes, title in zip(every, titles):
        dots(axes, found["points"], "ends of sampled chains", "#a9b4bd")
        axes.set_title(title)
        axes.set_xlabel("x [m]")
        axes.set_xlim(60, 112)
        axes.set_ylim(-66, 66)
    every[0].set_ylabel("y [m]")
    for order, axes, colour in (("second", every[0], BLUE), ("fourth", every[1], GREEN)):
        for sigmas, style, points in zip((1, 3), ("--", "-"), found["outlines"][order]):
            outline(axes, points, f"{sigmas}σ", colour, style)
    for sigmas, style, points in zip((1, 3), ("--", "-"), found["outlines"]["moments"]):
        outline(every[2], points, f"{sigmas}σ of the samples' moments", GREY, style)
    linear = found["linear"]
    for sigmas, width in ((3, 1.5), (1, 4.0)):
        reach = sigmas * linear["stddev_y"]
        outline(every[2], [(linear["x"], -reach), (linear["x"], reach)],
                f"{sigmas}σ, linearised: no width", RED, "-", width)
    for axes in every:
        axes.legend(frameon=False, loc="center left", handlelength=1.6)
    return page


def fusion(results):
    rows = results["fusion"]["rows"]
    page, (cost, error, nees) = page_of(3)
    alpha = lambda row: row["alpha"]  # noqa: E731
    curve(cost, rows, alpha, lambda row: row["cost"], "mean over the trials", BLUE, "o")
    cost.axhline(12, color="black", linewidth=0.8, label="18 numbers, less 6 found")
    cost.set_ylim(0, 16)
    cost.set_title("Cost at the least, Σ eᵀ Σₖ⁻¹ e")
    curve(error, rows, alpha, lambda row: row["error"], "sampled", BLUE, "o")
    curve(error, rows, alpha, lambda row: row["claimed"], "claimed: √ tr Σ", BROWN, "s")
    error.set_title("Error, root of the mean square")
    curve(nees, rows, alpha, lambda row: row["nees"], "mean over the trials", BLUE, "o")
    nees.axhline(6, color="black", linewidth=0.8, label="consistent")
    nees.set_ylim(0, 10)
    nees.set_title("NEES of the result")
    for axes in (cost, error, nees):
        logarithmic(axes, y=axes is error)
        axes.set_xlabel("α")
        axes.legend(frameon=False)
    return page


def correlation(results):
    rows = results["correlation"]["rows"]
    page, (off, nees) = page_of(2)
    for key, label, colour, marker in WAYS:
        curve(off, rows, lambda row: row["correlation"],
              lambda row, key=key: row[key]["error"] / row["norm"], label, colour, marker)
        curve(nees, rows, lambda row: row["correlation"], lambda row, key=key: row[key]["nees"],
              label, colour, marker)
    logarithmic(off, x=False)
    off.set_title("Distance from the sampled covariance, relative")
    off.set_ylabel("‖Σ − Σ sampled‖ / ‖Σ sampled‖")
    nees.axhline(1, color="black", linewidth=0.8)
    nees.set_ylim(0, 2)
    nees.set_title("NEES / 6: above one too small, below too large")
    for axes in (off, nees):
        axes.set_xlabel("correlation of both errors")
    nees.legend(frameon=False)
    return page


def trajectory(results):
    rows = results["trajectory"]["rows"]
    page, (driven, joint) = page_of(2, 3.6)
    metres = lambda key: lambda row: row[key]["metres"]  # noqa: E731
    steps = lambda row: row["steps"]  # noqa: E731
    for axes, truth, ending, title in (
            (driven, "driven", "_driven", "B driven from A"),
            (joint, "joint", "", "A and B jointly Gaussian")):
        keys = {"second": "second" + ending, "fourth": "fourth" + ending}
        for key, label, colour, marker in WAYS:
            curve(axes, rows, steps, metres(keys.get(key, key)), label, colour, marker)
        axes.plot([steps(row) for row in rows], [metres(truth)(row) for row in rows], "--",
                  color="black", linewidth=1.0, label="right")
        logarithmic(axes)
        axes.set_title(title)
        axes.set_xlabel("steps before A")
        axes.set_ylabel("σ of B's position seen from A [m]")
    driven.legend(frameon=False)
    return page


FIGURES = {"two_poses": two_poses, "chain": chain, "fusion": fusion, "correlation": correlation,
           "trajectory": trajectory}


def draw(results, folder):
    """Writes all figures to the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, function in FIGURES.items():
        page = function(results)
        drawn = io.StringIO()
        page.savefig(drawn, format="svg", metadata={"Date": None})
        pyplot.close(page)
        # Two decimals are precise enough.
        short = re.sub(r"(\d\.\d\d)\d+", r"\1", drawn.getvalue())
        (folder / f"{name}.svg").write_text(short, encoding="utf-8")
