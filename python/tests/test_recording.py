"""A file of `tfdude record` answers what the live system answered."""

from __future__ import annotations

import os
import signal
import subprocess

import numpy as np
import pytest
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
