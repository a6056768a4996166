"""The unit of a length, with what states it, and how assumptions are worded."""

from calib_core.recordings.assumptions import CONFIRM_ALL, Assumption
from calib_core.recordings.field_words.units import Unit, unit_of_word
from calib_core.recordings.radar.column_plan import ColumnAssumption
from calib_core.recordings.radar.self_describing.candidates import Picked
from calib_core.recordings.radar.self_describing.values import Finding, farthest, length_unit

FARTHEST_M = 1000.0
"""No radar returns lie farther away."""
_ROS = "ROS defines it (REP 103)"
_AS_MAPPED = {
    "forward": ("x", ""), "backward": ("x", "-"), "left": ("y", ""), "right": ("y", "-"), "up": ("z", ""), "down": ("z", "-"),
}  # fmt: skip


def assume(
    key: str, text: str, confirm: str, quantities: tuple[str, ...], *, axes: bool = False, angle_unit: bool = False
) -> ColumnAssumption:
    """Return an assumption whose topic is not known yet."""
    return ColumnAssumption(Assumption(key, "", text, confirm), quantities, axes, angle_unit)


def flag_unit(unit: Unit) -> str:
    """Return how --map spells a unit; "" if it has no name there."""
    return f":{unit.flag}" if unit.flag else ""


def _metre() -> Unit:
    unit = unit_of_word("m")
    assert unit is not None
    return unit


def are(names: str) -> str:
    """Return the names with the verb that fits their number."""
    return f"{names} {'are' if ',' in names else 'is'}"


def length_unit_of(
    group: tuple[Picked, ...], *, standard: bool, proven: Finding | None = None, sides: tuple[str, ...] = ()
) -> tuple[list[Unit], str, ColumnAssumption | None]:
    """Return the unit of each column of a position or range, what states it, and what is assumed."""
    stated = next((one for one in group if one.unit), None)
    usual = stated.unit if stated and stated.unit else _metre()
    units = [one.unit or usual for one in group]
    largest = farthest(*(one.column.values * unit.scale for one, unit in zip(group, units, strict=True)))
    names = ", ".join(one.column.name for one in group)
    if stated or (standard and largest <= FARTHEST_M):
        why = stated.why if stated else _ROS
        if largest <= FARTHEST_M:
            return units, why, None
        text = f"{names} would reach {largest:.4g} m in {usual.name} ({why}), which is too far; the unit is taken all the same"
        return units, why, _about_length(text, group, usual, sides)
    found = proven or length_unit(
        farthest(*(one.column.values for one in group)), integer=any(one.column.integer for one in group)
    )
    units = [found.unit] * len(group)
    if found.certain:
        return units, found.why, None
    text = f"{are(names)} taken as {found.unit.name} ({found.why}); the message does not state the unit"
    return units, "assumed", _about_length(text, group, found.unit, sides)


def _about_length(text: str, group: tuple[Picked, ...], unit: Unit, sides: tuple[str, ...]) -> ColumnAssumption:
    """Return the assumption of a length's unit; for a position, confirmed in the radar's own axes."""
    quantities = tuple(one.meaning.quantity for one in group)
    targets = [_AS_MAPPED[side] for side in sides[: len(group)]] if sides else [(name, "") for name in quantities]
    maps = " ".join(
        f"--map {quantity}={minus}{one.column.name}{flag_unit(unit)}"
        for (quantity, minus), one in zip(targets, group, strict=True)
    )
    return assume("length-unit", text, maps if flag_unit(unit) else CONFIRM_ALL, quantities)
