#!/usr/bin/env python3
"""Measures tfdude-web: 1,000 frames of which some move, seen by some pages at 30 Hz. Prints the server's and the
owner's shares of a core, and the bytes that each page gets. Needs build/release with the benchmarks, scripts/build
--bench web_load, and Debian's python3-websockets."""

import argparse
import asyncio
import os
import pathlib
import subprocess
import sys
import time

import websockets

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import usage  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
FRAMES = 1000


async def count(url, seconds, results):
    async with websockets.connect(url, subprotocols=["tfdude.v1"], max_size=None, compression=None) as socket:
        end = time.monotonic() + 3
        while time.monotonic() < end:  # the structure, and the first values
            await socket.recv()
        total = pictures = 0
        begin = time.monotonic()
        while time.monotonic() < begin + seconds:
            message = await socket.recv()
            total += len(message)
            pictures += isinstance(message, bytes) and message[0] == 1
        spent = time.monotonic() - begin
        results.append((total / spent, pictures / spent))


async def measure(url, pages, seconds, web, owner):
    results = []
    tasks = [asyncio.create_task(count(url, seconds, results)) for _ in range(pages)]
    await asyncio.sleep(3)
    before, begin = (usage.seconds_of(web.pid), usage.seconds_of(owner.pid)), time.monotonic()
    await asyncio.sleep(seconds - 1)
    after, spent = (usage.seconds_of(web.pid), usage.seconds_of(owner.pid)), time.monotonic() - begin
    await asyncio.gather(*tasks)
    return [(b - a) / spent for a, b in zip(before, after)], results


def run(programs, environment, moving, pages, seconds):
    running = []

    def start(command, ready):
        process = subprocess.Popen(command, env=environment, text=True, stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL)
        running.append(process)
        line = process.stdout.readline()
        assert line.startswith(ready), line
        return process, line

    try:
        owner, _ = start([programs.load, "--frames", str(FRAMES), "--moving", str(moving), "--rate", "100"], "ready")
        web, line = start([programs.web, "--port", "0"], "open ")
        url = line.split()[1].replace("http", "ws")
        shares, results = asyncio.run(measure(url, pages, seconds, web, owner))
        rates = [rate / 1000 for rate, _ in results]
        print(f"{moving:5} of {FRAMES} move, {pages:2} pages: server {100 * shares[0]:5.1f} % of a core, owner "
              f"{100 * shares[1]:5.1f} %, {sum(rates) / len(rates):6.1f} kB/s a page, "
              f"{min(pictures for _, pictures in results):4.1f} pictures/s", flush=True)
    finally:
        for process in running:
            process.kill()
            process.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--load", default=ROOT / "build/release/bin/web_load")
    parser.add_argument("--web", default=ROOT / "build/release/bin/tfdude-web")
    programs = parser.parse_args()
    environment = dict(os.environ, TFDUDE_PROFILE="local", TFDUDE_DOMAIN="47")
    for moving, pages in ((0, 1), (50, 1), (1000, 1), (1000, 10)):
        run(programs, environment, moving, pages, programs.seconds)


if __name__ == "__main__":
    main()
