"""What processes and the loopback interface have used so far, read from /proc."""

import os
import pathlib

TICKS = os.sysconf("SC_CLK_TCK")


def loopback():
    """Packets and bytes that the loopback interface has received."""
    for line in pathlib.Path("/proc/net/dev").read_text(encoding="utf-8").splitlines():
        name, _, counts = line.partition(":")
        if name.strip() == "lo":
            return int(counts.split()[1]), int(counts.split()[0])
    raise RuntimeError("no loopback interface")


def status_of(pid, key):
    """A number in a process's status file, in the unit of that file."""
    for line in pathlib.Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith(key + ":"):
            return int(line.split()[1])
    raise RuntimeError(f"process {pid} has no {key}")


def seconds_of(pid):
    """Processor time of a process [s]."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS
