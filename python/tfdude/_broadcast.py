"""What broadcasters of tf2 do in one call."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import _core, _errors

if TYPE_CHECKING:
    from ._core import _Instant


def ensure(
    self: _core.Client,
    id: str,
    parent: str,
    X_PC: _core.Transform,
    stamp: _Instant | None = None,
    partition: str = "",
) -> None:
    """Sees to it that a frame exists, has this parent, and its edge this value, as a broadcaster of tf2 does.

    Adds the frame if it does not exist, moves it if it has another parent, and otherwise updates its edge. partition:
    the owner of a frame that is added; empty: the parent's owner. If others add or remove the frame at the same time,
    it is tried again, twice.
    """
    for attempt in range(3):
        try:
            known: str | None = self.parent(id)
        except _errors.LookupException:
            known = None
        try:
            if known is None:
                self.add(id, parent, X_PC, partition)
            elif known != parent:
                self.move(id, parent, X_PC)
            if known == parent or stamp is not None:
                self.update(id, X_PC, stamp)
            return
        except _errors.TransformException as error:
            if attempt == 2 or error.code not in ("already_exists", "unknown_frame"):
                raise


setattr(_core.Client, "ensure", ensure)
