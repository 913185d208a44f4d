"""The thesis's cases over a narrow link: 1 Mbit/s and 20 ms in each direction.

The partition `robot` asks from its host. The other host runs the daemon of the arms, and the central server. Hosts are
network namespaces, so this needs root. This program carries their packets: each direction sends one packet at a time
at the rate of the link, and drops what would wait too long, as a real link does.

Keys: narrow/CASE/robot/centralized and decentralized [us], and narrow/idle/KIND_per_second of what crosses the link
while nobody asks [bytes, packets].
"""

import contextlib
import fcntl
import heapq
import os
import pathlib
import select
import struct
import subprocess
import threading
import time

import figures
import net_stage
import processes

BYTES_PER_S = 1e6 / 8
DELAY_S = 0.02
LONGEST_WAIT_S = 0.5
IDLE_S = 4
SUBNET = "10.77.0"


def _tap(name):
    """A network device whose packets this program reads and writes."""
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    tap, without_header, set_device = 0x0002, 0x1000, 0x400454ca
    fcntl.ioctl(device, set_device, struct.pack("16sH", name.encode(), tap | without_header))
    return device


class Link:
    """Carries packets between two devices until it is closed."""

    def __init__(self, ends):
        self._ends = ends
        self._free_at = [0.0, 0.0]  # when each direction has sent all before
        self._flying = []           # (arrival, number, end, packet)
        self.packets = self.bytes = 0
        self._open = True
        self._thread = threading.Thread(target=self._carry)
        self._thread.start()

    def _carry(self):
        while self._open:
            wait = self._flying[0][0] - time.monotonic() if self._flying else 0.1
            for device in select.select(self._ends, [], [], min(max(wait, 0), 0.1))[0]:
                self._accept(self._ends.index(device))
            while self._flying and self._flying[0][0] <= time.monotonic():
                _, _, end, packet = heapq.heappop(self._flying)
                os.write(self._ends[end], packet)

    def _accept(self, end):
        packet = os.read(self._ends[end], 65536)
        now = time.monotonic()
        begin = max(now, self._free_at[end])
        if begin - now > LONGEST_WAIT_S:
            return
        self.packets += 1
        self.bytes += len(packet)
        self._free_at[end] = begin + len(packet) / BYTES_PER_S
        heapq.heappush(self._flying, (self._free_at[end] + DELAY_S, self.packets, 1 - end, packet))

    def close(self):
        """Stops carrying."""
        self._open = False
        self._thread.join()


def _ip(*arguments):
    subprocess.run(["ip", *arguments], check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@contextlib.contextmanager
def hosts():
    """Two hosts and the link between them: yields it with the commands that run a program on each."""
    names = [f"tfdude-narrow-{os.getpid()}-{end}" for end in (1, 2)]
    with contextlib.ExitStack() as made:
        devices = []
        try:
            for end, name in enumerate(names, 1):
                _ip("netns", "add", name)
                made.callback(_ip, "netns", "delete", name)
                devices.append(_tap(f"narrow{end}"))
                made.callback(os.close, devices[-1])
                _ip("link", "set", f"narrow{end}", "netns", name)
                _ip("-n", name, "address", "add", f"{SUBNET}.{end}/24", "dev", f"narrow{end}")
                for device in ("lo", f"narrow{end}"):
                    _ip("-n", name, "link", "set", device, "up")
                _ip("-n", name, "route", "add", "239.0.0.0/8", "dev", f"narrow{end}")
        except (OSError, subprocess.CalledProcessError) as error:
            raise processes.Skipped(f"no hosts can be made here: {error}") from error
        link = Link(devices)
        made.callback(link.close)
        yield link, [["ip", "netns", "exec", name] for name in names]


def idle(link):
    """What crosses the link while nobody asks."""
    before = link.bytes, link.packets
    time.sleep(IDLE_S)
    for name, count in (("bytes", link.bytes - before[0]), ("packets", link.packets - before[1])):
        yield figures.summary(f"narrow/idle/{name}_per_second", name, [count / IDLE_S])


def run(quick, bin_dir, work):
    """Yields the figures."""
    stage = net_stage.Stage(bin_dir, pathlib.Path(work), processes.ROOT / "profiles" / "tfdude.xml")
    calls, repetitions = (5, 3) if quick else (40, 3)
    central, decentral = stage.domain("central"), stage.domain("decentral")
    configs = [net_stage.EXAMPLES / f"{name}.yaml" for name in ("robot", "arms")]
    with hosts() as (link, (on_robot, on_arms)):
        daemons = [stage.daemon("1", central, net_stage.merged(stage.work, configs)),
                   stage.daemon("1", decentral, configs[1])]
        with stage.servers([on_arms + daemon for daemon in daemons]):
            yield from idle(link)
            bench = stage.command("0", "thesis_bench", [
                "--as", "robot", "--config", configs[0], "--central", central, "--domain", decentral,
                "--profile", stage.profile, "--calls", calls, "--repetitions", repetitions])
            for figure in stage.measured(on_robot + bench, 400):
                yield {**figure, "key": figure["key"].replace("thesis/", "narrow/")}
