"""What all sections of the report are made of: tables, values as text, pictures."""

import os

from figures import microseconds, number

MISSING = "missing"


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
