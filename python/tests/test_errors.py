"""Errors say what they are about as data, calls wait for what comes, and wrong arguments name themselves."""

import threading
import time

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Joint, Transform

START = 1_000_000_000_000_000_000


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
    ],
)
def test_wrong_arguments_name_themselves(client, kind, name, call):
    with pytest.raises(kind, match=rf"^{name}\b"):
        call(client)


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
