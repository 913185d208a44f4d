"""Many at once, clouds, waits, filters and explanations."""

import asyncio
import threading
import time

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Transform, aio

START = 1_000_000_000_000_000_000
MS = 1_000_000


@pytest.fixture
def car(network):
    """A lidar on a base that drives in odom: 1 m a sample, 10 ms apart."""
    X_BL = Transform((0, 0, 1), covariance=np.eye(6) * 1e-6)
    frames = [FrameSpec("odom"), FrameSpec("base", "odom"), FrameSpec("lidar", "base", X_BL)]
    with tfdude.Node("car", frames, network=network) as node:
        for i in range(11):
            node.update("base", Transform((i, 0, 0), stddev=[0.01] * 6), START + i * 10 * MS)
        yield node


def test_lookup_many_keeps_errors_apart(network, car):
    with tfdude.Client(network=network) as client:
        batch = client.lookup_many("odom", ["base", "nowhere", "lidar"], START + 5 * MS, strict=False)
        assert np.allclose(batch.poses[[0, 2], 0], 0.5) and np.isnan(batch.poses[1]).all()
        assert np.isnan(batch.covariances[1]).all() and batch.covariances.shape == (3, 6, 6)
        assert list(batch.errors) == [1] and isinstance(batch.errors[1], tfdude.LookupException)
        assert repr(batch) == "Batch(3 transforms, 1 without an answer)"
        with pytest.raises(tfdude.LookupException, match="nowhere"):
            batch[1]
        with pytest.raises(tfdude.LookupException, match="nowhere"):
            client.lookup_many("odom", ["base", "nowhere"])
        newest = client.lookup_many([("odom", "base"), ("base", "lidar")])
        assert newest.stamps.tolist() == [START + 100 * MS] * 2
        threading.Timer(0.02, lambda: car.add("hand", "lidar", Transform())).start()
        assert len(client.lookup_many("odom", ["hand", "base"], timeout=20)) == 2


def test_trajectory(network, car):
    with tfdude.Client(network=network) as client:
        for asker in (car, client):
            stamps = np.arange(START - 20 * MS, START + 120 * MS, MS)
            trajectory = asker.trajectory("odom", "lidar", stamps)
            assert len(trajectory) == 140 and trajectory.poses.shape == (140, 7)
            assert trajectory.covariances.shape == (140, 6, 6)
            assert np.array_equal(trajectory.stamps, stamps)
            assert trajectory.valid.tolist() == [False] * 20 + [True] * 101 + [False] * 19
            assert np.allclose(trajectory.poses[20:121, 0], np.arange(101) / 10)
            assert np.isnan(trajectory.poses[:20]).all() and np.isnan(trajectory.covariances[121:]).all()
            one = asker.lookup("odom", "lidar", START + 5 * MS)
            assert np.allclose(trajectory.covariances[25], one.covariance)
            assert np.allclose(trajectory[25].matrix, one.matrix)
            (first, count, why), (last, rest, later) = trajectory.missing
            assert (first, count, why.code) == (0, 20, "too_old")
            assert (last, rest, later.code) == (121, 19, "not_yet")
            with pytest.raises(tfdude.ExtrapolationException):
                trajectory[0]
        dates = (stamps[20:25]).astype("datetime64[ns]")
        assert np.allclose(car.trajectory("odom", "base", dates).poses[:, 0], np.arange(5) / 10)
        dates[3] = np.datetime64("NaT")
        for unit in ("ns", "us", "s"):
            with pytest.raises(ValueError, match="instant 3 is NaT"):
                car.trajectory("odom", "base", dates.astype(f"datetime64[{unit}]"))
        for far in ("1500-01-01", "2500-01-01"):
            with pytest.raises(ValueError, match="instant 1 is out of range"):
                car.trajectory("odom", "base", np.array(["2020-01-01", far], "datetime64[s]"))
        seconds = car.trajectory("odom", "base", stamps[20:25] / 1e9)
        assert np.allclose(seconds.poses[:, 0], np.arange(5) / 10, atol=1e-4)
        assert len(car.trajectory("odom", "base", [])) == 0
        with pytest.raises(tfdude.LookupException):
            client.trajectory("odom", "nowhere", stamps)
        with pytest.raises(TypeError, match="instants"):
            car.trajectory("odom", "base", 7)


