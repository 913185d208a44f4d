"""asyncio: lookups, events and watches, woken by a file descriptor."""

import asyncio
import threading

import numpy as np
import pytest
import tfdude
from tfdude import Transform, aio

START = 1_000_000_000_000_000_000


def test_lookup(client):
    async def main():
        X = await client.lookup_async("base", "lower")
        assert np.allclose(X.matrix, client.lookup("base", "lower").matrix)
        many = await asyncio.gather(*(client.lookup_async("base", "tool") for _ in range(100)))
        assert len(many) == 100
        with pytest.raises(tfdude.LookupException):
            await client.lookup_async("base", "nowhere", timeout=0.05)
        with pytest.raises(TypeError):
            await client.lookup_async("base", "tool", "now")

    asyncio.run(main())


def test_thousand_waits_need_no_threads(client, node):
    async def main():
        before = threading.active_count()
        waiting = [asyncio.create_task(client.lookup_async("base", "late", timeout=30)) for _ in range(1000)]
        await asyncio.sleep(0.05)
        assert threading.active_count() == before
        assert not any(task.done() for task in waiting)
        node.add("late", "tool", Transform((1, 0, 0)))
        assert len(await asyncio.wait_for(asyncio.gather(*waiting), 20)) == 1000

    asyncio.run(main())


def test_cancellation(client, node):
    async def main():
        task = asyncio.create_task(client.lookup_async("base", "late", timeout=float("inf")))
        await asyncio.sleep(0.01)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        with pytest.raises(asyncio.TimeoutError):
            await asyncio.wait_for(client.lookup_async("base", "late", timeout=30), 0.05)
        # The answer of a cancelled lookup reaches nobody, and others still get theirs.
        node.add("late", "tool", Transform((1, 0, 0)))
        await client.lookup_async("base", "late", timeout=10)

    asyncio.run(main())


def test_loops_one_after_the_other(client):
    for _ in range(3):
        asyncio.run(client.lookup_async("base", "tool"))


def test_close_while_waiting(client):
    async def main():
        task = asyncio.create_task(client.lookup_async("base", "late", timeout=30))
        await asyncio.sleep(0.01)
        client.close()
        with pytest.raises(tfdude.TransformException):
            await asyncio.wait_for(task, 10)

    asyncio.run(main())


def test_events(client, node):
    async def main():
        seen = []
        with client.events() as events:
            node.add("camera", "tool", Transform())
            async for change in events:
                seen.append((change.kind, change.frame))
                if len(seen) == 2:
                    break
                node.remove("camera")
            waiting = asyncio.create_task(events.__anext__())
            await asyncio.sleep(0.01)
            waiting.cancel()
            with pytest.raises(asyncio.CancelledError):
                await waiting
            node.add("lamp", "tool", Transform())
            assert (await asyncio.wait_for(events.__anext__(), 10)).frame == "lamp"
            asyncio.get_running_loop().call_later(0.05, client.close)
            assert [change async for change in events] == []
        assert seen == [("frame_added", "camera"), ("frame_removed", "camera")]

    asyncio.run(asyncio.wait_for(main(), 20))


def test_watch(client, node):
    async def main():
        node.update("tool", Transform.exact((0, 0, 0)), START)
        watch = client.watch("base", "tool")

        async def write():
            for i in range(1, 4):
                await asyncio.sleep(0.02)
                node.update("tool", Transform.exact((0, 0, i)), START + i * 1000)

        writing = asyncio.create_task(write())
        stamps = []
        async for X in watch:
            stamps.append(X.stamp - START)
            if stamps[-1] == 3000:
                break
        await writing
        assert stamps[0] == 0 and stamps == sorted(set(stamps))
        asyncio.get_running_loop().call_later(0.05, client.close)
        assert [X.stamp - START async for X in watch] == [3000]

    asyncio.run(asyncio.wait_for(main(), 20))


def test_two_loops_over_the_same(client, node):
    async def main():
        events = client.events()
        messages = tfdude.MessageFilter(client, "base", max_age=20)
        seen = []

        async def of_events(name):
            async for change in events:
                seen.append(change.frame)

        async def of_messages(name):
            async for message, _ in messages:
                seen.append(message)

        tasks = [asyncio.create_task(loop(i)) for loop in (of_events, of_messages) for i in range(2)]
        await asyncio.sleep(0.01)
        node.add("late", "tool", Transform((1, 0, 0)))
        for i in range(4):
            messages.push(i, "late", START)
        while len(seen) < 5:
            await asyncio.sleep(0.001)
        assert sorted(map(str, seen)) == ["0", "1", "2", "3", "late"]
        events.close()
        messages.close()
        await asyncio.wait_for(asyncio.gather(*tasks), 20)

    asyncio.run(asyncio.wait_for(main(), 40))


def test_a_loop_that_closes_its_filter_ends_the_other_one(client):
    async def main():
        messages = tfdude.MessageFilter(client, "base", max_age=20)

        async def loop():
            async for _ in messages:
                messages.close()

        tasks = [asyncio.create_task(loop()) for _ in range(2)]
        await asyncio.sleep(0.01)
        messages.push("one", "tool", START)
        await asyncio.wait_for(asyncio.gather(*tasks), 20)

    asyncio.run(main())


def test_calls_that_wait_hold_up_no_other(client):
    async def main():
        async with aio.Client(client) as shared:
            waiting = [asyncio.create_task(shared.can_lookup("base", "nowhere", timeout=20)) for _ in range(40)]
            await asyncio.sleep(0.01)
            assert await asyncio.wait_for(shared.exists("base"), 10)
            assert not any(task.done() for task in waiting)
            client.close()  # ends them
            await asyncio.gather(*waiting)

    asyncio.run(main())
