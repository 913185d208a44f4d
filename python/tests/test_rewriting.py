"""The past is rewritten, by arrays; and the example of docs/rewriting.md."""

import re
from pathlib import Path

import numpy as np
import pytest
import tfdude

DOCS = Path(__file__).resolve().parents[2] / "docs"
SECOND = 1_000_000_000


@pytest.fixture
def slam(network):
    frames = [
        tfdude.FrameSpec("map"),
        tfdude.FrameSpec("odom", "map", moving=True, span=600, count=65536),
        tfdude.FrameSpec("fixed", "map"),
    ]
    with tfdude.Node("slam", frames, network=network) as node:
        for k in range(10):
            node.update("odom", tfdude.Transform.exact((k, 0, 0)), (100 + k) * SECOND)
        with tfdude.Client(network=network) as client:
            yield client


def rows(xs):
    poses = np.zeros((len(xs), 7))
    poses[:, 0] = xs
    poses[:, 6] = 1
    return poses


def x(client, seconds):
    return client.lookup("map", "odom", int(seconds * SECOND)).translation[0]


def test_the_example_prints_what_the_page_says(capsys):
    page = (DOCS / "rewriting.md").read_text()
    (example,) = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    exec(compile(example, "rewriting.md", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    assert printed == ["sample 600: 600 mm, 50 mm", "sample 800: 650 mm, 1 mm"]
    for line in printed:
        assert f"`{line}`" in page


@pytest.mark.parametrize("kind", ["int64", "float64", "datetime64", "list"])
def test_stamps_of_any_kind(slam, kind):
    ns = (np.array([103, 104.5, 106]) * SECOND).astype(np.int64)
    stamps = {
        "int64": ns,
        "float64": ns / SECOND,
        "datetime64": ns.astype("datetime64[ns]"),
        "list": [int(one) for one in ns],
    }[kind]
    slam.rewrite("odom", stamps, rows([30, 45, 60]))
    assert [x(slam, t) for t in (102, 103, 104.5, 106, 107)] == [2, 30, 45, 60, 7]


def test_an_interval_is_wider_than_its_samples(slam):
    slam.rewrite("odom", [105 * SECOND], rows([50]), "exact", interval=(103 * SECOND, 107 * SECOND))
    assert [x(slam, t) for t in (102, 105, 108)] == [2, 50, 8]
    assert abs(x(slam, 103.5) - 26) < 1e-9  # half the way
    assert slam.history("odom")[0].samples == 6


def test_covariances(slam):
    stamps = np.array([103, 104]) * SECOND
    each = np.stack([np.eye(6), 2 * np.eye(6)])
    for covariances, expected in (("exact", [0, 0]), (3 * np.eye(6), [3, 3]), (each, [1, 2])):
        slam.rewrite("odom", stamps, rows([1, 2]), covariances)
        assert [slam.lookup("map", "odom", int(t)).covariance[0, 0] for t in stamps] == expected
    slam.rewrite("odom", stamps, [tfdude.Transform((7, 0, 0))] * 2)
    assert not slam.lookup("map", "odom", int(stamps[0])).complete


def test_errors_change_nothing(slam):
    one = [103 * SECOND]
    with pytest.raises(tfdude.LookupException):
        slam.rewrite("nobody", one, rows([1]))
    with pytest.raises(tfdude.InvalidArgumentException, match="static"):
        slam.rewrite("fixed", one, rows([1]))
    with pytest.raises(tfdude.InvalidArgumentException, match="not later"):
        slam.rewrite("odom", one * 2, rows([1, 2]), interval=(one[0], one[0]))
    with pytest.raises(tfdude.InvalidArgumentException, match="outside"):
        slam.rewrite("odom", one, rows([1]), interval=(104 * SECOND, 105 * SECOND))
    with pytest.raises(ValueError, match=r"poses must have the shape \(1, 7\)"):
        slam.rewrite("odom", one, rows([1, 2]))
    with pytest.raises(ValueError, match="at least one"):
        slam.rewrite("odom", [], rows([]))
    with pytest.raises(TypeError, match="interval"):
        slam.rewrite("odom", one, rows([1]), interval=5)
    assert [x(slam, t) for t in range(100, 110)] == list(range(10))
