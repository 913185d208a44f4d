"""What waits: lookup_async(), events() and loops over a watch.

Threads of the library put answers into a mailbox, whose file descriptor wakes asyncio's loop. So there is no thread for
a wait, and none of the library's threads needs the GIL.
"""

from __future__ import annotations

import asyncio
import collections.abc
import itertools
import math
import select
import time
import weakref
from typing import TYPE_CHECKING, Any, Literal

from . import _core

if TYPE_CHECKING:
    from ._core import _Duration, _Instant


class _Hub:
    """The lookups that wait in one loop. Its descriptor is in the loop while there are any."""

    def __init__(self) -> None:
        self._mailbox = _core._Mailbox()
        self._waiting: dict[int, asyncio.Future[_core.StampedTransform]] = {}
        self._keys = itertools.count()

    async def lookup(self, client: _core.Client, *query: Any) -> _core.StampedTransform:
        loop = asyncio.get_running_loop()
        key = next(self._keys)
        future: asyncio.Future[_core.StampedTransform] = loop.create_future()
        if not self._waiting:
            loop.add_reader(self._mailbox.fileno(), self._take)
        self._waiting[key] = future
        pending = None
        try:
            pending = client._start_lookup(self._mailbox, key, *query)
            return await future
        finally:
            if pending is not None:
                pending.cancel()
            del self._waiting[key]
            if not self._waiting:
                loop.remove_reader(self._mailbox.fileno())

    def _take(self) -> None:
        for key, answer in self._mailbox.take():
            future = self._waiting.get(key)
            if future is None or future.done():
                continue  # was cancelled
            if isinstance(answer, Exception):
                future.set_exception(answer)
            else:
                future.set_result(answer)


_hubs: weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, _Hub] = weakref.WeakKeyDictionary()


async def lookup_async(
    self: _core.Client,
    a: str,
    b: str,
    at: _Instant | None = None,
    *,
    timeout: _Duration | None = None,
    extrapolate: _Duration = 0.0,
    age_noise_until: _Instant | None = None,
    order: Literal[2, 4] = 2,
    believed_at: _Instant | None = None,
) -> _core.StampedTransform:
    """X_AB, as lookup(), for asyncio: `X = await client.lookup_async(a, b)`.

    Waits for missing frames and data, up to timeout [s] (None: the client's). Thousands may wait at once. If the task
    is cancelled, so is the lookup.
    """
    loop = asyncio.get_running_loop()
    hub = _hubs.get(loop)
    if hub is None:
        hub = _hubs[loop] = _Hub()
    return await hub.lookup(self, a, b, at, timeout, extrapolate, age_noise_until, order, believed_at)


# Those who wait for a mailbox, by its descriptor: a loop has one reader for each.
_readers: weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, dict[int, list[asyncio.Future[None]]]] = (
    weakref.WeakKeyDictionary()
)


async def _until_readable(mailbox: _core._Mailbox) -> None:
    loop = asyncio.get_running_loop()
    readers = _readers.setdefault(loop, {})
    fd = mailbox.fileno()
    readable: asyncio.Future[None] = loop.create_future()
    waiting = readers.setdefault(fd, [])

    def wake() -> None:
        for one in waiting:
            if not one.done():
                one.set_result(None)

    if not waiting:
        loop.add_reader(fd, wake)
    waiting.append(readable)
    try:
        await readable
    finally:
        waiting.remove(readable)
        if not waiting:
            loop.remove_reader(fd)
            del readers[fd]


def _deadline(timeout: _Duration | None) -> float:
    return math.inf if timeout is None else time.monotonic() + _core._seconds(timeout, "timeout")


class Events:
    """Changes of the structure, in order: `for change in client.events()`, or `async for`.

    Those that come while nobody waits are kept. It ends when it or the client is closed.
    """

    def __init__(self, client: _core.Client) -> None:
        self._mailbox = _core._Mailbox()
        self._changes: list[_core.Change] = []  # taken, but not returned yet; the oldest last
        self._subscription = client._subscribe(self._mailbox)

    def close(self) -> None:
        """Nothing more comes; a loop over it ends."""
        self._subscription.close()
        self._mailbox.end()

    def __enter__(self) -> Events:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def get(self, timeout: _Duration | None = None) -> _core.Change | None:
        """The next change; None after timeout [s] (None: without limit), or if nothing more comes."""
        deadline = _deadline(timeout)
        while (change := self._next()) is None and not self._mailbox.ended:
            left = deadline - time.monotonic()
            if left < 0:
                break
            # In slices: a signal just before the call would not end it.
            select.select([self._mailbox], [], [], min(left, 0.1))
        return change

    def __iter__(self) -> Events:
        return self

    def __next__(self) -> _core.Change:
        while (change := self.get()) is None:
            if self._mailbox.ended:
                raise StopIteration
        return change

    def __aiter__(self) -> Events:
        return self

    async def __anext__(self) -> _core.Change:
        while (change := self._next()) is None:
            if self._mailbox.ended:
                raise StopAsyncIteration
            await _until_readable(self._mailbox)
        return change

    def _next(self) -> _core.Change | None:
        if not self._changes:
            self._changes = self._mailbox.take()[::-1]
        return self._changes.pop() if self._changes else None


def events(self: _core.Client) -> Events:
    """The later changes of the structure, to loop over, with or without asyncio."""
    return Events(self)


async def _news(watch: _core.PathWatch) -> collections.abc.AsyncIterator[_core.StampedTransform]:
    """The newest transform of a watch, each time that there is another one."""
    mailbox = _core._Mailbox()
    listening = watch._listen(mailbox)
    try:
        seen, told = -1, None
        while not mailbox.ended:
            mailbox.take()
            messages = watch.messages
            if messages != seen:
                seen = messages
                newest = watch.latest()
                if newest != told:
                    told = newest
                    yield newest
            else:
                await _until_readable(mailbox)
    finally:
        listening.close()


for _class, _name, _method in (
    (_core.Client, "lookup_async", lookup_async),
    (_core.Client, "events", events),
    (_core.PathWatch, "__aiter__", _news),
):
    setattr(_class, _name, _method)
