#!/usr/bin/env python3
"""Runs clang-tidy over src/ and apps/, those files first that were changed last:

    tidy.py [--changed] [--minutes N] BUILD_DIR

BUILD_DIR is the folder of compile_commands.json. A clean file is not checked again until its preprocessed text, its
compile command, the rules or the tool change: a full run takes many seconds per file, most of them in headers of other
projects. With --changed only those are checked that were changed since the last landed commit, or include such a
header. With --minutes no file is begun after that time.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import time

JOBS = 2
ROOT = pathlib.Path(__file__).resolve().parent.parent


def output_of(*command):
    return subprocess.run(command, check=True, capture_output=True).stdout


def fingerprint(entry, rules):
    """A hash of everything that determines clang-tidy's findings for a file; comments count, for their NOLINT."""
    arguments = shlex.split(entry["command"])
    arguments = arguments[: arguments.index("-o")] + ["-E", "-C", entry["file"]]
    text = subprocess.run(arguments, cwd=entry["directory"], check=True, capture_output=True).stdout
    return hashlib.sha256(rules + entry["command"].encode() + text).hexdigest()


def check(entry, rules, stamps):
    """Returns the findings, or None if there are none."""
    try:
        stamp = stamps / fingerprint(entry, rules)
    except subprocess.CalledProcessError as error:
        return error.stderr.decode()
    if stamp.exists():
        stamp.touch()
        return None
    run = subprocess.run(["clang-tidy", "-p", stamps, "--quiet", entry["file"]],
                         capture_output=True, text=True)
    if run.returncode == 0:
        stamp.touch()
        return None
    return run.stdout or run.stderr or "clang-tidy failed for " + entry["file"]


def without_precompiled(command):
    """The command as clang understands it: without ccache and without headers that another compiler precompiled."""
    arguments = shlex.split(command)
    if pathlib.Path(arguments[0]).name == "ccache":
        del arguments[0]
    while "-include" in arguments:
        at = arguments.index("-include")
        del arguments[at:at + 2]
    return shlex.join(argument for argument in arguments if argument != "-Winvalid-pch")


def changes():
    """When each file of the project was last changed: by its last commit, or, if that is not it, by its own time."""
    log = output_of("git", "-C", ROOT, "log", "--format=commit %ct", "--name-only").decode()
    times = {}
    at = 0
    for line in log.splitlines():
        if line.startswith("commit "):
            at = int(line.split()[1])
        elif line:
            times.setdefault(line, at)
    dirty = output_of("git", "-C", ROOT, "ls-files", "--modified", "--others", "--exclude-standard").decode()
    for line in dirty.splitlines():
        if (ROOT / line).exists():
            times[line] = int(os.stat(ROOT / line).st_mtime)
    return times


def landed():
    """The commit where HEAD has left origin/main; the one before HEAD, if that is HEAD; None: neither is known."""
    def commit(*command):
        return subprocess.run(["git", "-C", ROOT, *command], capture_output=True, text=True).stdout.strip()
    here = commit("rev-parse", "HEAD")
    base = commit("merge-base", "HEAD", "origin/main")
    return base if base and base != here else commit("rev-parse", "--verify", "--quiet", "HEAD~1") or None


def changed_since(commit, times):
    """Of what changes() returns, what was changed since a commit."""
    names = output_of("git", "-C", ROOT, "diff", "--name-only", commit).decode().splitlines()
    names += output_of("git", "-C", ROOT, "ls-files", "--others", "--exclude-standard").decode().splitlines()
    return {name: times[name] for name in names if name in times}


def changed(file, times):
    """When a source was last changed, or a header of the project that it includes itself; 0: that is not known."""
    newest = times.get(str(file.relative_to(ROOT)), 0)
    for name in re.findall(r'^#include "(.*)"', file.read_text(), re.MULTILINE):
        for folder in ("src", "include", "apps"):
            newest = max(newest, times.get(f"{folder}/{name}", 0))
    return newest


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--changed", action="store_true", help="only what was changed since the last landed commit")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin no file after this time")
    parser.add_argument("build", type=pathlib.Path, help="the folder of compile_commands.json")
    options = parser.parse_args()
    until = time.monotonic() + 60 * options.minutes
    build = options.build.resolve()
    stamps = build / "tidy"
    stamps.mkdir(exist_ok=True)
    commands = json.loads((build / "compile_commands.json").read_text())
    for entry in commands:
        entry["command"] = without_precompiled(entry["command"])
    (stamps / "compile_commands.json").write_text(json.dumps(commands))
    ours = [entry for entry in commands
            if pathlib.Path(entry["file"]).is_relative_to(ROOT / "src")
            or pathlib.Path(entry["file"]).is_relative_to(ROOT / "apps")]
    if not ours:
        sys.exit("tidy: no sources of src/ or apps/ in " + str(build))
    times = changes()
    since = landed() if options.changed else None
    if since is not None:
        times = changed_since(since, times)
        ours = [entry for entry in ours if changed(pathlib.Path(entry["file"]), times) > 0]
    ours.sort(key=lambda entry: changed(pathlib.Path(entry["file"]), times), reverse=True)
    rules = output_of("clang-tidy", "--version") + (ROOT / ".clang-tidy").read_bytes()
    checked = 0
    bad = 0

    def check_in_time(entry):
        return check(entry, rules, stamps) if time.monotonic() < until else "late"

    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        for findings in pool.map(check_in_time, ours):
            if findings == "late":
                continue
            checked += 1
            if findings is not None:
                bad += 1
                print(findings, flush=True)
    print(f"clang-tidy: checked {checked} of {len(ours)} files, those changed last")
    if bad:
        sys.exit(f"clang-tidy: findings in {bad} files")


if __name__ == "__main__":
    main()
