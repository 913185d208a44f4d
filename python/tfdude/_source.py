"""One interface over what answers lookups."""

from __future__ import annotations

import abc
from typing import TYPE_CHECKING

from . import _core, _errors

if TYPE_CHECKING:
    from ._core import _Duration, _Instant


class FrameSource(abc.ABC):
    """What answers lookups, so that an algorithm is written once: for the robot, a recording, or watched edges.

        def height(frames: tfdude.FrameSource, at=None):
            return frames.lookup("map", "hand", at).translation[2]

        height(tfdude.FrameSource.of(client))
        height(tfdude.FrameSource.of(tfdude.Recording("robot.mcap")), stamp)

    A test opens a Node with a LoopbackNetwork, or derives a class of its own, of which lookup() is enough.
    """

    @staticmethod
    def of(source: _core.Client | _core.Recording | _core.EdgesWatch | FrameSource) -> FrameSource:
        """A client or node, a recording, watched edges; or what is a FrameSource already."""
        if isinstance(source, FrameSource):
            return source
        if isinstance(source, _core.Client):
            return _ClientSource(source)
        if isinstance(source, _core.Recording):
            return _RecordingSource(source)
        if isinstance(source, _core.EdgesWatch):
            return _WatchSource(source)
        kind = type(source).__name__
        raise TypeError(f"source must be a Client, Recording, EdgesWatch or FrameSource, not {kind}")

    @abc.abstractmethod
    def lookup(self, a: str, b: str, at: _Instant | None = None, *, timeout: _Duration = 0.0) -> _core.StampedTransform:
        """X_AB, as Client.lookup(). timeout [s]: for missing frames and data.

        Of a recording: at the instant that it shows; with `at`, as Recording.lookup_at(), and the timeout says how much
        of it is read on (0: 10 s). Watched edges do not wait.
        """

    def lookup_full(
        self, a: str, at_a: _Instant, b: str, at_b: _Instant, fixed: str, *, timeout: _Duration = 0.0
    ) -> _core.StampedTransform:
        """As Client.lookup_full(). Raises 'unsupported' if this source cannot."""
        raise _errors.make("unsupported", "this source only answers lookups at one time")

    def frames(self) -> list[_core.Frame]:
        """The frames that are known. Raises 'unsupported' if this source cannot."""
        raise _errors.make("unsupported", "this source does not tell its frames")


class _ClientSource(FrameSource):
    def __init__(self, client: _core.Client) -> None:
        self._client = client

    def lookup(self, a: str, b: str, at: _Instant | None = None, *, timeout: _Duration = 0.0) -> _core.StampedTransform:
        return self._client.lookup(a, b, at, timeout=timeout)

    def lookup_full(
        self, a: str, at_a: _Instant, b: str, at_b: _Instant, fixed: str, *, timeout: _Duration = 0.0
    ) -> _core.StampedTransform:
        return self._client.lookup_full(a, at_a, b, at_b, fixed, timeout=timeout)

    def frames(self) -> list[_core.Frame]:
        return self._client.frames()


class _RecordingSource(FrameSource):
    def __init__(self, recording: _core.Recording) -> None:
        self._recording = recording

    def lookup(self, a: str, b: str, at: _Instant | None = None, *, timeout: _Duration = 0.0) -> _core.StampedTransform:
        if at is None:
            return self._recording.lookup(a, b)
        if not timeout:
            return self._recording.lookup_at(a, b, at)
        return self._recording.lookup_at(a, b, at, timeout=timeout)

    def lookup_full(
        self, a: str, at_a: _Instant, b: str, at_b: _Instant, fixed: str, *, timeout: _Duration = 0.0
    ) -> _core.StampedTransform:
        return self._recording.lookup_full(a, at_a, b, at_b, fixed)

    def frames(self) -> list[_core.Frame]:
        return self._recording.frames()


class _WatchSource(FrameSource):
    def __init__(self, edges: _core.EdgesWatch) -> None:
        self._edges = edges

    def lookup(self, a: str, b: str, at: _Instant | None = None, *, timeout: _Duration = 0.0) -> _core.StampedTransform:
        return self._edges.lookup(a, b, at)
