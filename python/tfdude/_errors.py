"""The exceptions of tfdude, with the names of tf2 where the meaning is the same."""

from __future__ import annotations

import re


class TransformException(Exception):
    """The base of all errors of tfdude.

    code: what a caller can do about it, such as 'not_yet'; the same names as in JSON of the command line.
    frame, partition: the first ones that the message names, or None.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.frame = _named("(?:frames?|edge of)", message)
        self.partition = _named("partition", message)

    def __reduce__(self) -> tuple[type[TransformException], tuple[str, str]]:
        return type(self), (self.code, str(self))


class LookupException(TransformException, LookupError):
    """There is no frame, partition or joint of that name."""


class ConnectivityException(TransformException):
    """The two frames have no common root."""


class ExtrapolationException(TransformException):
    """An edge has no data for that instant: not yet ('not_yet'), or no longer ('too_old')."""


class InvalidArgumentException(TransformException, ValueError):
    """A value breaks its rule; the message names the field."""


class TimeoutException(TransformException, TimeoutError):
    """There was no answer in time; the message names who did not answer."""


class UnreachableException(TransformException, ConnectionError):
    """A partition concerned is known to be down."""


class UnspecifiedCovariance(TransformException):
    """A covariance was asked for that nobody has stated in full; the message names the edges."""


_BY_CODE: dict[str, type[TransformException]] = {
    "invalid_input": InvalidArgumentException,
    "ambiguous_joint": InvalidArgumentException,
    "unknown_frame": LookupException,
    "unknown_start": LookupException,
    "unknown_end": LookupException,
    "unknown_parent": LookupException,
    "unknown_partition": LookupException,
    "unknown_joint": LookupException,
    "not_connected": ConnectivityException,
    "not_yet": ExtrapolationException,
    "too_old": ExtrapolationException,
    "timeout": TimeoutException,
    "unreachable": UnreachableException,
}


def _named(what: str, message: str) -> str | None:
    match = re.search(rf"\b{what} '([^']*)'", message)
    return match[1] if match else None


def make(code: str, message: str) -> TransformException:
    """The exception for an error of the library."""
    return _BY_CODE.get(code, TransformException)(code, message)
