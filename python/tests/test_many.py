"""Batches, joints, streams, watches, observations."""

import threading
import time

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Joint, Transform

START = 1_000_000_000_000_000_000
IDS = ["upper", "lower", "tool"]


def rows(count):
    poses = np.zeros((count, 7))
    poses[:, 0] = np.arange(count)
    poses[:, 6] = 1
    return poses


@pytest.fixture
def robot(network):
    """30 joints in a row."""
    frames = [FrameSpec("link0")]
    for i in range(30):
        joint = Joint(f"joint{i}", limits=(-2, 2), variance=1e-6)
        frames.append(FrameSpec(f"link{i + 1}", f"link{i}", Transform.exact((0, 0, 0.1)), joint=joint))
    with tfdude.Node("robot", frames, network=network) as node:
        yield node


def test_update_many(client, node):
    covariances = np.stack([np.eye(6) * (i + 1) for i in range(3)])
    client.update_many(IDS, rows(3), covariances)
    assert client.lookup("base", "upper").covariance[0, 0] == 1
    assert client.lookup("lower", "tool").translation[0] == 2
    assert client.lookup("lower", "tool").covariance[5, 5] == 3
    client.update_many(IDS, rows(3), np.eye(6) * 7)
    assert client.lookup("upper", "lower").covariance[0, 0] == 7
    client.update_many(IDS, rows(3))
    assert not client.lookup("base", "upper").complete
    client.update_many(IDS, rows(3), "exact")
    assert np.array_equal(client.lookup("base", "upper").covariance, np.zeros((6, 6)))
    client.update_many(IDS, [Transform.exact((0, 0, i)) for i in range(3)])
    assert client.lookup("lower", "tool").translation[2] == 2


def test_strides_of_batches(client):
    big = np.zeros((6, 14), np.float32)
    big[::2, ::2] = rows(3)
    client.update_many(IDS, big[::2, ::2], np.broadcast_to(np.eye(6), (3, 6, 6)))
    assert client.lookup("lower", "tool").translation[0] == 2


@pytest.mark.parametrize(
    ("poses", "covariances", "kind", "text"),
    [
        (rows(2), None, ValueError, r"poses must have the shape \(3, 7\), not \(2, 7\)"),
        (rows(3)[:, :6], None, ValueError, "poses must have the shape"),
        (rows(3), np.zeros((2, 6, 6)), ValueError, "covariances must have the shape"),
        (rows(3), np.zeros((3, 3)), ValueError, "covariance must have the shape"),
        (rows(3) * np.nan, None, tfdude.InvalidArgumentException, "row 0: "),
        (rows(3) * [1, 1, 1, 1, 1, 1, 2], None, tfdude.InvalidArgumentException, "row 0: "),
        (rows(3), np.stack([np.eye(6), -np.eye(6), np.eye(6)]), tfdude.InvalidArgumentException, "row 1: "),
        ([Transform()] * 2, None, ValueError, "poses must be 3"),
        ([Transform()] * 3, "exact", TypeError, "have their covariances"),
        (None, None, TypeError, "poses must be numbers"),
        ("abc", None, TypeError, "poses must be numbers"),
    ],
)
def test_wrong_batches(client, poses, covariances, kind, text):
    before = client.lookup("base", "tool").matrix
    with pytest.raises(kind, match=text):
        client.update_many(IDS, poses, covariances)
    assert np.array_equal(client.lookup("base", "tool").matrix, before)


def test_lookup_many(client, node):
    pairs = [("base", "upper"), ("base", "lower"), ("lower", "base"), ("base", "base")]
    for asker in (client, node):
        batch = asker.lookup_many(pairs)
        assert len(batch) == 4 and batch.complete
        assert batch.poses.shape == (4, 7) and batch.covariances.shape == (4, 6, 6)
        for i, pair in enumerate(pairs):
            one = asker.lookup(*pair)
            assert np.allclose(batch.poses[i], [*one.translation, *one.quaternion])
            assert np.allclose(batch.covariances[i], one.covariance)
            assert batch[i] == one
        assert batch.stamps.tolist() == [-1] * 4
        assert batch[-1] == batch[3]
        with pytest.raises(IndexError):
            batch[4]
        assert len(asker.lookup_many([])) == 0
    with pytest.raises(tfdude.UnspecifiedCovariance, match="'tool'"):
        client.lookup_many([("base", "tool")]).covariances
    assert client.lookup_many([("base", "tool")]).covariances_of_specified.shape == (1, 6, 6)


def test_lookup_many_instants(client, node):
    for i in range(101):
        node.update("tool", Transform.exact((0, 0, i)), START + i * 1000)
    instants = np.arange(START, START + 100_000, 250)
    batch = client.lookup_many([("lower", "tool")], instants)
    assert np.allclose(batch.poses[:, 2], np.arange(400) / 4)
    assert np.array_equal(batch.stamps, instants)
    two = client.lookup_many([("lower", "tool"), ("tool", "lower")], [START, START + 1000])
    assert np.allclose(two.poses[:, 2], [0, -1])
    with pytest.raises(tfdude.ExtrapolationException):
        client.lookup_many([("lower", "tool")], [START, START - 1])
    with pytest.raises(ValueError, match="2 pairs, but 3 instants"):
        client.lookup_many([("lower", "tool")] * 2, [START] * 3)