def test_unspecified_trajectory(network, car):
    car.update("lidar", Transform((0, 0, 1)))
    trajectory = car.trajectory("odom", "lidar", [START])
    assert not trajectory.complete and trajectory.unspecified == ["lidar"]
    with pytest.raises(tfdude.UnspecifiedCovariance, match="'lidar'"):
        trajectory.covariances
    assert trajectory.covariances_of_specified.shape == (1, 6, 6)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_cloud(network, car, kind):
    points = np.random.default_rng(1).uniform(-9, 9, (101, 3)).astype(kind)
    X = car.lookup("odom", "lidar", START + 5 * MS)
    expected = X.transform(points)
    cloud = car.transform_cloud("odom", "lidar", points, START + 5 * MS, covariance=True)
    assert cloud.points.dtype == kind and cloud.points.shape == (101, 3) and len(cloud) == 101
    assert np.allclose(cloud.points, expected.coordinates, atol=1e-5)
    assert cloud.covariances.shape == (101, 3, 3) and cloud.covariances.dtype == kind
    assert np.allclose(cloud.covariances, expected.covariance, rtol=1e-4, atol=1e-9)
    assert np.allclose(cloud.upper, cloud.covariances[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]])
    same = X.transform_cloud(points, own=np.eye(3) * 1e-4)
    own = X.transform(points, np.eye(3) * 1e-4)
    assert np.allclose(same.covariances, own.covariance, rtol=1e-4, atol=1e-9)
    with pytest.raises(ValueError, match="covariance=True"):
        X.transform_cloud(points).covariances
    with pytest.raises(ValueError, match=r"\(N, 3\), not"):
        X.transform_cloud(points.T)
    # Into memory that exists.
    view = same.points
    assert X.transform_cloud(points[::-1], out=same) is same
    assert np.allclose(view, expected.coordinates[::-1], atol=1e-5)
    with pytest.raises(ValueError, match="covariance=True"):
        same.upper
    assert np.allclose(X.transform_cloud(points, covariance=True, out=same).upper, cloud.upper, rtol=1e-4, atol=1e-9)
    for wrong in (points[1:], points.astype(np.float32 if kind is np.float64 else np.float64)):
        with pytest.raises(ValueError, match="as many points"):
            X.transform_cloud(wrong, out=same)
    # Any strides.
    assert np.allclose(X.transform_cloud(points[::-2]).points, expected.coordinates[::-2], atol=1e-5)


def test_cloud_with_stamps(network, car):
    stamps = START + np.repeat(np.arange(0, 100, 5), 3) * MS
    points = np.zeros((60, 3))
    cloud = car.transform_cloud("odom", "lidar", points, stamps=stamps)
    assert np.allclose(cloud.points[:, 0], (stamps - START) / (10 * MS))
    still = car.transform_cloud("lidar", "lidar", points, stamps=stamps, fixed="odom")
    assert np.allclose(still.points[:, 0], (stamps - stamps[-1]) / (10 * MS))
    grouped = car.transform_cloud("odom", "lidar", points, stamps=stamps, group=1.0)
    assert len(np.unique(grouped.points[:, 0].round(6))) <= 2
    for none in ([], np.array([])):
        with pytest.raises(ValueError, match="60 points, but 0 stamps"):
            car.transform_cloud("odom", "lidar", points, stamps=none)
    for wrong in ((stamps / 1e9).astype(np.float32), stamps > 0):
        with pytest.raises(TypeError, match="stamps must be"):
            car.transform_cloud("odom", "lidar", points, stamps=wrong)
    with pytest.raises(tfdude.ExtrapolationException):
        car.transform_cloud("odom", "lidar", points, stamps=stamps + 100 * MS)
    threading.Timer(0.02, lambda: car.update("base", Transform(), START + 300 * MS)).start()
    assert len(car.transform_cloud("odom", "lidar", points, stamps=stamps + 100 * MS, timeout=20)) == 60


def test_waits(network, car):
    stamp = START + 200 * MS
    assert car.can_lookup("odom", "lidar")
    can_not = car.can_lookup("odom", "lidar", stamp)
    assert not can_not and can_not.error.code == "not_yet" and "False" in repr(can_not)
    assert car.can_lookup("odom", "lidar").error is None
    threading.Timer(0.02, lambda: car.update("base", Transform((20, 0, 0)), stamp)).start()
    assert car.velocity("odom", "base", stamp, timeout=20).linear[0] > 0
    threading.Timer(0.02, lambda: car.update("base", Transform((30, 0, 0)), stamp + MS)).start()
    assert car.transform("odom", "base", (0, 0, 0), stamp + MS, timeout=20).coordinates[0] == 30
    assert car.lookup_full("base", stamp, "base", stamp + MS, "odom", timeout=20).translation[0] == pytest.approx(10)
    with pytest.raises(tfdude.LookupException):
        car.watch("odom", "nowhere", timeout=0.02)
    car.wait_until(car.now() + MS, 5)
    with pytest.raises(tfdude.TimeoutException):
        car.wait_until(car.now() + 3600 * 1000 * MS, 0.01)


