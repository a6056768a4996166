"""The user's --map: which column of a radar's messages or file holds which quantity, in which unit and with which sign."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from calib_core.errors import OptionError
from calib_core.recordings.field_words.units import unit_of_word, units_for

QUANTITIES: tuple[str, ...] = (
    "x", "y", "z", "range", "azimuth", "elevation", "doppler", "amplitude", "time", "sigma_range", "sigma_azimuth",
    "sigma_elevation",
)  # fmt: skip
UNITS: Mapping[str, Mapping[str, float]] = {
    quantity: {unit.flag: unit.scale for unit in units_for(quantity)} for quantity in QUANTITIES
}
"""Units of each quantity, and the factor to m, rad, m/s, dB or ns. The first is the one that is assumed."""

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
        quantity, unit = match["quantity"].lower(), _unit(match["unit"] or "")
        if quantity not in UNITS:
            raise OptionError(f"--map {text}: unknown quantity '{quantity}'; known: {', '.join(QUANTITIES)}")
        if unit and unit not in UNITS[quantity]:
            raise OptionError(f"--map {text}: unknown unit '{unit}' of {quantity}; known: {', '.join(UNITS[quantity])}")
        if quantity in columns:
            raise OptionError(f"--map {text}: {quantity} is already read from '{columns[quantity].column}'")
        columns[quantity] = MappedColumn(quantity, match["column"].strip(), unit, -1 if match["minus"] else 1)
    return tuple(columns.values())


def _unit(written: str) -> str:
    """Return a unit in the spelling of UNITS: kmh for kph, m for metres."""
    unit = unit_of_word(written)
    return unit.flag if unit else written.lower()
