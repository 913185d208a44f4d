"""For asyncio: a Client whose calls are awaited.

    from tfdude import aio

    async with aio.Client() as client:
        X = await client.lookup("map", "hand", timeout=5)
        async for X in await client.watch("map", "hand"):
            ...

Lookups wait without a thread, thousands at once, and end with their task. Each other call has a thread meanwhile, up to
256 at once. When its task is cancelled, its wait ends within 0.1 s; a change that is under way goes on.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import functools
from typing import TYPE_CHECKING, Any, Callable, TypeVar

from . import _core
from ._aio import Events, lookup_async

if TYPE_CHECKING:
    from ._core import _Duration, _Instant

_T = TypeVar("_T")

# Of the other calls at once. Threads are made when they are needed, so that a call that waits holds up no other.
_MOST_THREADS = 256

# What is answered from this process's memory, or returns at once, needs no thread.
_AT_ONCE = frozenset({"close", "closed", "events", "on_change", "partition", "own_frames"})


class Client:
    """All functions of tfdude.Client, or of a Node, as coroutines of the same names and arguments.

    client: one that is open already, which stays open; otherwise it is opened with these options, and closed at the
    end.
    """

    def __init__(self, client: _core.Client | None = None, **options: Any) -> None:
        self._owns = client is None
        self._client = _core.Client(**options) if client is None else client
        self._pool = concurrent.futures.ThreadPoolExecutor(_MOST_THREADS, thread_name_prefix="tfdude-aio")

    @property
    def sync(self) -> _core.Client:
        """The client itself, whose calls are not awaited."""
        return self._client

    async def lookup(
        self,
        a: str,
        b: str,
        at: _Instant | None = None,
        *,
        timeout: _Duration | None = None,
        extrapolate: _Duration = 0.0,
        age_noise_until: _Instant | None = None,
        order: Any = 2,
        believed_at: _Instant | None = None,
    ) -> _core.StampedTransform:
        """As lookup_async(): waits up to timeout [s] (None: the client's), without a thread."""
        return await lookup_async(
            self._client,
            a,
            b,
            at,
            timeout=timeout,
            extrapolate=extrapolate,
            age_noise_until=age_noise_until,
            order=order,
            believed_at=believed_at,
        )

    def events(self) -> Events:
        """As tfdude.Client.events(), for `async for`."""
        return Events(self._client)

    async def close(self) -> None:
        """Closes the client, if this has opened it."""
        if self._owns:
            await self._run(self._client.close)
        self._pool.shutdown(wait=False)

    async def __aenter__(self) -> Client:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        function = getattr(self._client, name)
        if name in _AT_ONCE or not callable(function):
            return function

        @functools.wraps(function)
        async def call(*args: Any, **kwargs: Any) -> Any:
            return await self._run(functools.partial(function, *args, **kwargs))

        return call

    async def _run(self, function: Callable[[], _T]) -> _T:
        call = _core._Call()
        try:
            return await asyncio.get_running_loop().run_in_executor(self._pool, call.run, function)
        except asyncio.CancelledError:
            call.end()
            raise
