"""Client and Node over loopback: structure, values, instants, errors."""

import datetime
import threading
import time

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Transform

START = 1_000_000_000_000_000_000


def test_example_of_the_thesis(network):
    """Two arms on a base: each is a partition, and either asks for frames of both."""
    with tfdude.Node("base", [FrameSpec("world"), FrameSpec("base", "world", Transform.exact((0, 0, 0.5)))],
                     network=network) as base:
        left = tfdude.Node("left", [FrameSpec("left_hand", "base", Transform.exact((0, 0.3, 1)))], network=network)
        right = tfdude.Node("right", [FrameSpec("right_hand", "base", Transform.exact((0, -0.3, 1)))], network=network)
        with left, right:
            for asker in (base, left, right):
                X = asker.lookup("left_hand", "right_hand")
                assert np.allclose(X.translation, [0, -0.6, 0])
                assert np.array_equal(X.covariance, np.zeros((6, 6)))
            assert [segment.partition for segment in base.path("left_hand", "right_hand")] == ["left", "right"]
            right.move("right_hand", "left_hand")
            assert eventually(lambda: base.parent("right_hand") == "left_hand")
            base.remove("left_hand")
            assert eventually(lambda: not right.exists("right_hand"))


def test_lookup_with_covariance(client, node):
    X = client.lookup("base", "lower")
    assert np.allclose(X.translation, [1, 0, 1])
    expected = node.lookup("base", "upper") @ node.lookup("upper", "lower")
    assert np.allclose(X.covariance, expected.covariance)
    assert X.stamp is None and X.datetime is None
    assert X.unspecified == []


def test_unspecified_edges_are_named(client):
    X = client.lookup("base", "tool")
    assert not X.complete
    assert X.unspecified == ["tool"]
    with pytest.raises(tfdude.UnspecifiedCovariance, match="'tool'"):
        X.covariance
    assert X.covariance_of_specified[0, 0] > 0


def test_structure(client):
    assert client.roots() == ["base"]
    assert client.children("base") == ["upper"]
    assert client.parent("upper") == "base" and client.parent("base") == ""
    assert [frame.id for frame in client.frames()] == ["base", "lower", "tool", "upper"]
    assert [(p.name, p.reachable, p.frames) for p in client.partitions()] == [("arm", True, 4)]
    client.add("camera", "lower", Transform.exact((0, 0, 0.1)))
    assert eventually(lambda: client.exists("camera"))
    client.update("camera", Transform.exact((0, 0, 0.2)))
    assert client.lookup("lower", "camera").translation[2] == 0.2
    client.remove("camera")
    assert eventually(lambda: not client.exists("camera"))


def test_node(node):
    assert node.partition == "arm"
    assert node.own_frames == 4
    node.update("tool", Transform((0, 0, 1)), START)
    assert node.clear_history() == 1
    with pytest.raises(tfdude.LookupException):
        node.clear_history("nowhere")


@pytest.mark.parametrize(
    "stamp",
    [
        START,
        np.int64(START),
        START / 1e9,
        np.float64(START / 1e9),
        datetime.datetime.fromtimestamp(START / 1e9, datetime.timezone.utc),
        datetime.datetime.fromtimestamp(START / 1e9, datetime.timezone(datetime.timedelta(hours=5))),
        type("Time", (), {"nanoseconds": START})(),
    ],
)
def test_instants(node, stamp):
    node.update("tool", Transform.exact((0, 0, 1)), stamp)
    X = node.lookup("base", "tool", stamp)
    assert X.stamp == START
    assert X.datetime == datetime.datetime(2001, 9, 9, 1, 46, 40, tzinfo=datetime.timezone.utc)


@pytest.mark.parametrize("stamp", [True, "now", [1], 1j])
def test_no_instants(node, stamp):
    with pytest.raises(TypeError):
        node.lookup("base", "tool", stamp)


@pytest.mark.parametrize("stamp", [datetime.datetime(2026, 1, 1), float("nan"), float("inf"), 1e30])
def test_invalid_instants(node, stamp):
    with pytest.raises(ValueError):
        node.lookup("base", "tool", stamp)
    with pytest.raises((ValueError, OverflowError)):
        node.lookup("base", "tool", 1 << 70)


