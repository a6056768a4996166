"""What is measured trial by trial, and what a question's answer consists of."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

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
        draws: rows with another number never have the same draws, so that their shares can be pooled.
    """

    key: str
    trials: int
    measure: Callable[[int], Figures]
    draws: int = 0


@dataclass(frozen=True, slots=True)
class Claim:
    """An aim, what was measured, and whether it was met."""

    aim: str
    measured: str
    verdict: str


@dataclass(frozen=True, slots=True)
class Section:
    """One question and its answer.

    Attributes:
        title: the question.
        text: how it was measured.
        claims: the aims, the table of the page.
        rows: the detailed table, a file beside the benchmark; each row has the same columns.
        outside: rows where the stated 95 % does not hold, with the share inside.
    """

    title: str
    text: str
    claims: tuple[Claim, ...]
    rows: tuple[Mapping[str, str], ...] = ()
    outside: tuple[str, ...] = ()
