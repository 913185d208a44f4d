#!/usr/bin/env python3
"""Finds lines that are too long: over 100 columns in C and C++, over 120 elsewhere. Rows of tables may be longer."""
import re
import subprocess
import sys

LIMITS = {r"\.(hpp|cpp|c|ipp|idl)$": 100,
          r"\.(md|py|cmake|xml|yaml|yml|sh|bash)$|CMakeLists\.txt$|^scripts/[^.]+$": 120}
# Rows of tables, addresses, and lines that a tool requires in one piece.
FREE = re.compile(r"^\s*\||https?://|file://|^\s*#include|NOLINT|^<img ")


def main():
    names = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"],
                           capture_output=True, text=True, check=True).stdout.split()
    found = 0
    for name in names:
        limit = next((width for pattern, width in LIMITS.items() if re.search(pattern, name)), None)
        if limit is None or name == "bench/REPORT.md":
            continue
        with open(name, encoding="utf-8") as lines:
            for number, line in enumerate(lines, 1):
                width = len(line.rstrip("\n"))
                if width > limit and not FREE.search(line):
                    found += 1
                    print(f"{name}:{number}: {width} columns, {limit} are allowed")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