def test_interpolated_and_extrapolated(node):
    for i in range(3):
        node.update("tool", Transform.exact((0, 0, i)), START + i * 1000)
    assert node.lookup("lower", "tool", START + 500).translation[2] == pytest.approx(0.5)
    with pytest.raises(tfdude.ExtrapolationException) as raised:
        node.lookup("lower", "tool", START + 3000)
    assert (raised.value.code, raised.value.frame) == ("not_yet", "tool")
    with pytest.raises(tfdude.ExtrapolationException) as raised:
        node.lookup("lower", "tool", START - 1)
    assert raised.value.code == "too_old"
    later = node.lookup("lower", "tool", START + 3000, extrapolate=datetime.timedelta(microseconds=1))
    assert later.translation[2] == pytest.approx(3)


def test_velocity(node):
    for i in range(11):
        node.update("tool", Transform.exact((0, 0, i * 0.1)), START + i * 100_000_000)
    v = node.velocity("base", "tool", over=0.5)
    assert np.allclose(v.linear, [0, 0, 1]) and np.allclose(v.angular, 0)
    assert v.end - v.begin == 500_000_000


def test_errors_have_tf2s_names(client, node):
    for call, kind, code, frame in [
        (lambda: client.lookup("nowhere", "base"), tfdude.LookupException, "unknown_start", "nowhere"),
        (lambda: client.lookup("base", "nowhere"), tfdude.LookupException, "unknown_end", "nowhere"),
        (lambda: client.remove("nowhere"), tfdude.LookupException, "unknown_frame", "nowhere"),
        (lambda: client.add("a", "nowhere", Transform()), tfdude.LookupException, "unknown_parent", "nowhere"),
        (lambda: client.add("", "base", Transform()), tfdude.InvalidArgumentException, "invalid_input", None),
        (lambda: client.move("base", "tool"), tfdude.TransformException, "cycle", "base"),
        (lambda: client.add("tool", "base", Transform()), tfdude.TransformException, "already_exists", "tool"),
    ]:
        with pytest.raises(kind) as raised:
            call()
        assert (raised.value.code, raised.value.frame) == (code, frame), str(raised.value)
        assert isinstance(raised.value, tfdude.TransformException)
    node.add("island", "", Transform())
    assert eventually(lambda: client.exists("island"))
    with pytest.raises(tfdude.ConnectivityException):
        client.lookup("base", "island")


def test_unreachable_partition_is_named(network, client, node):
    arm = tfdude.Node("hand", [FrameSpec("finger", "tool")], network=network)
    assert eventually(lambda: client.exists("finger"))
    arm.close()
    with pytest.raises(tfdude.UnreachableException) as raised:
        client.lookup("base", "finger")
    assert raised.value.partition == "hand"
    assert isinstance(raised.value, ConnectionError)


def test_as_tf2(client, node):
    assert client.can_transform("base", "tool")
    assert client.can_transform("base", "tool", 0)
    assert not client.can_transform("base", "nowhere")
    assert not client.can_transform("base", "nowhere", timeout=0.05)
    X = client.lookup_transform("base", "tool", 0, 1.0)
    assert np.allclose(X.matrix, client.lookup("base", "tool").matrix)
    node.update("tool", Transform.exact((0, 0, 1)), START)
    assert client.lookup_transform("base", "tool").stamp == START
    with pytest.raises(tfdude.ExtrapolationException):
        client.lookup_transform("base", "tool", START + 1)
    with pytest.raises(tfdude.ExtrapolationException):
        client.wait_for_transform("base", "tool", START + 1, timeout=0.05)
    client.wait_for_transform("base", "tool", START)


def test_waits_for_data_while_others_run(client, node):
    """The GIL is free while a lookup waits: the thread that brings the data runs."""
    def bring():
        time.sleep(0.1)
        node.add("late", "tool", Transform.exact((1, 0, 0)))

    bringer = threading.Thread(target=bring)
    bringer.start()
    began = time.monotonic()
    assert client.lookup("tool", "late", timeout=10).translation[0] == 1
    assert 0.09 < time.monotonic() - began < 5
    bringer.join()
    with pytest.raises(TypeError):
        client.lookup("tool", "late", timeout="1")


