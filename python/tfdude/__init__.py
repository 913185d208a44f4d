"""Coordinate frames with uncertainty, of a robot's processes and computers, over DDS.

    import tfdude

    client = tfdude.Client()
    X = client.lookup("map", "hand")    # the pose of hand in map
    X.matrix, X.covariance              # numpy arrays
    X @ X_hand_tool                     # composes, with covariance

Client asks for and changes frames, Node owns some, and Recording asks a file. Transform is a pose with covariance.
Instants are int [ns], float [s] or datetime with a time zone; durations are numbers [s] or timedelta. Lengths are in
metres, angles in radians. A covariance (6, 6) is that of the right perturbation, translation first, expressed in the
child frame. Errors are TransformException and its subclasses, which have tf2's names.
"""

from __future__ import annotations

from . import _broadcast, _repr, aio  # noqa: F401
from ._aio import Events
from ._core import (
    Batch,
    Cause,
    Change,
    Client,
    Cloud,
    Config,
    EdgeConsistency,
    EdgeStream,
    EdgesWatch,
    Explanation,
    Frame,
    FrameSpec,
    Geodetic,
    GeodeticPose,
    HistoryInfo,
    Joint,
    JointInfo,
    JointStream,
    LoopbackNetwork,
    Node,
    Observed,
    PartitionInfo,
    PathSegment,
    PathWatch,
    Points,
    Possible,
    Recording,
    RecordingSummary,
    StampedTransform,
    Subscription,
    Trajectory,
    Transform,
    Utm,
    Velocity,
    __version__,
    load_config,
    load_urdf,
    read_frames,
    write_frames,
)
from ._errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
    UnreachableException,
    UnspecifiedCovariance,
)
from ._filter import MessageFilter, filter_messages
from ._source import FrameSource

__all__ = [
    "Batch",
    "Cause",
    "Change",
    "Client",
    "Cloud",
    "Config",
    "ConnectivityException",
    "EdgeConsistency",
    "EdgeStream",
    "EdgesWatch",
    "Events",
    "Explanation",
    "ExtrapolationException",
    "Frame",
    "FrameSource",
    "FrameSpec",
    "Geodetic",
    "GeodeticPose",
    "HistoryInfo",
    "InvalidArgumentException",
    "Joint",
    "JointInfo",
    "JointStream",
    "LookupException",
    "LoopbackNetwork",
    "MessageFilter",
    "Node",
    "Observed",
    "PartitionInfo",
    "PathSegment",
    "PathWatch",
    "Points",
    "Possible",
    "Recording",
    "RecordingSummary",
    "StampedTransform",
    "Subscription",
    "TimeoutException",
    "Trajectory",
    "Transform",
    "TransformException",
    "UnreachableException",
    "UnspecifiedCovariance",
    "Utm",
    "Velocity",
    "__version__",
    "aio",
    "filter_messages",
    "load_config",
    "load_urdf",
    "read_frames",
    "write_frames",
]
