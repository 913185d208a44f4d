"""What tests wait with, instead of sleeping."""

from __future__ import annotations

import collections.abc
import time


def eventually(condition: collections.abc.Callable[[], bool], seconds: float = 10) -> bool:
    """Whether the condition holds, at the latest after `seconds`. Changes reach other participants a little later."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.002)
    return True
