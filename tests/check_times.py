#!/usr/bin/env python3
"""Names the tests that took more than ten seconds, and have no reason for it in tests/slow_tests.txt.

    check_times.py JUNIT_FILE    what ctest --output-junit wrote
    check_times.py --self-test
"""
import pathlib
import sys
import tempfile
import xml.etree.ElementTree

MOST_SECONDS = 10
REASONS = pathlib.Path(__file__).with_name("slow_tests.txt")


def without_reason(file, reasons):
    names = {line.partition(" | ")[0].replace(": ", ":") for line in reasons.splitlines() if not line.startswith("#")}
    for test in xml.etree.ElementTree.parse(file).iter("testcase"):
        # A test of Catch2 is "binary:case" or "binary: case", by its version.
        name, seconds = test.get("name"), float(test.get("time", 0))
        if seconds > MOST_SECONDS and name.replace(": ", ":") not in names:
            yield f"{name}: {seconds:.0f} s"


def self_test():
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write('<testsuite><testcase name="a: slow" time="12"/><testcase name="a: slow, too" time="11.5"/>'
                   '<testcase name="fast" time="9"/></testsuite>')
        file.flush()
        assert list(without_reason(file.name, "# x\na: slow | waits\n")) == ["a: slow, too: 12 s"]
        assert len(list(without_reason(file.name, ""))) == 2
    for line in REASONS.read_text().splitlines():
        assert line.startswith("#") or line.count(" | ") == 1, line
    print("ok")


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    found = list(without_reason(sys.argv[1], REASONS.read_text()))
    if found:
        print(f"More than {MOST_SECONDS} s, without a reason in tests/slow_tests.txt:", *found, sep="\n  ")


if __name__ == "__main__":
    main()
