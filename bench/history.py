"""The value of each target in the reports so far: results/history.json, the oldest first.

An entry has the date, commit and processor of a run, whether it was a quick one, and its values by the targets' full
names. Values of another machine are not comparable unless they are ratios, so an entry names its machine.
"""

import json

import targets


def entry(results):
    """The entry of a run."""
    machine = results["machine"]
    values = {target.full_name: target.verdict(results["figures"])[0] for target in targets.TARGETS}
    return {"date": machine["date"], "commit": machine["commit"], "cpu": machine["cpu"],
            "quick": bool(results["settings"].get("quick")),
            "values": {name: float(f"{value:.4g}") for name, value in values.items() if value is not None}}


def with_entry(history, new):
    """The history with one more entry; it replaces that of the same commit."""
    return [old for old in history if old["commit"] != new["commit"]] + [new]


def load(file):
    """The history in a file, which may not exist yet."""
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else []


def save(file, history):
    """Writes the history to a file."""
    file.write_text(json.dumps(history, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def before(history, name):
    """[(date, value)] of a target in all entries but the last one, the oldest first."""
    return [(one["date"].split()[0], one["values"][name]) for one in history[:-1] if name in one["values"]]
