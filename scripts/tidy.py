#!/usr/bin/env python3
"""Runs clang-tidy over src/ and apps/: tidy.py BUILD_DIR, the folder of compile_commands.json.

A clean file is not checked again until its preprocessed text, its compile command, the rules or the tool change: a
full run takes many seconds per file, most of them in headers of other projects.
"""

import concurrent.futures
import hashlib
import json
import pathlib
import shlex
import subprocess
import sys

JOBS = 2
ROOT = pathlib.Path(__file__).resolve().parent.parent


def output_of(*command):
    return subprocess.run(command, check=True, capture_output=True).stdout


def fingerprint(entry, rules):
    """A hash of everything that determines clang-tidy's findings for a file; comments count, for their NOLINT."""
    arguments = shlex.split(entry["command"])
    arguments = arguments[: arguments.index("-o")] + ["-E", "-C", entry["file"]]
    if pathlib.Path(arguments[0]).name == "ccache":
        del arguments[0]
    text = subprocess.run(arguments, cwd=entry["directory"], check=True, capture_output=True).stdout
    return hashlib.sha256(rules + entry["command"].encode() + text).hexdigest()


def check(entry, rules, build, stamps):
    """Returns the findings, or None if there are none."""
    try:
        stamp = stamps / fingerprint(entry, rules)
    except subprocess.CalledProcessError as error:
        return error.stderr.decode()
    if stamp.exists():
        stamp.touch()
        return None
    run = subprocess.run(["clang-tidy", "-p", build, "--quiet", entry["file"]],
                         capture_output=True, text=True)
    if run.returncode == 0:
        stamp.touch()
        return None
    return run.stdout or run.stderr


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    commands = json.loads((build / "compile_commands.json").read_text())
    ours = [entry for entry in commands
            if pathlib.Path(entry["file"]).is_relative_to(ROOT / "src")
            or pathlib.Path(entry["file"]).is_relative_to(ROOT / "apps")]
    if not ours:
        sys.exit("tidy: no sources of src/ or apps/ in " + str(build))
    stamps = build / "tidy"
    stamps.mkdir(exist_ok=True)
    rules = output_of("clang-tidy", "--version") + (ROOT / ".clang-tidy").read_bytes()
    bad = 0
    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        for findings in pool.map(lambda entry: check(entry, rules, build, stamps), ours):
            if findings is not None:
                bad += 1
                print(findings, flush=True)
    if bad:
        sys.exit(f"clang-tidy: findings in {bad} of {len(ours)} files")


if __name__ == "__main__":
    main()
