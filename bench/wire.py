"""The traffic of each operation, counted in a capture: the thesis's table 5.1, measured.

Keys: wire/OPERATION/PART_LAYER [bytes], wire/OPERATION/packets, and wire/OPERATION/vendor_rtps: the bytes that Fast DDS
adds to messages for its statistics, if it was built with them (Debian's is). PART is request, reply, or other. Other
means changes of the structure after a frame was added or removed, and DDS's acknowledgements. LAYER is payload (CDR
with its header of four bytes), rtps (the message) or udp (with IP and UDP headers).
wire/full_page/OPERATION has the same of a partition of 60 frames.
wire/lookup_over_N_partitions/total_udp is the whole traffic of a lookup with six partitions in the domain;
wire/idle/udp_per_second is that of discovery and presence while two daemons and a client do nothing.
"""

import contextlib
import pathlib
import signal
import subprocess
import time

import figures
import processes
import rtps

PAUSE_S = 0.2  # after an operation: time for several of DDS's heartbeats and acknowledgements
FLUSH_S = 1.5  # the kernel passes packets to a capture in blocks, up to a second late
IDLE_S = 2.0
PARTITIONS = 6
FULL_PAGE = 60  # frames, with the one that is added
PATHS = (1, 2, 4)  # partitions on the path
THESIS_CONFIGS = ("robot", "arms")

# The ids have ten characters, as the thesis assumed.
SETUP = "add grip_plate hand_left"
OPERATIONS = {
    "add": "add tool_mount grip_plate",
    "update": "update tool_mount",
    "publish": "publish tool_mount",
    "lookup_other": "lookup grip_plate tool_mount",
    "lookup_across": "lookup world tool_mount",
    "remove": "remove tool_mount",
}


class WireClient:
    """The client that performs operations one at a time (wire/wire_client.cpp); with a configuration, the owner of its
    partition."""

    def __init__(self, bin_dir, domain, log, config=None):
        self._process = subprocess.Popen(
            [bin_dir / "wire_client", str(domain), processes.PROFILE, *([config] if config else [])],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, bufsize=0)

    def perform(self, operation):
        """Performs an operation. Returns the time of its start, in nanoseconds of the system clock."""
        self._process.stdin.write(f"{operation}\n".encode())
        answer = processes.await_line(self._process.stdout, "wire_client")
        time.sleep(PAUSE_S)
        if not answer.endswith("done"):
            raise RuntimeError(f"{operation}: {answer}")
        return int(answer.split()[0])

    def wait_until_met(self, lookup):
        """Waits until discovery is complete, which takes longer on a busy machine."""
        deadline = time.monotonic() + processes.PATIENCE_S
        while True:
            try:
                self.perform(lookup)
                return
            except RuntimeError:
                if time.monotonic() > deadline:
                    raise

    def close(self):
        """Ends the client; it leaves the domain in order."""
        self._process.stdin.close()
        processes.end(self._process)


@contextlib.contextmanager
def client_of(bin_dir, domain, work, config=None):
    """Runs a client until the block is left, or the owner of the partition of a configuration."""
    with open(work / ("wire_owner.log" if config else "wire_client.log"), "wb") as log:
        client = WireClient(bin_dir, domain, log, config)
    try:
        yield client
    finally:
        client.close()


@contextlib.contextmanager
def capturing(file, domain, kept=0):
    """Captures a domain's packets until the block is left: `kept` bytes of each packet, or all if zero."""
    first = 7400 + 250 * domain  # RTPS 2.2, section 9.6.1.1
    # Presence has separate sockets, with ports from the dynamic range.
    ports = f"udp and (dst portrange {first}-{first + 249} or dst portrange 49152-65535)"
    try:
        process = subprocess.Popen(
            ["tcpdump", "-i", "lo", "-w", file, "-U", "-Z", "root", "-B", "16384", "-s", str(kept), ports],
            stderr=subprocess.PIPE, bufsize=0)
    except FileNotFoundError as error:
        raise processes.Skipped("tcpdump is not installed") from error
    try:
        said = []
        while not said or "listening on" not in said[-1]:
            try:
                said.append(processes.await_line(process.stderr, "tcpdump"))
            except RuntimeError as error:
                raise processes.Skipped("capturing is not permitted: " + " ".join(said)) from error
        yield
        time.sleep(FLUSH_S)
    finally:
        processes.end(process, signal.SIGINT)
    summary = process.stderr.read().decode()
    if "\n0 packets dropped by kernel" not in summary:
        raise RuntimeError(f"the capture is not complete: {summary}")


