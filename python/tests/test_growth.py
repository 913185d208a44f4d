"""Clients and nodes that come and go leave nothing behind: no memory, no descriptors, no threads."""

import asyncio
import gc
import os

import tfdude
from helpers import eventually
from tfdude import FrameSpec, Transform

FRAMES = [FrameSpec("base"), FrameSpec("tool", "base", Transform.exact((0, 0, 1)))]


def resident() -> int:
    """[bytes]"""
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def count(what: str) -> int:
    return len(os.listdir(f"/proc/self/{what}"))


def use(client: tfdude.Client) -> None:
    """Makes everything that a client can give, and drops it in any order."""
    client.lookup("base", "tool", timeout=5)
    watch = client.watch("base", "tool")
    watch.latest()
    subscription = client.on_change(lambda change: None)
    events = client.events()
    stream = client.stream(["tool"])
    stream.publish([Transform.exact()])
    try:
        client.lookup("base", "nowhere")
    except tfdude.LookupException:
        pass
    del watch, subscription, events, stream


def check(cycle, cycles: int, warm_up: int, bytes_per_cycle: float, once: float = 1e6) -> None:
    """@param once  [bytes] that may be kept whatever the number of cycles"""
    for _ in range(warm_up):
        cycle()
    memory, descriptors, threads = resident(), count("fd"), count("task")
    for _ in range(cycles):
        cycle()
    growth = resident() - memory
    assert growth < bytes_per_cycle * cycles + once, f"{growth / cycles:.0f} bytes a cycle"
    assert eventually(lambda: count("fd") <= descriptors and count("task") <= threads), (
        f"{count('fd') - descriptors} descriptors, {count('task') - threads} threads more"
    )


def test_clients_over_loopback(network):
    with tfdude.Node("arm", FRAMES, network=network):

        def cycle() -> None:
            with tfdude.Client(network=network) as client:
                use(client)

        check(cycle, 4_000, 500, 100)


def test_clients_that_are_only_dropped(network):
    with tfdude.Node("arm", FRAMES, network=network):
        check(lambda: use(tfdude.Client(network=network)), 500, 100, 1000)


def test_lookups_and_transforms(network):
    with tfdude.Node("arm", FRAMES, network=network) as node, tfdude.Client(network=network) as client:

        async def many() -> None:
            await asyncio.gather(*(client.lookup_async("base", "tool") for _ in range(20)))

        def cycle() -> None:
            X = client.lookup("base", "tool") @ node.lookup("tool", "base").inverse()
            views = X.translation, X.quaternion, X.covariance, X.matrix
            client.lookup_many([("base", "tool")] * 20).covariances
            asyncio.run(many())
            del X, views

        check(cycle, 1_000, 200, 100)


def test_nodes_and_clients_over_dds(dds_domain):
    domain = {"domain": dds_domain, "profile": "local"}
    with tfdude.Node("arm", FRAMES, **domain):

        def cycle() -> None:
            with tfdude.Client(**domain) as client:
                use(client)

        check(cycle, 200, 40, 20_000, once=1e6)
