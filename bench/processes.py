"""Starts programs for a stage, waits for them, and ends them."""

import contextlib
import pathlib
import select
import signal
import socket
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROFILE = ROOT / "profiles" / "loopback.xml"
DOMAINS = range(140, 172)
PATIENCE_S = 40  # time for a program to start or to answer


class Skipped(Exception):
    """The reason why a stage cannot run here."""


def lease_domain():
    """Reserves a DDS domain that no other benchmark or test uses. Returns it with the socket that holds it: the
    socket's name in the kernel is the reservation, as in tests/support/domain_lease.cpp."""
    for domain in DOMAINS:
        lease = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lease.bind(f"\0tfdude-test-domain-{domain}")
            return domain, lease
        except OSError:
            lease.close()
    raise RuntimeError("all DDS domains for benchmarks are taken")


def end(process, how=signal.SIGTERM):
    """Ends a program: by the signal, or after PATIENCE_S by SIGKILL."""
    if process.poll() is None:
        process.send_signal(how)
        try:
            process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def await_line(stream, what):
    """The next line of an unbuffered pipe, or an error if it does not come in time."""
    deadline = time.monotonic() + PATIENCE_S
    line = b""
    while not line.endswith(b"\n"):
        if not select.select([stream], [], [], max(deadline - time.monotonic(), 0))[0]:
            raise RuntimeError(f"{what}: no answer within {PATIENCE_S} s")
        read = stream.read(1)
        if not read:
            raise RuntimeError(f"{what} has ended")
        line += read
    return line.decode().rstrip()


@contextlib.contextmanager
def running(commands):
    """Starts programs one after the other; each says in a line that it is ready. Yields the processes."""
    started = []
    try:
        for command in commands:
            started.append(subprocess.Popen([str(part) for part in command], stdin=subprocess.PIPE,
                                            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0))
        for process in started:
            await_line(process.stdout, process.args[0])
        yield started
    finally:
        for process in started:
            end(process)


@contextlib.contextmanager
def daemons(bin_dir, configs, domain, logs, options=("--profile", PROFILE)):
    """Runs a tfduded for each configuration file until the block is left."""
    running = []
    try:
        for config in configs:
            with open(pathlib.Path(logs) / f"{pathlib.Path(config).stem}.log", "wb") as log:
                running.append(subprocess.Popen(
                    [bin_dir / "tfduded", "--no-state", "--config", config, "--domain", str(domain),
                     *options], stdout=subprocess.PIPE, stderr=log, bufsize=0))
        for process, config in zip(running, configs):
            line = await_line(process.stdout, f"tfduded --config {config}")
            if not line.startswith("ready"):
                raise RuntimeError(f"tfduded --config {config} said: {line}")
        yield running
    finally:
        for process in running:
            end(process)


def output_of(command, timeout, **more):
    """The output of a program. Raises an error if the program fails or takes longer than `timeout` [s]."""
    run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                         timeout=timeout, check=False, **more)
    if run.returncode != 0:
        raise RuntimeError(f"{pathlib.Path(command[0]).name} ended with {run.returncode}: "
                           + run.stderr[-2000:])
    return run.stdout
