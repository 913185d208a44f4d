"""The type stubs are those of the module, and the examples pass strict checks and run."""

import os
import pathlib
import re
import subprocess
import sys

import pytest
import tfdude

TESTS = pathlib.Path(__file__).resolve().parent
EXAMPLES = TESTS.parent.parent / "examples/python"


def run(*arguments, **more_environment):
    # mypy looks for packages there, too.
    environment = dict(os.environ, MYPYPATH=os.environ["PYTHONPATH"], **more_environment)
    program = subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, text=True, env=environment, timeout=100
    )
    assert program.returncode == 0, program.stdout + program.stderr
    return program.stdout


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """What mypy has found out of NumPy and of the package."""
    return tmp_path_factory.mktemp("mypy")


def test_stubs_are_those_of_the_module():
    run("-m", "mypy.stubtest", "tfdude", "--allowlist", TESTS / "stubtest_allowlist.txt", "--ignore-unused-allowlist")


def test_strict_types(cache):
    run("-m", "mypy", "--strict", "--cache-dir", cache, "-p", "tfdude")
    examples = sorted(EXAMPLES.glob("*.py"))
    run("-m", "mypy", "--strict", "--cache-dir", cache, "--config-file", TESTS / "mypy.ini", *examples)


def test_types_find_mistakes(cache, tmp_path):
    wrong = tmp_path / "wrong.py"
    wrong.write_text(
        "import tfdude\n"
        "X: str = tfdude.Transform().inverse()\n"
        "tfdude.Client(domain='a')\n"
        "tfdude.Transform().translation = 1\n"
    )
    program = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", cache, wrong],
        capture_output=True,
        text=True,
        env=dict(os.environ, MYPYPATH=os.environ["PYTHONPATH"]),
    )
    assert set(re.findall(r"wrong.py:(\d):", program.stdout)) == {"2", "3", "4"}, program.stdout


def test_calibration():
    lines = run(EXAMPLES / "calibration.py").splitlines()
    first, last = (list(map(float, line.split())) for line in (lines[1], lines[-1]))
    assert last[0] == 100
    assert last[2] < first[2] / 10 and last[1] < 4 * last[2]


def test_publisher():
    lines = run(EXAMPLES / "publisher.py", "--seconds", "0.5").splitlines()
    assert lines[0].startswith("500 samples of 6 joints") and " 0 not sent" in lines[0]


def test_plot(tmp_path):
    pytest.importorskip("matplotlib")
    out = run(EXAMPLES / "watch_plot.py", tmp_path / "hand.png", MPLCONFIGDIR=str(tmp_path))
    assert int(out.split()[0]) > 50
    assert (tmp_path / "hand.png").stat().st_size > 5000


def test_scan_to_map():
    lines = run(EXAMPLES / "scan_to_map.py", "--scans", "3").splitlines()
    assert len(lines) == 3
    for line in lines:
        at, thick, sigma, rigid = map(float, re.findall(r"(\d+\.\d+) m", line))
        assert at == 30 and thick < 0.001 and 0.01 < sigma < 0.03 and rigid > 0.9


def test_everything_public_says_what_it_is():
    for name in tfdude.__all__:
        thing = getattr(tfdude, name)
        assert name.startswith("__") or thing.__doc__, name
        if isinstance(thing, type) and not issubclass(thing, Exception):
            methods = [m for m in vars(thing) if not m.startswith("_") and callable(getattr(thing, m))]
            for method in methods:
                # pybind11 writes the signature first.
                text = (getattr(thing, method).__doc__ or "").split("\n\n", 1)
                assert text[-1].strip(), f"{name}.{method}"


def test_blocks_of_the_page_about_python():
    page = (TESTS.parent.parent / "docs/python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 7
    names = {}
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), names)
    assert names["batch"].poses.shape == (2, 7)
    assert names["not_sent"] == []
    names["client"].close()
    names["node"].close()