def is_sign_of_life(topic, packet):
    """Whether a packet asks for a sign of life, or gives it. That happens 100 ms after an operation and later."""
    body = {"tfdude/request": (28, 17), "tfdude/reply": (24, 10)}  # where its case is, in bytes, and which one
    if topic not in body or not packet.payloads:
        return False
    at, case = body[topic]
    payload = packet.payloads[0]
    is_of_no_frame = topic == "tfdude/reply" or payload[4:9] == b"\1\0\0\0\0"
    return is_of_no_frame and len(payload) > at and payload[at] == case


def part_of(capture, packet):
    """request, reply or other; None for packets that are also sent without an operation."""
    topic = capture.topic(packet)
    if topic is None or not topic.startswith("tfdude/") or topic == "tfdude/presence":
        return None
    if is_sign_of_life(topic, packet):
        return None
    if rtps.DATA in packet.kinds or rtps.DATA_FRAG in packet.kinds:
        if topic in ("tfdude/request", "tfdude/change", "tfdude/update", "tfdude/joint"):
            return "request"
        if topic == "tfdude/reply":
            return "reply"
    return "other"


def count(capture, begin_ns):
    """Counts the packets of one operation: {name: number}."""
    counts = {f"{part}_{layer}": 0 for part in ("request", "reply", "other")
              for layer in ("payload", "rtps", "udp")}
    counts.update(packets=0, total_udp=0, vendor_rtps=0)
    for packet in capture.between(begin_ns, begin_ns + int(PAUSE_S * 1e9)):
        part = part_of(capture, packet)
        if part is None:
            continue
        counts[f"{part}_payload"] += packet.payload_bytes
        counts[f"{part}_rtps"] += packet.rtps_bytes
        counts[f"{part}_udp"] += packet.udp_bytes
        counts["total_udp"] += packet.udp_bytes
        counts["vendor_rtps"] += packet.vendor_bytes
        counts["packets"] += 1
    return counts


def figures_of(capture, operation, begins, names=None):
    """The figures of an operation that was performed at each time in `begins`."""
    counted = [count(capture, begin) for begin in begins]
    for name in names or counted[0]:
        unit = "packets" if name == "packets" else "bytes"
        yield figures.summary(f"wire/{operation}/{name}", unit, [one[name] for one in counted])


def joint_config(work):
    """A daemon's configuration: one link that a joint moves."""
    limits = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    (work / "joint.urdf").write_text(
        '<robot name="wire"><link name="fixed_link"/><link name="moved_link"/>'
        '<joint name="tool_joint" type="revolute"><parent link="fixed_link"/>'
        f'<child link="moved_link"/><axis xyz="0 0 1"/>{limits}</joint></robot>', encoding="utf-8")
    config = work / "joint.yaml"
    config.write_text("partition: joint\nurdf:\n  - file: joint.urdf\n", encoding="utf-8")
    return config


def measure_operations(bin_dir, work, rounds):
    """Table 5.1 on the thesis's tree, by a client that owns no frames."""
    file = work / "operations.pcap"
    domain, _lease = processes.lease_domain()
    configs = [processes.ROOT / "examples" / "thesis" / f"{name}.yaml" for name in THESIS_CONFIGS]
    begins = {name: [] for name in OPERATIONS}
    with capturing(file, domain), processes.daemons(bin_dir, configs, domain, work):
        with client_of(bin_dir, domain, work) as client:
            client.wait_until_met("lookup world hand_left")
            client.perform(SETUP)
            for turn in range(rounds + 1):
                for name, operation in OPERATIONS.items():
                    begin = client.perform(operation)
                    if turn > 0:  # the first turn also creates writers
                        begins[name].append(begin)
            idle_begin = time.time_ns()
            time.sleep(IDLE_S)
    capture = rtps.Capture(file)
    for name, when in begins.items():
        yield from figures_of(capture, name, when)
    idle = [packet for packet in capture.between(idle_begin, idle_begin + int(IDLE_S * 1e9))
            if capture.is_of_participant(packet)]
    total = sum(packet.udp_bytes for packet in idle)
    yield figures.summary("wire/idle/udp_per_second", "bytes", [total / IDLE_S])


