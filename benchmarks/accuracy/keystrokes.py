"""What does accuracy cost? The seconds of each way of marking by the keystroke-level model, beside the error it buys."""

from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.cases import Case
from benchmarks.accuracy.figures import column
from benchmarks.accuracy.rows import Kept, Part, Section

__all__ = ["WAYS", "Way", "section"]

_SECONDS = {"K": 0.28, "B": 0.20, "P": 1.10, "H": 0.40, "M": 1.35}
"""A key, a mouse button, pointing, moving the hand, and a thought: Card, Moran and Newell 1980 and 1983."""

_FIELDS = 5
"""Fields of the keyboard's cross to choose one after the other, each a third of the last: 960 px become 4 px."""


@dataclass(frozen=True, slots=True)
class Way:
    """A way of marking placements.

    Attributes:
        name: for the table.
        once: the operators at the start.
        each: the operators of a placement.
        by_hand: how many placements at the start are marked by mouse, because nothing can be expected yet.
    """

    name: str
    once: str
    each: str
    by_hand: int = 0

    def operators(self, placements: int) -> str:
        """Return all operators for some placements."""
        first = min(self.by_hand, placements)
        begun = _MOUSE.operators(first) if first else ""
        return begun + self.once + self.each * (placements - first)

    def keys(self, placements: int) -> int:
        """Count the key presses."""
        return self.operators(placements).count("K")

    def clicks(self, placements: int) -> int:
        """Count the mouse clicks."""
        return self.operators(placements).count("B")

    def seconds(self, placements: int) -> float:
        """Return the time of an expert who makes no mistakes [s]."""
        return float(sum(_SECONDS[one] for one in self.operators(placements)))


_MOUSE = Way("N, then the mouse", "H", "KMPB")
WAYS = (
    _MOUSE,
    Way("keys alone: N, fields, Enter", "K", "K" + _FIELDS * "MK" + "K"),
    Way("four by mouse; then N, guess, snap: N, Enter, Enter, S", "", "KKKMK", by_hand=4),
)
"""The page's ways. The mouse hand stays at the mouse while the other presses N. Enter, Enter sets the mark where the reflector is
expected; S moves it to the apex in the picture, and only then does it count."""

_COUNTS = (6, 10, 20, 40)
_TEXT = f"""Seconds by the keystroke-level model (Card, Moran and Newell, Communications of the ACM 23, 1980; operators as in
their book of 1983): a key {_SECONDS["K"]} s (average typist, 40 words per minute), a mouse button {_SECONDS["B"]} s, pointing
{_SECONDS["P"]} s, moving a hand {_SECONDS["H"]} s, and {_SECONDS["M"]} s of thought for finding the reflector, for each choice
of a field, or for judging a guess. It is the time of somebody who knows the page and makes no mistakes, without the
computer's; no person was timed. The errors are the RMSE of the rows above with 10 % wrong pairs, field scene, camera position
not measured. They depend on the number of placements only: every way is given the same 2 px of noise, which is pessimistic for
a mark that was snapped."""


def section(kept: Kept) -> Section:
    """Write what each way takes, and the error with that many placements."""
    cells = []
    for count in _COUNTS:
        errors = [_errors(kept, Case(noise, count, 0.1, tape_m=None)) for noise in ("ti", "imaging")]
        if not any(errors):
            continue
        for way in WAYS:
            costs = (str(way.keys(count)), str(way.clicks(count)), f"{way.seconds(count):.0f}")
            cells.append((str(count), way.name, *costs, *(error or "-" for error in errors)))
    head = ("placements", "way", "keys", "clicks", "seconds", "`ti`", "`imaging`")
    return Section("What does accuracy cost in keys, clicks and seconds?", _TEXT, (Part("", head, tuple(cells)),), ())


def _errors(kept: Kept, case: Case) -> str:
    trials = kept.get(f"ours-{case.key}", ())
    if not trials:
        return ""
    rotation, position = (np.sqrt(np.nanmean(column(trials, name) ** 2)) for name in ("rotation_rad", "position_m"))
    return f"{np.rad2deg(rotation):.2f} deg, {100 * position:.1f} cm ({len(trials)} trials)"