def test_publish_with_a_stamp_for_each(client, node):
    rows = np.zeros((3, 7))
    rows[:, 2], rows[:, 6] = [3, 5, 1], 1
    stamps = np.array([START + 2000, START + 1000, START])
    client.publish(["tool", "lower", "tool"], rows, "exact", stamps)
    client.flush()
    assert client.lookup("lower", "tool", START + 1000).translation[2] == 2
    client.publish(["tool"], rows[:1], "exact", [START + 3000])
    client.flush()
    assert client.lookup("lower", "tool", START + 3000).translation[2] == 3
    with pytest.raises(tfdude.InvalidArgumentException, match="2 stamps for 1 edges"):
        client.publish(["tool"], rows[:1], "exact", stamps[:2])


def test_joints(network, robot):
    names = [f"joint{i}" for i in range(30)]
    positions = np.linspace(-1, 1, 60)[::2]
    with tfdude.Client(network=network) as client:
        client.update_joints(names, positions, np.full(30, 1e-4), START)
        info = {joint.name: joint for joint in client.joints("robot")}
        assert info["joint7"].position == positions[7]
        assert info["joint7"].limits == (-2, 2) and info["joint7"].type == "revolute"
        assert info["joint7"].variance == 1e-4 and info["joint7"].measured
        assert np.allclose(client.lookup("link7", "link8").rpy, [0, 0, positions[7]])
        client.publish_joints(names, positions * 0.5, stamp=START + 1000)
        client.flush()
        assert np.allclose(client.lookup("link7", "link8", START + 1000).rpy, [0, 0, positions[7] * 0.5])
        assert not client.lookup("link7", "link8", START + 1000).complete
        variances = [1e-4] * 30
        variances[3] = None  # unspecified
        client.update_joints(names, positions, variances, START + 2000)
        assert client.lookup("link2", "link3").complete and not client.lookup("link3", "link4").complete
        for wrong in (positions[:3], positions.reshape(5, 6), np.full(30, 1j)):
            with pytest.raises((ValueError, TypeError)):
                client.publish_joints(names, wrong)
        with pytest.raises(tfdude.InvalidArgumentException, match="joint0"):
            client.publish_joints(names, np.full(30, np.nan))
        for nan in (np.nan, -1e-9):
            variances[5] = nan
            for wrong in (variances, np.array([0 if one is None else one for one in variances])):
                for call in (client.update_joints, client.publish_joints):
                    with pytest.raises(tfdude.InvalidArgumentException, match="joint5.*variance"):
                        call(names, positions, wrong, START + 3000)
        for wrong in (variances[:3], ["a"] * 30, [None, *["a"] * 29]):
            with pytest.raises((ValueError, TypeError), match="variances"):
                client.update_joints(names, positions, wrong)
        with pytest.raises(tfdude.LookupException) as raised:
            client.publish_joints(["no_joint"], [0.0])
        assert raised.value.code == "unknown_joint"


def test_streams(network, robot):
    names = [f"joint{i}" for i in range(30)]
    with tfdude.Client(network=network) as client:
        joints = client.stream_joints(names)
        assert eventually(lambda: joints.publish(np.full(30, 0.25), stamp=START) == [])
        client.flush()
        assert np.allclose(client.lookup("link0", "link1", START).rpy, [0, 0, 0.25])
        with pytest.raises(ValueError):
            joints.publish(np.zeros(29))
        assert joints.publish(np.full(30, np.nan), stamp=START + 1)[0] == ("joint0", "invalid_input", "")
        edges = client.stream(["link1", "nowhere"])
        not_sent = edges.publish(rows(2), "exact", START + 1)
        assert [(name, why) for name, why, _ in not_sent] == [("nowhere", "unknown_frame")]
        assert client.lookup("link0", "link1", START + 1).translation[0] == 0


def test_publish(client, node):
    client.publish(IDS, rows(3), stamp=START)
    client.flush()
    assert client.lookup("lower", "tool").stamp == START


def test_watch(client, node):
    watch = client.watch("base", "tool")
    assert np.allclose(watch.latest().matrix, client.lookup("base", "tool").matrix)
    assert not watch.latest().complete and watch.latest().unspecified == ["tool"]
    before = watch.messages
    assert not watch.wait_for_more(before, 0.05)
    threading.Timer(0.1, lambda: node.update("tool", Transform.exact((0, 0, 1)), START)).start()
    assert watch.wait_for_more(before, 10)
    assert watch.latest().stamp == START
    assert watch.lookup(START).stamp == START
    with pytest.raises(tfdude.ExtrapolationException):
        watch.lookup(START + 1)
    watch.check()
    with pytest.raises(tfdude.LookupException):
        client.watch("base", "nowhere")
    edges = client.watch_edges(IDS)
    assert edges.lookup("upper", "tool", START).stamp == START


