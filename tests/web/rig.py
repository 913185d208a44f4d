"""Processes of a robot and of tfdude-web, in a DDS domain that no other test uses, on this computer only."""

import asyncio
import json
import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from domain_lease import lease_domain  # noqa: E402

BIN = pathlib.Path(os.environ.get("TFDUDE_BIN", ROOT / "build/release/bin"))
WAIT = 30  # [s], more than a busy machine needs


def skip(why):
    """Ends the test as skipped, for ctest."""
    print("SKIPPED: " + why)
    sys.exit(0)


def eventually(condition, what):
    """The first true result of a function."""
    end = time.monotonic() + WAIT
    while True:
        result = condition()
        if result:
            return result
        if time.monotonic() > end:
            raise AssertionError("not in time: " + what)
        time.sleep(0.05)


class Rig:
    """The arm on a mobile base, of two daemons, and the server; use it as a context."""

    def __init__(self, *web_options):
        self.domain, self.claim = lease_domain()
        self.environment = dict(os.environ, TFDUDE_PROFILE="local", TFDUDE_DOMAIN=str(self.domain))
        self.environment.pop("TFDUDE_KEYS", None)
        self.running = []
        self.web_options = web_options

    def __enter__(self):
        try:
            self.base = self.start("tfduded", "--config", ROOT / "examples/arm/base.yaml", "--no-state", ready="ready")
            self.arm = self.start("tfduded", "--config", ROOT / "examples/arm/arm.yaml", "--no-state", ready="ready")
            self.web = self.start("tfdude", "web", "--port", "0", *self.web_options, ready="open ")
            self.url = self.web.first_line.split()[1]
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for process in self.running:
            process.kill()
        for process in self.running:
            process.wait()
            process.stdout.close()
        self.claim.close()

    def start(self, program, *arguments, ready=None):
        process = subprocess.Popen([BIN / program, *map(str, arguments)], env=self.environment, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.running.append(process)
        if ready:
            process.first_line = process.stdout.readline()
            assert process.first_line.startswith(ready), (program, process.first_line)
        return process

    def move(self, seconds=600):
        """Drives the arm at 1 kHz."""
        return self.start("arm_controller", "--seconds", seconds)

    def record(self, file, seconds):
        """Records so much, of the time of the robot."""
        recorder = self.start("tfdude", "record", file)

        def enough():
            said = self.ask("info", file) if file.exists() else {}
            return said.get("end_ns") is not None and said["end_ns"] - said["start_ns"] > seconds * 10**9

        eventually(enough, "some seconds of a recording")
        recorder.send_signal(signal.SIGINT)
        recorder.wait(timeout=WAIT)

    def ask(self, *arguments):
        """The answer of the command line."""
        done = subprocess.run([BIN / "tfdude", "--json", "--timeout", "20000", *map(str, arguments)],
                              env=self.environment, text=True, capture_output=True, timeout=60, check=False)
        return json.loads(done.stdout)


class RigTest(unittest.TestCase):
    """Its tests share one robot."""

    @classmethod
    def setUpClass(cls):
        cls.robot = Rig().__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.robot.__exit__()

    def run_async(self, coroutine):
        return asyncio.run(asyncio.wait_for(coroutine, 2 * WAIT))