def test_closed(network):
    client = tfdude.Client(network=network)
    assert not client.closed
    client.close()
    client.close()
    assert client.closed
    with pytest.raises(tfdude.TransformException, match="closed"):
        client.frames()


def test_close_ends_a_wait(network, client):
    other = tfdude.Client(network=network)
    closer = threading.Timer(0.1, other.close)
    closer.start()
    with pytest.raises(tfdude.TransformException, match="closed") as raised:
        other.lookup("base", "nowhere", timeout=float("inf"))
    assert raised.value.code == "transport"
    closer.join()


def test_names_of_options(network):
    for arguments in ({"clock": "sun"}, {"timeout": -1.0, "domain": 400}):
        with pytest.raises(ValueError):
            tfdude.Client(**arguments)
    with pytest.raises(TypeError):
        tfdude.Client(0)
    with pytest.raises(tfdude.TransformException):
        tfdude.Node("a*", network=network)


def test_joint_of_a_frame(network):
    elbow = tfdude.Joint("elbow", "revolute", (0, 0, 2), limits=(-1, 1), variance=1e-4)
    with tfdude.Node("arm", [FrameSpec("base"), FrameSpec("lower", "base", Transform.exact((1, 0, 0)), joint=elbow)],
                     network=network) as node:
        assert np.allclose(node.lookup("base", "lower").stddev, [0, 0, 0, 0, 0, 0.01])
    with pytest.raises(ValueError):
        tfdude.Joint("elbow", "spherical")
    with pytest.raises(tfdude.InvalidArgumentException):
        FrameSpec("lower", "base", joint=tfdude.Joint("elbow", axis=(0, 0, 0)))
    with pytest.raises(tfdude.InvalidArgumentException):
        FrameSpec("lower", "base", joint=tfdude.Joint("elbow", limits=(1, -1)))


def test_parts_of_an_edge_are_set_and_others_kept(client, node):
    before = client.lookup("base", "upper")
    client.update_parts("upper", translation=(7, 8, 9))
    after = client.lookup("base", "upper")
    assert np.allclose(after.translation, (7, 8, 9))
    assert np.allclose(after.quaternion, before.quaternion)
    assert np.allclose(after.covariance, before.covariance)
    client.update_parts("upper", covariance="exact")
    assert np.array_equal(client.lookup("base", "upper").covariance, np.zeros((6, 6)))
    with pytest.raises(tfdude.InvalidArgumentException):
        client.update_parts("upper", quaternion=(0, 0, 0, 2))


def test_edges_that_share_a_source_are_correlated(client, node):
    client.update_parts("upper", covariance="exact")
    client.update_parts("lower", covariance="exact")
    heat = (0, 0, 1e-3, 0, 0, 0)
    client.correlate("upper", {"heat": heat})
    client.correlate("lower", {"heat": np.reshape(heat, (6, 1))})
    X = client.lookup("base", "lower")
    assert X.sources == ["heat"]
    independent = node.lookup("base", "upper") @ node.lookup("upper", "lower")
    assert not np.allclose(X.covariance, independent.covariance)
    client.correlate("lower")
    assert client.lookup("upper", "lower").sources == []
    with pytest.raises(ValueError):
        client.correlate("lower", {"heat": np.ones(5)})


def test_frames_of_a_file_have_its_history(tmp_path, network):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "partition: robot\nhistory: {span: 100, max_ahead: none}\nframes:\n"
        "  - {id: base}\n  - {id: arm, parent: base}\n"
        "  - {id: tool, parent: arm, history: {span: 5}}\n"
    )
    frames = tfdude.load_config(str(file)).frames
    with tfdude.Node("robot", frames, network=network) as node:
        for second in range(0, 50, 10):
            node.update_many(["arm", "tool"], [tfdude.Transform.exact()] * 2, stamp=10**9 * second)
        assert [node.history(frame)[0].samples for frame in ("arm", "tool")] == [5, 1]
