"""Errors say what they are about as data, calls wait for what comes, and wrong arguments name themselves."""

import datetime
import threading
import time

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Joint, Transform

START = 1_000_000_000_000_000_000
NETWORK = tfdude.LoopbackNetwork()


def test_errors_of_lookups_are_data(client, node):
    for i in range(3):
        node.update("tool", Transform.exact((0, 0, i)), START + i * 1000)
    cases = [(node, START + 3000, "not_yet"), (node, START - 1, "too_old"), (client, START - 1, "too_old")]
    for asked, at, code in cases:
        with pytest.raises(tfdude.ExtrapolationException) as raised:
            asked.lookup("lower", "tool", at)
        error = raised.value
        assert (error.code, error.frame, error.available) == (code, "tool", (START, START + 2000))
        assert error.partition == (None if asked is node else "arm")
    with pytest.raises(tfdude.LookupException) as raised:
        client.lookup("base", "nowhere")
    assert (raised.value.frame, raised.value.available) == ("nowhere", None)


def test_errors_of_other_calls_name_what_their_text_names(client, node):
    with pytest.raises(tfdude.TransformException) as raised:
        client.add("tool", "base", Transform())
    assert raised.value.frame == "tool"
    with pytest.raises(tfdude.LookupException) as raised:
        client.joints("legs")
    assert raised.value.partition == "legs"


@pytest.mark.parametrize(
    ("kind", "name", "call"),
    [
        (TypeError, "at", lambda c: c.lookup("base", "tool", "noon")),
        (TypeError, "age_noise_until", lambda c: c.lookup("base", "tool", age_noise_until="noon")),
        (TypeError, "extrapolate", lambda c: c.lookup("base", "tool", extrapolate="far")),
        (TypeError, "timeout", lambda c: c.lookup("base", "tool", timeout="long")),
        (TypeError, "stamp", lambda c: c.update("tool", Transform.exact(), "noon")),
        (TypeError, "stamp", lambda c: c.observe("base", "tool", Transform.exact(), [])),
        (TypeError, "an instant", lambda c: c.trajectory("base", "tool", ["noon"])),
        (TypeError, "positions", lambda c: c.update_joints(["a"], ["x"])),
        (ValueError, "order must be 2 or 4, not 3", lambda c: c.lookup("base", "tool", order=3)),
        (ValueError, "at", lambda c: c.lookup("base", "tool", float("nan"))),
        (TypeError, "at", lambda c: c.lookup("base", "tool", np.array([START, START]))),
        (ValueError, "extrapolate must not be negative", lambda c: c.lookup("base", "tool", extrapolate=-1)),
        (ValueError, "span must not be negative", lambda c: c.watch("base", "tool", span=-1)),
        (ValueError, "timeout must not be negative", lambda c: tfdude.Client(timeout=-1, network=NETWORK)),
        (ValueError, "max_age must not be negative", lambda c: tfdude.MessageFilter(c, "base", max_age=-1)),
        (ValueError, "process_noise must have the shape", lambda c: FrameSpec("a", process_noise=[0.1] * 6)),
    ],
)
def test_wrong_arguments_name_themselves(client, kind, name, call):
    with pytest.raises(kind, match=rf"^{name}\b"):
        call(client)


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("instants", lambda c, stamps: c.trajectory("base", "tool", stamps)),
        ("at", lambda c, stamps: c.lookup_many([("base", "tool")], stamps)),
        ("stamps", lambda c, stamps: c.transform_cloud("base", "tool", np.zeros((2, 3)), stamps=stamps)),
        ("stamps", lambda c, stamps: c.rewrite("tool", stamps, np.zeros((2, 7)))),
        ("stamp", lambda c, stamps: c.publish(["tool"], [Transform.exact()], stamp=stamps)),
    ],
)
def test_instants_of_another_shape(client, name, call):
    with pytest.raises(ValueError, match=rf"^{name} must have the shape \(N,\), not \(2, 3\)"):
        call(client, np.full((2, 3), START))


