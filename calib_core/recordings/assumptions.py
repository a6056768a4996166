"""What a recording does not state and reading it takes for granted: units, signs, and what a field means."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.results import DataWarning

__all__ = ["Assumption", "about_assumptions"]


@dataclass(frozen=True, slots=True)
class Assumption:
    """One unit, sign, order or meaning that the file does not state.

    Attributes:
        key: short and stable, such as "angle-unit", "azimuth-sign", "axes", "length-unit", "speed-unit", "time-unit" or
            "field-meaning".
        topic: the topic it is about.
        text: what is assumed and why, as a sentence without its final period.
        confirm: the options that state it, such as "--map x=posX:m" or "--radar-axes forward,left,up".
    """

    key: str
    topic: str
    text: str
    confirm: str


def about_assumptions(assumptions: Sequence[Assumption]) -> list[DataWarning]:
    """Warn about each unconfirmed assumption."""
    return [
        DataWarning(
            "assumed",
            f"{one.topic}: {one.text}",
            f"if that is right, confirm it with {one.confirm} or --confirm-assumptions; otherwise state what is right",
        )
        for one in assumptions
    ]