def measure_joint(bin_dir, work, rounds):
    """The position of one joint, to compare with the edge that `publish` sends."""
    file = work / "joint.pcap"
    domain, _lease = processes.lease_domain()
    begins = []
    with capturing(file, domain), processes.daemons(bin_dir, [joint_config(work)], domain, work):
        with client_of(bin_dir, domain, work) as client:
            client.wait_until_met("lookup fixed_link moved_link")
            for turn in range(rounds + 1):
                begin = client.perform("joint tool_joint")
                if turn > 0:
                    begins.append(begin)
    yield from figures_of(rtps.Capture(file), "publish_joint", begins)


def measure_full_page(bin_dir, work, rounds):
    """An owner of 60 frames: what the structure's changes cost. Such a partition has the smallest pages."""
    file = work / "full_page.pcap"
    domain, _lease = processes.lease_domain()
    config = work / "full_page.yaml"
    config.write_text("partition: full_page\nframes:\n  - id: frame_base\n" + "".join(
        f"  - id: frame_{number:04}\n    parent: frame_base\n" for number in range(1, FULL_PAGE - 1)),
                      encoding="utf-8")
    other = processes.ROOT / "examples" / "thesis" / "robot.yaml"
    operations = {"add": "add tool_mount frame_0001", "remove": "remove tool_mount"}
    begins = {name: [] for name in operations}
    with capturing(file, domain), processes.daemons(bin_dir, [config, other], domain, work):
        with client_of(bin_dir, domain, work) as client:
            client.wait_until_met("lookup frame_base frame_0001")
            for turn in range(rounds + 1):
                for name, operation in operations.items():
                    begin = client.perform(operation)
                    if turn > 0:
                        begins[name].append(begin)
    capture = rtps.Capture(file)
    for name, when in begins.items():
        yield from figures_of(capture, f"full_page/{name}", when)


def chain_configs(work):
    """The configurations of six daemons; the parent of each partition's first frame is in the partition before."""
    for number in range(1, PARTITIONS + 1):
        parent = f"    parent: link_{number - 1}_b\n" if number > 1 else ""
        config = work / f"chain_{number}.yaml"
        config.write_text(f"partition: chain_{number}\nframes:\n  - id: link_{number}_a\n{parent}"
                          f"  - id: link_{number}_b\n    parent: link_{number}_a\n",
                          encoding="utf-8")
        yield config


def measure_chain(bin_dir, work, rounds):
    """A lookup over some of six partitions: those that are not on the path should cost nothing."""
    file = work / "chain.pcap"
    domain, _lease = processes.lease_domain()
    begins = {over: [] for over in PATHS}
    configs = list(chain_configs(work))
    with capturing(file, domain), processes.daemons(bin_dir, configs, domain, work):
        with client_of(bin_dir, domain, work) as client:
            client.wait_until_met(f"lookup link_1_a link_{PARTITIONS}_b")
            for turn in range(rounds + 1):
                for over, when in begins.items():
                    begin = client.perform(f"lookup link_1_a link_{over}_b")
                    if turn > 0:
                        when.append(begin)
    capture = rtps.Capture(file)
    for over, when in begins.items():
        yield from figures_of(capture, f"lookup_over_{over}_partitions", when,
                              ("total_udp", "packets"))


def run(quick, bin_dir, work):
    """Yields the figures."""
    bin_dir, work = pathlib.Path(bin_dir), pathlib.Path(work)
    if not (bin_dir / "wire_client").exists():
        raise processes.Skipped("wire_client is not built")
    rounds = 5 if quick else 20
    yield from measure_operations(bin_dir, work, rounds)
    yield from measure_joint(bin_dir, work, rounds)
    yield from measure_chain(bin_dir, work, rounds)
    yield from measure_full_page(bin_dir, work, rounds)
