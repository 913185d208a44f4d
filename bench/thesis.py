"""The thesis's chapter 5 as data: the cases of its figures, and its results for each.

The thesis prints medians for one plot only (5.10). For the others its text gives a ratio, a difference, or another case
that is similar.
"""

import dataclasses
import typing


@dataclasses.dataclass(frozen=True)
class Case:
    """A figure of the thesis, or an additional case. In the thesis main owned the connector; here arms owns it."""

    figure: str           # in the thesis; empty: an additional case
    key: str              # thesis/KEY/centralized and thesis/KEY/decentralized
    title: str
    kind: str             # whose frames: own, other, or across
    ratio: typing.Optional[float] = None  # in the thesis, centralized / decentralized
    words: str = ""       # the thesis's result in words
    medians: tuple = ()   # [us] centralized, decentralized


CASES = (
    Case("5.1", "add_own/robot", "add, own process", "own", 3.0, "about three times as fast"),
    Case("5.2", "add_other/robot", "add, other process", "other", 0.5,
         "six times its add in the own process"),
    Case("5.3", "remove_own/robot", "remove, own process", "own", None, "like add"),
    Case("5.4", "remove_other/robot", "remove, other process", "other", None, "like add"),
    Case("5.5", "path_across/robot", "path across both", "across", 0.5, "about double the time"),
    Case("5.6", "path_other/arms", "path in other, from arms", "other", None, "15 µs faster"),
    Case("5.7", "path_own/robot", "path in own process", "own", None, "nearly 80 µs faster"),
    Case("5.8", "update_other/robot", "update, other process", "other", 0.83, "12 µs slower"),
    Case("5.9", "update_own/arms", "update, own, in arms", "own", None, "like 5.10"),
    Case("5.10", "update_own/robot", "update, own, in robot", "own", 57.597 / 14.022,
         "medians 57.597 and 14.022 µs", (57.597, 14.022)),
    Case("5.11", "update_connector/arms", "update connector, by owner", "own", None,
         "better than 5.10"),
    Case("5.11", "update_connector/robot", "update connector, by other", "other", None,
         "better than 5.10"),
    Case("", "path_other/robot", "path in other, from robot", "other"),
    # Cases that the thesis measured in one of the processes, here in the other one.
    Case("", "add_own/arms", "add, own, in arms", "own"),
    Case("", "add_other/arms", "add, other, in arms", "other"),
    Case("", "remove_own/arms", "remove, own, in arms", "own"),
    Case("", "remove_other/arms", "remove, other, in arms", "other"),
    Case("", "path_across/arms", "path across both, in arms", "across"),
    Case("", "path_own/arms", "path in own, in arms", "own"),
    Case("", "update_other/arms", "update, other, in arms", "other"),
)

CALLS = 300_000  # for each case
# Table 5.1: bytes of request and reply by the key of our operation.
SIZES = {"add": (364, 1), "remove": (10, 1), "lookup_other": (20, 345), "update": (354, 1)}
WORST_CASE_PER_PROCESS = 365
