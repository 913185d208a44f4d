"""The format of a measured figure, and functions that compute values from figures.

A figure is a dict as the C++ programs print it (bench/support/series.cpp): unit, n, min, p5, p25,
median, p75, p90, p95, p99, p99.9, max, mean, and medians, the median of each repetition. The
results contain the figures by key; a key consists of words separated by slashes.
"""

import math
import statistics

QUANTILES = {"min": 0.0, "p5": 0.05, "p25": 0.25, "median": 0.5, "p75": 0.75, "p90": 0.9,
             "p95": 0.95, "p99": 0.99, "p99.9": 0.999, "max": 1.0}


def quantile(ordered, share):
    """The quantile of sorted values by the nearest rank, as in series.cpp."""
    return ordered[max(math.ceil(share * len(ordered)), 1) - 1]


def summary(key, unit, values):
    """The figure of values; each value is one repetition."""
    ordered = sorted(values)
    figure = {"key": key, "unit": unit, "n": len(values)}
    figure.update({name: quantile(ordered, share) for name, share in QUANTILES.items()})
    figure["mean"] = statistics.fmean(values)
    figure["medians"] = list(values)
    return figure


def ratio(figures, over, under, which="median"):
    """The ratio of `over` to `under`, or None if one of them is missing.

    For medians, the median of the ratios of each repetition, if both sides have the same number of
    repetitions: a disturbance of the machine in one repetition then affects both sides. For another
    quantile, the plain quotient.
    """
    a, b = figures.get(over), figures.get(under)
    if not a or not b or which not in a or which not in b:
        return None
    if which == "median" and a["medians"] and len(a["medians"]) == len(b["medians"]):
        pairs = zip(a["medians"], b["medians"])
        quotients = [x / y for x, y in pairs if y > 0]
        return statistics.median(quotients) if quotients else None
    return a[which] / b[which] if b[which] > 0 else None


def numbered(figures, pattern):
    """[(number, figure)] of the keys that match `pattern`, sorted; the star stands for the number."""
    before, after = pattern.split("*")
    found = []
    for key, figure in figures.items():
        middle = key[len(before):len(key) - len(after)]
        if key.startswith(before) and key.endswith(after) and middle.isdigit():
            found.append((int(middle), figure))
    return sorted(found, key=lambda entry: entry[0])


def growth(points):
    """The exponent e of y ~ x^e by least squares of the logarithms, or None for fewer than three points."""
    logs = [(math.log(x), math.log(y)) for x, y in points if x > 0 and y > 0]
    if len(logs) < 3:
        return None
    mean_x = statistics.fmean(x for x, _ in logs)
    mean_y = statistics.fmean(y for _, y in logs)
    spread = sum((x - mean_x) ** 2 for x, _ in logs)
    if spread == 0:
        return None
    return round(sum((x - mean_x) * (y - mean_y) for x, y in logs) / spread, 2) + 0.0  # not -0.0


def growth_in_words(exponent):
    """A description of an exponent for the report."""
    if exponent < -0.1:
        kind = "falls"
    elif exponent < 0.1:
        kind = "does not grow"
    elif exponent < 0.8:
        kind = "grows less than in proportion"
    elif exponent <= 1.2:
        kind = "grows in proportion"
    else:
        kind = "grows more than in proportion"
    return f"{kind} (fitted exponent {exponent:.2f})"


NANOSECONDS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


def nanoseconds(figure, which="median"):
    """A time of a figure [ns]."""
    return figure[which] * NANOSECONDS[figure["unit"]]


def microseconds(figure, which="median"):
    """A time of a figure [us]."""
    return nanoseconds(figure, which) / 1e3


def as_measured(figure, which="median"):
    """A value of a figure, in the figure's unit."""
    return figure[which]


def number(value):
    """A value as text: three significant digits; whole numbers without decimals."""
    if value is None:
        return "missing"
    if isinstance(value, int) or value == 0 or abs(value) >= 100:
        return f"{value:,.0f}"
    return f"{value:.{min(2 - math.floor(math.log10(abs(value))), 6)}f}"
