"""What a person is told of a value with a code, and the rows that say it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from calib_core.measurements import DataWarning, Unpaired, Unsolvable
from calib_core.results.actions import Action
from calib_core.words.text import Words, words


@dataclass(frozen=True, slots=True)
class Remark:
    """What a person is told.

    Attributes:
        message: what is wrong, with figures; a phrase without a full stop.
        hint: what to do about it, likewise.
        action: the same as a value; None if no other part of the program can begin it.
    """

    message: Words
    hint: Words
    action: Action | None = None


Row: TypeAlias = Callable[..., Remark]


def remark(message: Words | str, hint: Words | str, action: Action | None = None) -> Remark:
    """Return a remark, from text or words."""
    return Remark(words(message), words(hint), action)


def by_code(*rows: Row) -> Mapping[str, Row]:
    """Return rows by their codes, which are their names with hyphens."""
    return {row.__name__.replace("_", "-"): row for row in rows}


def by_row(stated: DataWarning | Unpaired | Unsolvable, rows: Mapping[str, Row]) -> Remark:
    """Return what the row of its code says, or what was reported with it."""
    if "message" in stated.facts:
        return remark(stated.facts["message"], stated.facts["hint"])
    return rows[stated.code](**stated.facts)
