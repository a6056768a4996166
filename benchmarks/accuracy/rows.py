"""The parts of a table: rows that are measured trial by trial, and the text about them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

__all__ = ["Claim", "Figures", "Kept", "Part", "Row", "Section"]

Figures = dict[str, float | None]
"""The raw figures of one trial by name, as kept on disk; None if there is no figure (no pose)."""

Kept = Mapping[str, Sequence[Figures]]
"""The figures of each row's trials, in order of the trial's number, by the row's key."""


@dataclass(frozen=True, slots=True)
class Row:
    """One row.

    Attributes:
        key: unique, and usable as a file name.
        trials: the number of trials wanted.
        measure: returns the figures of a trial given its number; a module's function or a partial, so that it can be pickled.
    """

    key: str
    trials: int
    measure: Callable[[int], Figures]


@dataclass(frozen=True, slots=True)
class Claim:
    """An aim, what was measured, and whether it was met."""

    aim: str
    measured: str
    verdict: str


@dataclass(frozen=True, slots=True)
class Part:
    """A table.

    Attributes:
        title: heading; may be empty.
        head: column headings.
        cells: row by row.
    """

    title: str
    head: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class Section:
    """One question and its answer.

    Attributes:
        title: the question.
        text: how it was measured.
        parts: the tables.
        claims: the aims.
    """

    title: str
    text: str
    parts: tuple[Part, ...]
    claims: tuple[Claim, ...]