UTC = datetime.timezone.utc


@pytest.mark.parametrize("at", [datetime.datetime(2611, 6, 18, tzinfo=UTC), datetime.datetime(9999, 1, 1, tzinfo=UTC),
                                datetime.datetime(1, 1, 1, tzinfo=UTC), 2**63, -(2**63) - 1, 1e10])
def test_instants_beyond_the_range(client, node, at):
    for call in (lambda: client.lookup("base", "tool", at), lambda: node.update("tool", Transform.exact(), at),
                 lambda: client.trajectory("base", "tool", [at])):
        with pytest.raises(ValueError, match="^(at|stamp|an instant) is out of range: "):
            call()


def test_instants_of_uint64(client, node):
    for i in range(2):
        node.update("tool", Transform.exact((i, 0, 0)), START + i * 1000)
    assert client.trajectory("base", "tool", np.array([START, START + 500], np.uint64)).valid.all()
    with pytest.raises(ValueError, match="^instant 1 is out of range"):
        client.trajectory("base", "tool", np.array([START, 2**63], np.uint64))


@pytest.mark.parametrize("timeout", [datetime.timedelta.max, datetime.timedelta(days=146000), 10**10, 2**70, 10**400])
def test_durations_beyond_the_range(client, timeout):
    with pytest.raises(ValueError, match="^timeout is out of range: "):
        client.lookup("base", "nowhere", timeout=timeout)


def test_the_longest_durations(client):
    assert client.lookup("base", "tool", timeout=datetime.timedelta(days=106000)).translation.shape == (3,)


def test_samples_not_in_order(client, node):
    for i in range(2):
        node.update("tool", Transform.exact((i, 0, 0)), START + i * 1000)
    with pytest.raises(tfdude.InvalidArgumentException, match="not later than the one before"):
        client.rewrite("tool", [START + 1000, START], [Transform.exact()] * 2)


def test_messages_name_the_time_of_the_whole_wait(client):
    watch = client.watch("base", "tool", timeout=10)
    watch.wait_next(10)
    with pytest.raises(tfdude.TimeoutException, match=" within 120 ms"):
        watch.wait_next(0.12)
    with pytest.raises(tfdude.TimeoutException, match=" within 120 ms"):
        client.wait_until(client.now() + 10**15, 0.12)


def test_wait_next_says_at_once_that_its_path_has_ended_and_then_waits_for_its_return(client, node):
    watch = client.watch("base", "tool", timeout=10)
    watch.wait_next(10)
    removing = threading.Timer(0.1, node.remove, ["tool"])
    removing.start()
    begin = time.monotonic()
    with pytest.raises(tfdude.LookupException):
        watch.wait_next(20)
    assert time.monotonic() - begin < 10
    removing.join()
    begin = time.monotonic()
    with pytest.raises(tfdude.LookupException):
        watch.wait_next(0.3)
    assert time.monotonic() - begin >= 0.3
    node.add("tool", "base", tfdude.Transform())
    watch.wait_next(20)


def ends_with_the_client(client, wait):
    """How a wait without a limit ends when the client is closed."""
    ended = []

    def run():
        try:
            ended.append(wait())
        except tfdude.TransformException as error:
            ended.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    closing = threading.Timer(0.1, client.close)
    closing.start()
    thread.join(20)
    closing.join()
    assert ended, "it still waits"
    return ended[0]


def test_waits_of_watches_end_with_the_client(network, node):
    forever = float("inf")
    for prepare in (
        lambda path, edges: lambda: path.wait_next(forever),
        lambda path, edges: lambda: path.wait_for_more(10**9, forever),
        lambda path, edges: lambda: edges.wait_for_more(10**9, forever),
    ):
        client = tfdude.Client(network=network)
        path = client.watch("base", "tool", timeout=10)
        edges = client.watch_edges(["tool"], timeout=10)
        path.wait_next(10)
        error = ends_with_the_client(client, prepare(path, edges))
        assert isinstance(error, tfdude.TransformException) and error.code == "transport", error
        for call in (lambda: path.wait_next(forever), lambda: edges.wait_for_more(10**9, forever),
                     lambda: path.on_value(print)):
            with pytest.raises(tfdude.TransformException, match="closed"):
                call()


