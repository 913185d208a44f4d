"""The thesis's table 5.1 as a whole: who sends what for each operation, centralized and decentralized.

Keys: wire/table/SYSTEM/HOW/OPERATION/NAME. SYSTEM is the number of partitions: 2 (the thesis's example), 5 or 16. HOW
is centralized (one daemon owns all frames, a client asks), by_owner (the process that owns the frame), or by_other (a
client, beside the owners). NAME is as in wire.py; other_udp has the changes of the structure, which are sent to all
participants, and the acknowledgements. wire/table/SYSTEM/WHERE/idle/udp_per_second is what discovery and presence send
while nothing happens; WHERE is centralized or decentralized.
"""

import contextlib
import time

import figures
import net_stage
import processes
import rtps
import wire

SYSTEMS = (2, 5, 16)
ROUNDS = 2
IDLE_S = 1.5
# Ids of ten characters. The last partition owns `grip_plate`.
OPERATIONS = {
    "add": "add tool_mount grip_plate",
    "remove": "remove tool_mount",
    "lookup": "lookup {top} grip_plate",
    "update": "update grip_plate",
    "publish": "publish grip_plate",
}
NAMES = ("request_payload", "reply_payload", "request_udp", "reply_udp", "other_udp", "total_udp", "packets")


def chain(work, partitions):
    """The configurations of so many partitions with two frames each, below each other."""
    for number in range(1, partitions + 1):
        parent = f"    parent: link_{number - 1:02}_bb\n" if number > 1 else ""
        config = work / f"part_{number:02}.yaml"
        config.write_text(f"partition: part_{number:02}\nframes:\n  - id: link_{number:02}_aa\n{parent}"
                          f"  - id: link_{number:02}_bb\n    parent: link_{number:02}_aa\n", encoding="utf-8")
        yield config


def system(work, partitions):
    """(configurations, the last frame of the last one, the frame above it)"""
    if partitions == 2:
        return [processes.ROOT / "examples" / "thesis" / f"{name}.yaml" for name in wire.THESIS_CONFIGS], \
            "hand_left", "arm_left"
    configs = list(chain(work, partitions))
    return configs, f"link_{partitions:02}_bb", f"link_{partitions:02}_aa"


def perform(client, top, begins):
    """Performs each operation ROUNDS times, and once before."""
    for turn in range(ROUNDS + 1):
        for name, operation in OPERATIONS.items():
            begin = client.perform(operation.format(top=top))
            if turn > 0:
                begins.setdefault(name, []).append(begin)


def measure(bin_dir, work, partitions, centralized):
    """Yields the figures of one system."""
    configs, last, top = system(work, partitions)
    where = "centralized" if centralized else "decentralized"
    file = work / f"table_{partitions}_{where}.pcap"
    domain, _lease = processes.lease_domain()
    served = [net_stage.merged(work, configs)] if centralized else configs[:-1]
    begins = {}
    with contextlib.ExitStack() as running:
        running.enter_context(wire.capturing(file, domain))
        running.enter_context(processes.daemons(bin_dir, served, domain, work))
        if not centralized:
            owner = running.enter_context(wire.client_of(bin_dir, domain, work, configs[-1]))
        client = running.enter_context(wire.client_of(bin_dir, domain, work))
        client.wait_until_met(f"lookup {top} {last}")
        client.perform(f"add grip_plate {last}")
        perform(client, top, begins.setdefault("centralized" if centralized else "by_other", {}))
        if not centralized:
            owner.wait_until_met("lookup " + top + " grip_plate")
            perform(owner, top, begins.setdefault("by_owner", {}))
        idle_begin = time.time_ns()
        time.sleep(IDLE_S)
    capture = rtps.Capture(file)
    for how, operations in begins.items():
        for name, when in operations.items():
            yield from wire.figures_of(capture, f"table/{partitions}/{how}/{name}", when, NAMES)
    idle = sum(packet.udp_bytes for packet in capture.between(idle_begin, idle_begin + int(IDLE_S * 1e9))
               if capture.is_of_participant(packet))
    yield figures.summary(f"wire/table/{partitions}/{where}/idle/udp_per_second", "bytes", [idle / IDLE_S])


def run(bin_dir, work):
    """Yields the figures of all systems."""
    for partitions in SYSTEMS:
        for centralized in (True, False):
            yield from measure(bin_dir, work, partitions, centralized)
