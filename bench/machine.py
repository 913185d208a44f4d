"""Describes the machine on which the figures are measured."""

import datetime
import os
import pathlib
import platform
import re
import subprocess
import time

import processes


def _first(pattern, text, otherwise="unknown"):
    found = re.search(pattern, text, re.MULTILINE)
    return found.group(1).strip() if found else otherwise


def _said(*command):
    try:
        return processes.output_of(command, 30, cwd=processes.ROOT).strip()
    except (OSError, RuntimeError, subprocess.SubprocessError):
        return ""


def _package(*names):
    """Name and version of the first of these Debian packages that is installed."""
    for name in names:
        version = _said("dpkg-query", "-W", "-f", "${Version}", name)
        if version:
            return f"{name} {version}"
    return "unknown"


def _commit():
    commit = _said("git", "rev-parse", "--short=12", "HEAD") or "unknown"
    # Changes of the results do not change the measured programs.
    changed = _said("git", "status", "--porcelain", "--", ":!bench/results", ":!bench/REPORT.md")
    return commit + (" with changes not committed" if changed else "")


def _read(path):
    try:
        return pathlib.Path(path).read_text(encoding="utf-8")
    except OSError:
        return ""


def _processor_times():
    """(all, idle) in ticks since the system started; waiting for a disk counts as idle."""
    fields = [int(word) for word in _read("/proc/stat").split("\n")[0].split()[1:9]]
    return sum(fields), fields[3] + fields[4]


def busy(seconds=3):
    """The load by other processes [% of all processors]. The load average would also show the build before."""
    try:
        begin, idle_begin = _processor_times()
        time.sleep(seconds)
        end, idle_end = _processor_times()
        return round(100 * (1 - (idle_end - idle_begin) / (end - begin)), 1)
    except (IndexError, ValueError, ZeroDivisionError):
        return None


def _processor(flags):
    """Its name, which virtual machines make vague, and its generation: the ratios depend on it."""
    name = _first(r"^model name\s*:\s*(.+)$", flags, platform.processor() or "unknown")
    family, model = (_first(rf"^{key}\s*:\s*(\d+)$", flags, "") for key in ("cpu family", "model"))
    return f"{name}, family {family}, model {model}" if family and model else name


def description(build_dir):
    """Properties of the machine and the build, by name."""
    cache = _read(pathlib.Path(build_dir) / "CMakeCache.txt")
    compiler = _first(r"^CMAKE_CXX_COMPILER:[A-Z]+=(.+)$", cache, "c++")
    flags = _read("/proc/cpuinfo")
    return {
        "cpu": _processor(flags),
        "vector instructions": " ".join(name for name in ("avx2", "fma", "avx512f")
                                        if re.search(rf"\b{name}\b", flags)) or "unknown",
        "cores": os.cpu_count(),
        "kernel": platform.release(),
        "distribution": _first(r'^PRETTY_NAME="?([^"\n]+)', _read("/etc/os-release")),
        "compiler": _said(compiler, "--version").split("\n")[0] or "unknown",
        "build type": _first(r"^CMAKE_BUILD_TYPE:STRING=(.+)$", cache),
        "fastdds": _package("libfastrtps2.9", "libfastdds3.1", "libfastrtps-dev", "libfastdds-dev"),
        "tf2": _package("libtf2-2d", "libtf2-dev"),
        "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        "commit": _commit(),
        "load before": [round(load, 2) for load in os.getloadavg()],
        "busy before [%]": busy(),
    }
