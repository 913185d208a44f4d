"""What objects of the library look like at a prompt."""

from __future__ import annotations

from typing import Any, Callable

from . import _core

# The properties that say most.
_SHOWN: dict[type[Any], tuple[str, ...]] = {
    _core.Client: ("closed",),
    _core.Config: ("partition", "frames"),
    _core.EdgeConsistency: ("id", "observations", "refused", "squares", "expected"),
    _core.EdgesWatch: ("messages",),
    _core.Frame: ("id", "parent", "partition", "attached"),
    _core.FrameSpec: ("id", "parent", "X_PC", "joint"),
    _core.Geodetic: ("latitude", "longitude", "altitude"),
    _core.GeodeticPose: ("place", "utm", "X_NB"),
    _core.HistoryInfo: ("id", "samples", "oldest", "newest", "mean_gap", "max_gap"),
    _core.Joint: ("name", "type", "position", "variance"),
    _core.JointInfo: ("name", "frame", "position", "variance", "measured"),
    _core.Node: ("partition", "closed"),
    _core.Observed: ("accepted", "distance_squared", "limit", "corrected", "stamp"),
    _core.PartitionInfo: ("name", "host", "pid", "frames", "reachable"),
    _core.PathWatch: ("messages",),
    _core.PathSegment: ("partition", "start", "end"),
    _core.Recording: ("instant",),
    _core.RecordingSummary: ("start", "end", "bytes", "finished", "problems"),
    _core.Utm: ("zone", "north", "easting", "northing", "altitude"),
    _core.Velocity: ("linear", "angular", "complete", "begin", "end"),
}


def _repr_of(names: tuple[str, ...]) -> Callable[[Any], str]:
    def __repr__(self: Any) -> str:
        values = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"{type(self).__name__}({values})"

    return __repr__


def _with_stamp(self: _core.StampedTransform) -> str:
    """As of a Transform, and the instant: None holds for all times."""
    return f"{_core.Transform.__repr__(self)[:-1]}, stamp={self.stamp})"


for _class, _names in _SHOWN.items():
    setattr(_class, "__repr__", _repr_of(_names))
setattr(_core.StampedTransform, "__repr__", _with_stamp)
