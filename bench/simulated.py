#!/usr/bin/env python3
"""Computes what each participant of a large system sends and receives, in simulated time; run by scripts/scaling
--simulated.

  simulated.py [--bin DIR] [--sizes PARTITIONS:FRAMES,...]

For each size it prints a line of JSON with the messages and bytes of one participant, the mean of all and the greatest:
when all start at once, per second while all are idle, for each change of each kind, and when one more owner starts.
1,000 partitions with 10,000 frames take several minutes and 5 GB of memory.
"""

import argparse
import pathlib
import subprocess

import processes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--simulated", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--bin", type=pathlib.Path, default=processes.ROOT / "build/release/bin")
    parser.add_argument("--sizes", default="10:10000,100:10000,1000:10000,100:100000")
    arguments = parser.parse_args()
    for size in arguments.sizes.split(","):
        subprocess.run([arguments.bin / "simulated_scale", *size.split(":")], check=True)


if __name__ == "__main__":
    main()
