"""One number as displayed."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

Level: TypeAlias = Literal["plain", "good", "warning"]


@dataclass(frozen=True, slots=True)
class Figure:
    """One number as displayed.

    Attributes:
        key: for programs, such as "aed"; stable.
        label: for display, such as "average distance (AED)".
        value: formatted, with its standard deviation if that is known: "12.4", "0.31 ± 0.08".
        unit: such as "px"; "" if it has none.
        hint: one sentence that explains the number, shown on hover.
        level: whether it needs attention.
    """

    key: str
    label: str
    value: str
    unit: str
    hint: str
    level: Level = "plain"
