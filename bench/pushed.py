"""Paths that are pushed to watchers: latency compared with bare DDS, and bytes compared with tf2's broadcast.

Keys: pushed/latency/... and pushed/latest are defined by bench/net/push_bench.cpp. The others are counted in captures
of a robot with 30 joints: pushed/WHAT/WHO/RATE/WATCHERS, where WHO is edges (all joints' edges are watched), composed
(the path from base to tip as one transform) or tf2 (bare DDS samples of the size of tf2's message), and WHAT is
    payload   CDR bytes of DDS samples per second
    udp       bytes of all UDP packets, with acknowledgements and the watchers' renewals, per second
    samples   DDS samples sent to each watcher per second
pushed/message/tf2 is the computed size of a tf2_msgs/TFMessage of all joints.
"""

import time

import figures
import net_stage
import processes
import rtps
import wire

JOINTS = 30
RATES = (100, 1000)
WATCHERS = (1, 10)
OURS = {"tfdude/state", "tfdude/request", "tfdude/reply"}
BARE = {"floor/ping"}
SAMPLES = {"tfdude/state", "floor/ping"}
QUIET_S = 0.5  # pause after discovery
KEPT = 1500  # bytes of each packet in the capture; messages of discovery are shorter


def robot_links():
    """(parent, child) of a robot's 30 joints, with names as in common robot descriptions."""
    arm = ("shoulder_pan", "shoulder_lift", "upper_arm_roll", "elbow_flex", "forearm_roll", "wrist_flex", "wrist_roll")
    leg = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
    limbs = [("", "base_link", ("torso_lift", "torso_yaw")), ("", "torso_yaw_link", ("head_pan", "head_tilt"))]
    for side in ("left_", "right_"):
        limbs += [(side, "torso_yaw_link", arm), (side, "base_link", leg)]
    links = []
    for side, parent, joints in limbs:
        for joint in joints:
            child = f"{side}{joint}_link"
            links.append((parent, child))
            parent = child
    return links


def tf2_message_bytes():
    """The size of a tf2_msgs/TFMessage with all joints in one DDS sample, as ROS 2 serializes it: CDR with its header
    of four bytes, and a sequence of geometry_msgs/TransformStamped, each with a stamp (8 bytes), two strings, and
    seven doubles."""
    def aligned(at, to):
        return -(-at // to) * to

    at = 4  # after the sequence's length
    for parent, child in robot_links():
        at = aligned(at, 4) + 8
        for name in (parent, child):
            at = aligned(at, 4) + 4 + len(name) + 1
        at = aligned(at, 8) + 7 * 8
    return 4 + at


def latency(stage, quick):
    """The owner has one core, the watcher has the other."""
    common = ["--domain", stage.domain("pushed"), "--profile", stage.profile]
    seconds, calls = (2, 1000) if quick else (10, 20000)
    with stage.servers([stage.command("0", "push_bench", ["--mode", "own", *common])]):
        yield from stage.measured(
            stage.command("1", "push_bench", ["--mode", "watch", *common, "--seconds", seconds,
                                              "--calls", calls, "--repetitions", 5]),
            60 if quick else 200)


def counted(file, topics, watchers, begin_ns, end_ns):
    """{what: rate per second} of the packets of these topics."""
    counts = dict.fromkeys(("payload", "udp", "samples"), 0)
    capture = rtps.Capture(file)
    for packet in capture.between(begin_ns, end_ns):
        topic = capture.topic(packet)
        if topic not in topics:
            continue
        counts["udp"] += packet.udp_bytes
        if topic in SAMPLES and rtps.DATA in packet.kinds:
            counts["payload"] += packet.payload_bytes
            counts["samples"] += 1 / watchers
    return {what: count * 1e9 / (end_ns - begin_ns) for what, count in counts.items()}


def bytes_of(stage, who, rate, watchers, seconds):
    """Captures one case."""
    domain = stage.domain("pushed")
    common = ["--domain", domain, "--profile", stage.profile]
    if who == "tf2":
        source = ["--mode", "send", "--bytes", tf2_message_bytes()]
        sink = ["--mode", "listen"]
    else:
        source = ["--mode", "own", "--joints", JOINTS]
        sink = ["--mode", "watch", "--joints", JOINTS, "--composed", int(who == "composed")]
    file = stage.work / "pushed.pcap"
    with wire.capturing(file, domain, KEPT):
        with stage.servers([stage.command("0", "push_load", [*source, "--rate", rate, *common])]):
            with stage.servers([stage.command("1", "push_load", [*sink, "--watchers", watchers, *common])]):
                time.sleep(QUIET_S)
                begin = time.time_ns()
                time.sleep(seconds)
                end = time.time_ns()
    for what, value in counted(file, BARE if who == "tf2" else OURS, watchers, begin, end).items():
        yield figures.summary(f"pushed/{what}/{who}/{rate}/{watchers}", "1/s" if what == "samples" else "bytes/s",
                              [value])
    file.unlink()


def run(quick, bin_dir, work):
    """Yields the figures."""
    if not (bin_dir / "push_bench").exists():
        raise processes.Skipped("push_bench is not built")
    stage = net_stage.Stage(bin_dir, work)
    yield from latency(stage, quick)
    yield figures.summary("pushed/message/tf2", "bytes", [tf2_message_bytes()])
    for rate in RATES:
        for watchers in WATCHERS:
            for who in ("edges", "composed", "tf2"):
                yield from bytes_of(stage, who, rate, watchers, 1 if quick else 3)