def test_observe(network):
    frames = [
        FrameSpec("head"),
        FrameSpec("camera", "head", Transform((0, 0, 0.1), stddev=[0.01] * 3 + [0.02] * 3)),
    ]
    rng = np.random.default_rng(4)
    with tfdude.Node("head", frames, network=network) as node:
        before = node.lookup("head", "camera").stddev
        for _ in range(50):
            noise = Transform.exp(rng.normal(size=6) * 0.005)
            measured = (Transform.exact((0.01, 0, 0.1)) @ noise).with_covariance(np.eye(6) * 0.005**2)
            observed = node.observe("head", "camera", measured)
            assert observed.accepted and observed.corrected == ["camera"] and observed.dimensions == 6
        after = node.lookup("head", "camera")
        assert np.all(after.stddev < before / 5)
        assert np.allclose(after.translation, [0.01, 0, 0.1], atol=4 * after.stddev[:3].max())
        [edge] = node.consistency("head")
        assert edge.observations == 50 and edge.refused == 0
        assert edge.squares / edge.expected == pytest.approx(1, abs=0.5)
        far = node.fuse("camera", Transform((1, 0, 0.1), covariance=np.eye(6) * 1e-6))
        assert not far.accepted and far.distance_squared > far.limit
        assert node.consistency("head")[0].refused == 1
        with pytest.raises(tfdude.InvalidArgumentException):
            node.observe("head", "camera", Transform())


def test_a_filters_pose_determines_an_edge(network):
    frames = [FrameSpec("map"), FrameSpec("odom", "map"), FrameSpec("base", "odom", Transform.exact((2, 0, 0)))]
    with tfdude.Node("robot", frames, network=network) as node:
        for x in (5, 7):
            pose = Transform((x, 0, 0), covariance=np.eye(6) * 0.01)
            assert node.determine("odom", "map", "base", pose).accepted
            there = node.lookup("map", "base")
            assert np.allclose(there.translation, pose.translation) and np.allclose(there.covariance, pose.covariance)
            assert np.allclose(node.lookup("odom", "base").translation, [2, 0, 0])
        with pytest.raises(tfdude.InvalidArgumentException):
            node.determine("map", "odom", "base", Transform.exact((2, 0, 0)))


def test_changes_by_callback(client, node):
    seen = []
    with client.on_change(seen.append):
        node.add("camera", "tool", Transform())
        assert eventually(lambda: [c.frame for c in seen] == ["camera"])
        assert (seen[0].kind, seen[0].partition, seen[0].parent) == ("frame_added", "arm", "tool")
        assert seen[0].stamp == pytest.approx(time.time_ns(), abs=60e9)
    node.remove("camera")
    assert eventually(lambda: not client.exists("camera"))
    assert len(seen) == 1


def test_callback_may_close_the_client(network, node):
    client = tfdude.Client(network=network)
    closed = threading.Event()

    def close(_change):
        client.close()
        closed.set()

    subscription = client.on_change(close)
    node.add("camera", "tool", Transform())
    assert closed.wait(10)
    subscription.close()
    assert client.closed


def test_exception_in_a_callback_is_reported(client, node, monkeypatch):
    reported = []
    monkeypatch.setattr("sys.unraisablehook", lambda report: reported.append(report.exc_type))

    def fail(_change):
        raise ZeroDivisionError

    with client.on_change(fail):
        node.add("camera", "tool", Transform())
        assert eventually(lambda: reported == [ZeroDivisionError])


def test_closing_waits_for_a_callback(client, node):
    """A callback needs the GIL that the closing thread has: it must not deadlock."""
    entered, left = threading.Event(), threading.Event()

    def slow(_change):
        entered.set()
        time.sleep(0.2)
        left.set()

    subscription = client.on_change(slow)
    node.add("camera", "tool", Transform())
    assert entered.wait(10)
    subscription.close()
    assert left.is_set()


def test_events(client, node):
    with client.events() as events:
        assert events.get(timeout=0.05) is None
        for i in range(3):
            node.add(f"camera{i}", "tool", Transform())
        assert [next(events).frame for _ in range(3)] == ["camera0", "camera1", "camera2"]
        threading.Timer(0.1, client.close).start()
        assert list(events) == []


def test_external_clock(network):
    with tfdude.Node("arm", [FrameSpec("base"), FrameSpec("tool", "base")], network=network, clock="external") as node:
        with pytest.raises(tfdude.ExtrapolationException):
            node.now()
        node.set_time(5.0)
        assert node.now() == 5_000_000_000
        with tfdude.Client(network=network, clock="external") as client:
            assert eventually(lambda: client.partitions() != [])
            client.publish_clock(6_000_000_000)
            assert eventually(lambda: node.now() == 6_000_000_000)