def test_watched_values(network, car):
    with tfdude.Client(network=network) as client:
        watch = client.watch("odom", "base", timeout=5)
        seen = []
        with watch.on_value(seen.append):
            assert eventually(lambda: len(seen) == 1)
            assert watch.wait_next().translation[0] == 10
            with pytest.raises(tfdude.TimeoutException):
                watch.wait_next(0.01)
            car.update("base", Transform((11, 0, 0)), START + 110 * MS)
            assert watch.wait_next(20).translation[0] == 11
            assert eventually(lambda: len(seen) == 2)
            car.remove("base")
            assert eventually(lambda: len(seen) == 3)
            assert isinstance(seen[2], tfdude.LookupException)


def test_message_filter(network, car):
    dropped = []
    messages = tfdude.MessageFilter(
        car, "odom", max_age=20, most=3, on_dropped=lambda m, why: dropped.append((m, why.code))
    )
    messages.push("later", "lidar", START + 110 * MS)
    messages.push("now", "lidar", START)
    message, X = messages.get(timeout=20)
    assert message == "now" and X.translation[2] == 1 and len(messages) == 1
    messages.push("old", "lidar", START - MS)
    assert messages.get(timeout=0.2) is None and dropped == [("old", "too_old")]
    for i in range(3):
        messages.push(i, "lidar", START + 900 * MS)
    assert messages.get(timeout=0.05) is None and dropped[1] == ("later", "too_much")
    messages.close()
    car.update("base", Transform(), START + 1000 * MS)
    assert sorted(m for m, _ in messages) == [0, 1, 2]
    with pytest.raises(ValueError, match="closed"):
        messages.push(1, "lidar", START)

    given = [(i, "lidar", START + i * MS) for i in (3, 1, 2, -1)]
    assert [m for m, _ in tfdude.filter_messages(car, "odom", given, in_order=True)] == [3, 1, 2]
    # None is dropped because more are given than wait at a time.
    for options in ({}, {"in_order": True}):
        given = [(i, "lidar", START + i * MS) for i in range(100)]
        assert len(list(tfdude.filter_messages(car, "odom", given, most=3, **options))) == 100

    # Messages that can be had already do not count as waiting. Of those that nobody gets, the last ones are kept.
    told = []
    for on_dropped in (None, lambda message, error: told.append((message, error.code))):
        messages = tfdude.MessageFilter(car, "odom", most=2, on_dropped=on_dropped)
        for i in range(6):
            messages.push(i, "lidar", START + i * MS)
            assert eventually(lambda: not messages._full() and len(messages) == 0)
        assert [messages.get(timeout=20)[0] for _ in range(2)] == [4, 5]
    assert told == [(2, "too_much"), (3, "too_much")]

    async def main():
        waiting = tfdude.MessageFilter(car, "odom", in_order=True)
        waiting.push("a", "lidar", START + 1001 * MS)
        waiting.push("b", "lidar", START)
        waiting.close()
        threading.Timer(0.02, lambda: car.update("base", Transform(), START + 1100 * MS)).start()
        return [m async for m, _ in waiting]

    assert asyncio.run(main()) == ["a", "b"]


def test_aio_client(network, car):
    async def main():
        async with aio.Client(network=network) as client:
            X = await client.lookup("odom", "lidar", timeout=5)
            batch = await client.lookup_many("odom", ["base", "lidar"])
            assert (await client.velocity("odom", "base")).linear[0] == pytest.approx(100)
            assert await client.can_lookup("odom", "base")
            async for Y in await client.watch("odom", "base"):
                assert Y.translation[0] == 10
                break
            answers = await asyncio.gather(*(client.lookup("odom", "base", START + i * MS) for i in range(50)))
            with pytest.raises(tfdude.LookupException):
                await client.parent("nowhere")
            assert client.sync.exists("base") and not client.closed
        assert client.closed
        return X, batch, answers

    X, batch, answers = asyncio.run(main())
    assert X.translation.tolist() == [10, 0, 1] and len(batch) == 2
    assert np.allclose([A.translation[0] for A in answers], np.arange(50) / 10)

    async def shared():
        async with aio.Client(car) as client:
            await client.lookup("odom", "base")
        return car.closed

    assert asyncio.run(shared()) is False


def test_why(network, car):
    with tfdude.Client(network=network) as client:
        why = client.why("odom", "lidar")
        assert why.cause is None and why.transform.translation[0] == 10
        assert why.edges[0][0] == "base" and why.edges[0][2] > 0.9 and why.sources == []
        assert sum(share for _, _, share in why.edges) == pytest.approx(1)
        assert why.best[:2] == ("odom", "base") and why.best[2] < why.variance
        assert why.owners[0][:3] == ("car", "base", START + 100 * MS)
        assert "'base'" in repr(why)
        cause = client.why("odom", "lidra").cause
        assert cause.obstacle == "unknown_frame" and cause.similar == ["lidar"]
        assert cause.error.code == "unknown_end" and "unknown_frame" in repr(cause)
        late = client.why("odom", "lidar", START + 150 * MS).cause
        assert (late.obstacle, late.frame, late.partition, late.since) == (
            "ends_before",
            "base",
            "car",
            START + 100 * MS,
        )


