"""The example of docs/moving-base.md does what the page says."""

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_example_prints_what_the_page_says(capsys):
    page = (DOCS / "moving-base.md").read_text()
    (example,) = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    exec(compile(example, "moving-base.md", "exec"), {})
    sigma = dict(re.findall(r"the object in (\w+): ([\d.]+) mm", capsys.readouterr().out))
    assert 7.5 < float(sigma["base"]) < 8.7
    assert 30 < float(sigma["odom"]) < 60
