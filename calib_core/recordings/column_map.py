"""The user's --map: which column of a radar's messages or file holds which quantity, in which unit and with which sign."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from calib_core.errors import OptionError

__all__ = ["QUANTITIES", "UNITS", "MappedColumn", "parse_column_map"]

_LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0}
_ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "mrad": 0.001}
_SPEEDS = {"mps": 1.0, "kmh": 1 / 3.6, "kph": 1 / 3.6, "cmps": 0.01}
_DECIBELS = {"db": 1.0, "dbsm": 1.0, "dbm": 1.0}
_TIMES = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}

UNITS: Mapping[str, Mapping[str, float]] = {
    "x": _LENGTHS, "y": _LENGTHS, "z": _LENGTHS, "range": _LENGTHS, "azimuth": _ANGLES, "elevation": _ANGLES,
    "doppler": _SPEEDS, "amplitude": _DECIBELS, "time": _TIMES,
    "sigma_range": _LENGTHS, "sigma_azimuth": _ANGLES, "sigma_elevation": _ANGLES,
}  # fmt: skip
"""Units of each quantity, and the factor to m, rad, m/s, dB or ns. The first is the one that is assumed."""

QUANTITIES: tuple[str, ...] = tuple(UNITS)
_WORDS = re.compile(r"(?P<quantity>\w+)=(?P<minus>-?)(?P<column>[^:=]+)(?::(?P<unit>\w+))?")
_EXAMPLE = "for example --map x=posX:m, or --map azimuth=-theta:deg where the message counts it to the right"


@dataclass(frozen=True, slots=True)
class MappedColumn:
    """One --map.

    Attributes:
        quantity: one of QUANTITIES.
        column: the field or column, as the recording spells it; nested fields dotted.
        unit: a key of UNITS[quantity]; "" if not given.
        sign: -1 where the column's values have the opposite sign.
    """

    quantity: str
    column: str
    unit: str = ""
    sign: int = 1

    @property
    def scale(self) -> float:
        """The factor to m, rad, m/s, dB or ns, with the sign."""
        return self.sign * (UNITS[self.quantity][self.unit] if self.unit else 1.0)

    @property
    def words(self) -> str:
        """The value of --map."""
        minus = "-" if self.sign < 0 else ""
        return f"{self.quantity}={minus}{self.column}" + (f":{self.unit}" if self.unit else "")


def parse_column_map(texts: Sequence[str]) -> tuple[MappedColumn, ...]:
    """Parse the values of --map, each QUANTITY=COLUMN, QUANTITY=COLUMN:UNIT or QUANTITY=-COLUMN:UNIT.

    Raises:
        OptionError: one is malformed, its quantity or unit is unknown, or a quantity is given twice.
    """
    columns: dict[str, MappedColumn] = {}
    for text in texts:
        match = _WORDS.fullmatch(text.strip())
        if match is None:
            raise OptionError(f"--map {text}: give QUANTITY=COLUMN:UNIT; {_EXAMPLE}")
        quantity, unit = match["quantity"].lower(), (match["unit"] or "").lower()
        if quantity not in UNITS:
            raise OptionError(f"--map {text}: unknown quantity '{quantity}'; known: {', '.join(QUANTITIES)}")
        if unit and unit not in UNITS[quantity]:
            raise OptionError(f"--map {text}: unknown unit '{unit}' of {quantity}; known: {', '.join(UNITS[quantity])}")
        if quantity in columns:
            raise OptionError(f"--map {text}: {quantity} is already read from '{columns[quantity].column}'")
        columns[quantity] = MappedColumn(quantity, match["column"].strip(), unit, -1 if match["minus"] else 1)
    return tuple(columns.values())