def test_what_a_prompt_shows(network, car):
    X = car.lookup("odom", "base")
    assert repr(X).startswith("StampedTransform(translation=[10, 0, 0]") and repr(X).endswith(f"stamp={X.stamp})")
    assert repr(car.lookup("base", "lidar")).endswith("stamp=None)")
    assert repr(car.frames()[0]) == "Frame(id='base', parent='odom', partition='car', attached=True)"
    assert repr(car.path("odom", "base")[0]) == "PathSegment(partition='car', start='odom', end='base')"
    assert "name='car'" in repr(car.partitions()[0]) and "samples=11" in repr(car.history("base")[0])
    assert repr(car.velocity("odom", "base")).startswith("Velocity(linear=array([")
    assert repr(FrameSpec("a", "b")).startswith("FrameSpec(id='a', parent='b', X_PC=Transform(")
    assert repr(car) == "Node(partition='car', closed=False)"
    assert repr(car.watch("odom", "base")).startswith("PathWatch(messages=")
    assert repr(tfdude.Joint("j")) == "Joint(name='j', type='revolute', position=0.0, variance=None)"


def test_ensure(network, car):
    with tfdude.Client(network=network) as client:
        client.ensure("cup", "odom", Transform.exact((1, 0, 0)))
        client.ensure("cup", "odom", Transform.exact((2, 0, 0)))
        assert client.lookup("odom", "cup").translation[0] == 2
        client.ensure("cup", "base", Transform.exact((3, 0, 0)), START)
        assert client.parent("cup") == "base" and client.lookup("base", "cup", START).translation[0] == 3
        with pytest.raises(tfdude.LookupException):
            client.ensure("cup", "moon", Transform())


def test_calls_of_several_requests_wait_for_an_owner_that_leaves_and_returns(network):
    frames = [FrameSpec("world"), FrameSpec("arm", "world", Transform.exact((1, 0, 0)))]
    frames.append(FrameSpec("hand", "arm", Transform.exact((1, 0, 0))))
    instants = START + np.arange(11) * MS
    stop = threading.Event()

    def come_and_go():
        while not stop.is_set():
            with tfdude.Node("arm", frames, network=network) as node:
                for instant in instants:
                    node.update("hand", Transform.exact((1, 0, 0)), int(instant))
                time.sleep(0.002)

    with tfdude.Client(network=network, shared_memory=False) as client:
        thread = threading.Thread(target=come_and_go)
        thread.start()
        try:
            for _ in range(100):
                client.velocity("world", "hand", START + 5 * MS, over=0.002, timeout=20)
                client.lookup_full("hand", START, "arm", START, "world", timeout=20)
                client.trajectory("world", "hand", instants, timeout=20)
                client.transform("world", "hand", Transform.exact(), timeout=20)
                client.transform_cloud("world", "hand", np.zeros((11, 3)), stamps=instants, timeout=20)
                client.lookup_many([("world", "hand")], instants, timeout=20, strict=False)
                client.watch("world", "hand", timeout=20)
        finally:
            stop.set()
            thread.join()


def test_an_algorithm_is_written_once_for_all_that_answers_lookups(network, car):
    def end(frames: tfdude.FrameSource, at=None):
        return frames.lookup("odom", "lidar", at, timeout=5).translation

    class Table(tfdude.FrameSource):
        def __init__(self, X):
            self.X = X

        def lookup(self, a, b, at=None, *, timeout=0.0):
            return self.X

    with tfdude.Client(network=network) as client:
        live = tfdude.FrameSource.of(client)
        assert np.allclose(end(live), (10, 0, 1))
        assert np.allclose(end(tfdude.FrameSource.of(car), START + 5 * MS), (0.5, 0, 1))
        assert {frame.id for frame in live.frames()} == {"odom", "base", "lidar"}
        moved = live.lookup_full("base", START, "base", START + 10 * MS, "odom")
        assert np.allclose(moved.translation, (1, 0, 0))
        edges = client.watch_edges(["base", "lidar"], timeout=5)
        watched = tfdude.FrameSource.of(edges)
        assert eventually(lambda: np.allclose(end(watched), (10, 0, 1)))
        table = Table(live.lookup("odom", "lidar"))
        assert tfdude.FrameSource.of(table) is table
        assert np.allclose(end(table), (10, 0, 1))
        for source in (watched, table):
            with pytest.raises(tfdude.TransformException, match="does not tell its frames") as error:
                source.frames()
            assert error.value.code == "unsupported"
        with pytest.raises(TypeError, match="not int"):
            tfdude.FrameSource.of(7)
    with pytest.raises(TypeError):
        tfdude.FrameSource()