@pytest.mark.parametrize(
    "wait",
    [
        lambda c: c.lookup("base", "never", timeout=20),
        lambda c: c.lookup("base", "tool", c.now() + 10**12, timeout=20),
        lambda c: c.lookup_full("base", c.now(), "never", c.now(), "base", timeout=20),
        lambda c: c.lookup_many("base", ["never"], timeout=20),
        lambda c: c.velocity("base", "never", timeout=20),
        lambda c: c.watch("base", "never", timeout=20),
        lambda c: c.watch_edges(["never"], timeout=20),
        lambda c: c.transform_cloud("base", "tool", np.zeros((1, 3)), stamps=[c.now() + 10**12], timeout=20),
        lambda c: c.joints("never", timeout=20),
        lambda c: c.wait_until(c.now() + 10**12, 20),
        lambda c: c.can_lookup("base", "never", timeout=20).error,
    ],
)
def test_all_waits_end_with_one_code_once_the_client_is_closed(network, node, wait):
    node.update("tool", Transform.exact((0, 0, 1)), node.now())
    client = tfdude.Client(network=network)
    error = ends_with_the_client(client, lambda: wait(client))
    assert (error.code, str(error)) == ("transport", "this client is closed")


def test_durations_of_get(client, node):
    short = datetime.timedelta(milliseconds=10)
    assert tfdude.MessageFilter(client, "base").get(short) is None
    with client.events() as events:
        assert events.get(short) is None
        node.add("late", "tool", Transform())
        assert events.get(datetime.timedelta(seconds=10)).frame == "late"
        with pytest.raises(TypeError, match="^timeout must be a number"):
            events.get("long")


@pytest.mark.parametrize(
    "call",
    [
        lambda c, wait: c.history("hand", timeout=wait),
        lambda c, wait: c.histories("late", timeout=wait),
        lambda c, wait: c.joints("late", timeout=wait),
        lambda c, wait: c.watch_edges(["wrist", "hand"], timeout=wait),
    ],
)
def test_calls_wait_for_what_comes_later(network, client, node, call):
    with pytest.raises(tfdude.LookupException):
        call(client, 0.01)
    opened = []
    frames = [FrameSpec("wrist", "tool", joint=Joint("turn", axis=(0, 0, 1))), FrameSpec("hand", "wrist")]

    def open_later():
        time.sleep(0.02)
        opened.append(tfdude.Node("late", frames, network=network))

    thread = threading.Thread(target=open_later)
    thread.start()
    try:
        call(client, 10)
    finally:
        thread.join()
        opened[0].close()


def test_exists_tells_no_from_unknown(network, node):
    with tfdude.Node("hand", [FrameSpec("finger", "tool")], network=network):
        assert eventually(lambda: node.exists("finger"))
    assert eventually(lambda: any(not one.reachable for one in node.partitions()))
    with tfdude.Client(network=network) as late:
        assert late.exists("tool")
        assert eventually(lambda: "hand" in [one.name for one in late.partitions()])
        # The partition that was lost before may have it.
        with pytest.raises(tfdude.UnreachableException) as raised:
            late.exists("nowhere")
        assert (raised.value.frame, raised.value.partition) == ("nowhere", "hand")


def test_lock_step(network):
    arm = [FrameSpec("base"), FrameSpec("tool", "base")]
    with tfdude.Node("arm", arm, network=network, clock="external") as node:
        with tfdude.Client(network=network, clock="external") as simulator:
            for now in (0, 20_000_000, 40_000_000, 10_000_000):
                simulator.advance_to(now, timeout=10)
                assert node.now() == now
                node.wait_until(now, 0)
            node.update("tool", Transform.exact((1, 0, 0)))
            assert np.allclose(simulator.lookup("base", "tool", 10_000_000).translation, [1, 0, 0])
