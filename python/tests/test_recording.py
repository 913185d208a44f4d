"""A file of `tfdude record` answers what the live system answered."""

from __future__ import annotations

import os
import signal
import struct
import subprocess

import numpy as np
import pytest
import tfdude
from helpers import eventually

from tfdude import ExtrapolationException, FrameSpec, LookupException, Node, Recording, Transform, TransformException


@pytest.fixture
def recorded(tmp_path, dds_domain):
    """A recording of an edge that moves, and the answers of that time by their instants."""
    file = tmp_path / "arm.mcap"
    frames = [FrameSpec("base"), FrameSpec("hand", "base", Transform((0, 0, 0), covariance="exact"))]
    with Node("arm", frames, domain=dds_domain, profile="local") as arm:
        recorder = subprocess.Popen(
            [os.environ["TFDUDE_CLI"], "--domain", str(dds_domain), "--profile", "local", "record", str(file)],
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            # Samples from before the recorder's watch began are not recorded.
            assert eventually(lambda: is_recorded(file, "hand"), 30)
            now = arm.now()
            answers = {}
            for i in range(100):
                stamp = now + i * 10_000_000
                arm.update("hand", Transform((0.01 * i, 0, 0), covariance=np.eye(6) * 1e-6), stamp)
            for i in range(99):
                middle = now + i * 10_000_000 + 4_000_000
                answers[middle] = arm.lookup("base", "hand", middle)
            arm.add("lamp", "hand", Transform((0, 0, 1)))
            # What was published before the lamp is recorded when the lamp is.
            assert eventually(lambda: is_recorded(file, "lamp"), 30)
        finally:
            recorder.send_signal(signal.SIGINT)
            recorder.communicate(timeout=30)
    return file, answers


def is_recorded(file, frame):
    try:
        return frame in [f.id for f in Recording(str(file)).frames()]
    except TransformException:
        return False


def test_a_recording_answers_as_the_live_system(recorded):
    file, answers = recorded
    recording = Recording(str(file))
    for at, live in answers.items():
        X = recording.lookup("base", "hand", at)
        assert np.allclose(X.matrix, live.matrix, atol=1e-12)
        assert np.allclose(X.covariance, live.covariance, atol=1e-15)
        assert X.stamp == at
    frames = tfdude.FrameSource.of(recording)
    assert np.allclose(frames.lookup("base", "hand", at).matrix, live.matrix, atol=1e-12)
    recording.read_all()
    assert np.allclose(frames.lookup("hand", "lamp").translation, (0, 0, 1))
    assert {frame.id for frame in frames.frames()} == {"base", "hand", "lamp"}
    first = sorted(answers)[50]  # when the recorder had samples
    moved = frames.lookup_full("hand", first, "hand", at, "base").translation
    assert np.allclose(moved, (0.01 * (at - first) / 10_000_000, 0, 0))


def test_a_recording_has_structure_events_and_a_summary(recorded):
    file, answers = recorded
    recording = Recording(str(file))
    summary = recording.summary
    assert summary.finished and not summary.foreign and summary.problems == []
    assert summary.start <= min(answers) + 10**9 and recording.instant <= summary.end
    assert [f.id for f in recording.frames()] == ["base", "hand", "lamp"]
    assert recording.roots() == ["base"] and recording.children("hand") == ["lamp"]
    assert recording.parent("lamp") == "hand"
    assert [p.name for p in recording.partitions()] == ["arm"]
    assert [s.partition for s in recording.path("base", "lamp")] == ["arm"]
    assert recording.joints("arm") == []
    assert recording.history("hand")[0].samples == 100
    assert any(event.kind == "frame_added" and event.frame == "lamp" for event in recording.events())
    recording.seek(summary.start)
    assert recording.instant <= summary.start + 10**9
    assert recording.step()
    with pytest.raises(LookupException):
        recording.lookup("base", "nowhere")
    X = recording.lookup_at("base", "hand", max(answers))
    assert np.allclose(X.matrix, answers[max(answers)].matrix, atol=1e-12)
    with pytest.raises(ExtrapolationException):
        recording.lookup("base", "hand", max(answers) + 3600 * 10**9)


def test_what_is_no_recording_is_refused(tmp_path):
    with pytest.raises(TransformException):
        Recording(str(tmp_path / "nothing.mcap"))
    wrong = tmp_path / "wrong.mcap"
    wrong.write_bytes(b"no MCAP at all")
    with pytest.raises(TransformException):
        Recording(str(wrong))


def ros_file(messages: list[tuple[str, float, float, str, str, float]]) -> bytes:
    """A minimal MCAP file of rosbag2: topic, times of logging and stamp [s], parent, child, x."""

    def text(value: str) -> bytes:
        return struct.pack("<I", len(value)) + value.encode()

    def record(kind: int, content: bytes) -> bytes:
        return struct.pack("<BQ", kind, len(content)) + content

    def transform(stamp: float, parent: str, child: str, x: float) -> bytes:
        cdr = bytearray(struct.pack("<III", 1, int(stamp), round(stamp % 1 * 1e9)))
        for name in (parent, child):
            cdr += bytes(-len(cdr) % 4) + struct.pack("<I", len(name) + 1) + name.encode() + b"\0"
        cdr += bytes(-len(cdr) % 8) + struct.pack("<7d", x, 0, 0, 0, 0, 0, 1)
        return b"\0\1\0\0" + bytes(cdr)

    topics = ["/tf", "/tf_static"]
    out = b"\x89MCAP0\r\n" + record(1, text("ros2") + text("test"))
    out += record(3, struct.pack("<H", 1) + text("tf2_msgs/msg/TFMessage") + text("ros2msg") + text("..."))
    for i, topic in enumerate(topics):
        out += record(4, struct.pack("<HH", i, 1) + text(topic) + text("cdr") + struct.pack("<I", 0))
    for i, (topic, log, stamp, parent, child, x) in enumerate(messages):
        ns = round(log * 1e9)
        out += record(5, struct.pack("<HIQQ", topics.index(topic), i, ns, ns) + transform(stamp, parent, child, x))
    return out + record(15, bytes(4)) + record(2, bytes(20)) + b"\x89MCAP0\r\n"


def test_what_is_left_out_of_a_recording_of_ros_is_counted(tmp_path):
    file = tmp_path / "ros.mcap"
    W = 1_700_000_000
    file.write_bytes(ros_file(
        [("/tf_static", W, 0, "base", " lidar", 1), ("/tf_static", W, 0, "base", "lidar", 1),
         ("/tf_static", W, 0, "lidar", "base", 1)] +
        [("/tf", W + i, i, "odom", "base", i) for i in range(4)] +
        [("/tf", W + 3.1, 3, "odom", "base", 9), ("/tf", W + 3.2, 3, "odom", "base", 3)]))
    recording = Recording(str(file))
    assert recording.summary.transforms is None and recording.summary.left_out is None
    recording.read_all()
    summary = recording.summary
    assert {kind: count for kind, count in summary.transforms.items() if count} == {
        "names": 1, "cycles": 1, "repeated": 1, "same": 1, "unstamped": 1}
    assert summary.left_out == 3
    for at in (0, 1.5, 3):
        assert recording.lookup("odom", "lidar", float(at)).translation[0] == at + 1
    info = subprocess.run([os.environ["TFDUDE_CLI"], "info", file], capture_output=True, text=True, check=True).stdout
    assert "left out     1 names: " in info and "left out     1 repeated: " in info
    assert "found        1 unstamped: " in info and "early" not in info
