"""Messages with stamps, held back until the transform of their frame can be had."""

from __future__ import annotations

import collections
import collections.abc
import select
import threading
import time
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from . import _core, _errors
from ._aio import _deadline, _until_readable

if TYPE_CHECKING:
    from ._core import _Duration, _Instant

Message = TypeVar("Message")


class _Waiting(Generic[Message]):
    __slots__ = ("answer", "lookup", "message")

    def __init__(self, message: Message) -> None:
        self.message = message
        self.lookup: _core._PendingLookup | None = None
        self.answer: _core.StampedTransform | _errors.TransformException | None = None


class MessageFilter(Generic[Message]):
    """Holds messages back until their transform can be had, as tf2_ros.MessageFilter.

        filter = tfdude.MessageFilter(client, "map")
        filter.push(scan, "lidar", stamp)             # in any thread
        for scan, X in filter:                        # or: async for
            ...

    target: the frame in which each message's frame is wanted. max_age [s]: how long a message waits. most: messages
    that wait for their transform, and as many again for who asks; one more drops the oldest. in_order: as pushed;
    otherwise each as soon as its transform can be had. on_dropped(message, error): called by the thread that asks for
    messages, once for each that is dropped, but the last `most` of them only: its age (the error says what was
    missing), the number ('too_much'), or data that is no longer kept.

    A loop ends when close() was called and nothing waits any more.
    """

    def __init__(
        self,
        client: _core.Client,
        target: str,
        *,
        max_age: _Duration = 1.0,
        most: int = 100,
        in_order: bool = False,
        extrapolate: _Duration = 0.0,
        on_dropped: collections.abc.Callable[[Message, _errors.TransformException], object] | None = None,
    ) -> None:
        if _core._seconds(max_age, "max_age") < 0:
            raise ValueError("max_age must not be negative")
        self._client = client
        self._query: tuple[Any, ...] = (max_age, extrapolate, None, 2)
        self._target = target
        self._most = max(most, 1)
        self._in_order = in_order
        self._on_dropped = on_dropped
        self._mailbox = _core._Mailbox()
        # By key, in the order in which they were pushed.
        self._waiting: collections.OrderedDict[int, _Waiting[Message]] = collections.OrderedDict()
        self._collecting = threading.Lock()
        self._ready: collections.deque[_Waiting[Message]] = collections.deque()
        self._dropped: collections.deque[_Waiting[Message]] = collections.deque(maxlen=self._most)
        self._key = 0
        self._closed = False

    def push(self, message: Message, frame: str, stamp: _Instant) -> None:
        """Passes a message on as soon as its transform is there. Does not wait."""
        if self._closed:
            raise ValueError("the filter is closed")
        if len(self._waiting) >= self._most:
            self._collect()
            if self._ready:
                self._mailbox.wake()  # whoever waits for what was taken here
        entry = _Waiting(message)
        with self._collecting:
            self._key += 1
            key = self._key
            self._waiting[key] = entry
        max_age, *rest = self._query
        try:
            entry.lookup = self._client._start_lookup(
                self._mailbox, key, self._target, frame, stamp, max_age, *rest
            )
        except BaseException:
            with self._collecting:
                self._waiting.pop(key, None)
            raise
        with self._collecting:
            if len(self._waiting) <= self._most:
                return
            _, oldest = self._waiting.popitem(last=False)
            self._displaced(oldest)
        self._mailbox.wake()

    def __len__(self) -> int:
        """The number of messages that wait."""
        return len(self._waiting)

    def _full(self) -> bool:
        self._collect()
        return len(self._waiting) >= self._most

    def close(self) -> None:
        """Nothing more is pushed; a loop ends after what waits."""
        self._closed = True
        self._mailbox.wake()

    def get(self, timeout: _Duration | None = None) -> tuple[Message, _core.StampedTransform] | None:
        """The next message and its transform; None after timeout [s] (None: without limit), or if nothing comes."""
        deadline = _deadline(timeout)
        while (found := self._next()) is None and not self._over():
            left = deadline - time.monotonic()
            if left < 0:
                break
            select.select([self._mailbox], [], [], min(left, 0.1))
        return found

    def __iter__(self) -> collections.abc.Iterator[tuple[Message, _core.StampedTransform]]:
        while (found := self.get()) is not None:
            yield found

    async def __aiter__(self) -> collections.abc.AsyncIterator[tuple[Message, _core.StampedTransform]]:
        while True:
            found = self._next()
            if found is not None:
                yield found
            elif self._over():
                self._mailbox.wake()  # other loops, which wait for what this one has taken
                return
            else:
                await _until_readable(self._mailbox)

    def _over(self) -> bool:
        return (self._closed or self._client.closed) and not (self._waiting or self._ready or self._dropped)

    def _done(self, entry: _Waiting[Message]) -> None:
        if entry.lookup is not None:
            entry.lookup.cancel()
        if isinstance(entry.answer, _core.StampedTransform):
            self._ready.append(entry)
            if len(self._ready) > self._most:
                self._displaced(self._ready.popleft())
        elif self._on_dropped is not None:
            self._dropped.append(entry)

    def _displaced(self, entry: _Waiting[Message]) -> None:
        entry.answer = _errors.make("too_much", f"more than {self._most} messages wait")
        self._done(entry)

    def _collect(self) -> None:
        """Takes what was answered. The threads that push and that get may both do so."""
        with self._collecting:
            for key, answer in self._mailbox.take():
                entry = self._waiting.get(key)
                if entry is None:
                    continue  # displaced
                entry.answer = answer
                if not self._in_order:
                    self._done(self._waiting.pop(key))
            while self._in_order and self._waiting:
                key, entry = next(iter(self._waiting.items()))
                if entry.answer is None:
                    break
                self._done(self._waiting.pop(key))

    def _next(self) -> tuple[Message, _core.StampedTransform] | None:
        self._collect()
        while (entry := self._first(self._dropped)) is not None:
            assert isinstance(entry.answer, _errors.TransformException) and self._on_dropped is not None
            self._on_dropped(entry.message, entry.answer)
        if (entry := self._first(self._ready)) is None:
            return None
        assert isinstance(entry.answer, _core.StampedTransform)
        return entry.message, entry.answer

    def _first(self, of: collections.deque[_Waiting[Message]]) -> _Waiting[Message] | None:
        with self._collecting:
            return of.popleft() if of else None


def filter_messages(
    client: _core.Client,
    target: str,
    messages: collections.abc.Iterable[tuple[Message, str, _Instant]],
    **options: Any,
) -> collections.abc.Iterator[tuple[Message, _core.StampedTransform]]:
    """Yields (message, transform) for each (message, frame, stamp) of an iterable, as soon as it can be had.

    Messages are taken from the iterable one by one, and those that are ready are yielded in between; at its end, all
    that still wait. While as many as `most` wait, no further one is taken. options: as of MessageFilter.
    """
    waiting: MessageFilter[Message] = MessageFilter(client, target, **options)
    for message, frame, stamp in messages:
        while waiting._full():
            if (found := waiting.get(timeout=0.1)) is not None:
                yield found
        waiting.push(message, frame, stamp)
        while (found := waiting.get(timeout=0)) is not None:
            yield found
    waiting.close()
    yield from waiting
