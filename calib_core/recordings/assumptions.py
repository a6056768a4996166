"""What a recording does not state and reading it takes for granted: units, signs, and what a field means."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.measurements import DataWarning

CONFIRM_ALL = "--confirm-assumptions"
"""The option that confirms every assumption, and the only one for some."""


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

    @property
    def words(self) -> str:
        """The text with its topic."""
        return f"{self.topic}: {self.text}"


@dataclass(frozen=True, slots=True)
class StatedAssumption:
    """An assumption, and whether the user has confirmed it."""

    assumption: Assumption
    confirmed: bool


def about_assumptions(assumptions: Sequence[Assumption]) -> list[DataWarning]:
    """Warn about each unconfirmed assumption."""
    return [DataWarning("assumed", one.words, assumption_hint(one.confirm)) for one in assumptions]


def assumption_hint(confirm: str) -> str:
    """Return what to do about an assumption, given the options that state it."""
    options = " or ".join(dict.fromkeys((confirm, CONFIRM_ALL)))
    return f"if that is right, confirm it with {options}; otherwise state what is right"
