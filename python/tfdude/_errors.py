"""The exceptions of tfdude, with the names of tf2 where the meaning is the same."""

from __future__ import annotations


class TransformException(Exception):
    """The base of all errors of tfdude.

    code: what a caller can do about it, such as 'not_yet'; the same names as in JSON of the command line.
    frame, partition: which it is about, or None.
    available: of 'not_yet' and 'too_old', from when to when all dynamic edges have data [ns]; None if they have no
    instant in common, or if another process has answered by a message, whose text says it.
    """

    def __init__(
        self,
        code: str,
        message: str,
        frame: str | None = None,
        partition: str | None = None,
        available: tuple[int, int] | None = None,
    ) -> None:
        super().__init__(message)
        self.code = code
        self.frame = frame
        self.partition = partition
        self.available = available

    def __reduce__(
        self,
    ) -> tuple[type[TransformException], tuple[str, str, str | None, str | None, tuple[int, int] | None]]:
        return type(self), (self.code, str(self), self.frame, self.partition, self.available)


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


def make(
    code: str,
    message: str,
    frame: str | None = None,
    partition: str | None = None,
    available: tuple[int, int] | None = None,
) -> TransformException:
    """The exception for an error of the library."""
    return _BY_CODE.get(code, TransformException)(code, message, frame, partition, available)
