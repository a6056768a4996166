"""Apply the user's --map to the plan of a layout."""

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from calib_core.errors import MessageError, OptionError
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.field_words import MAPPED_UNITS, MappedColumn
from calib_core.recordings.radar.axes import RadarAxes
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan, ColumnReading

_CARTESIAN, _POLAR = ("x", "y", "z"), ("range", "azimuth", "elevation")
_SIDES = {
    "x": "forward",
    "y": "left",
    "z": "up",
    "range": "",
    "azimuth": "to the left",
    "elevation": "upwards",
    "doppler": "either: only its size matters",
}
_KEYS = {"x": "length-unit", "y": "length-unit", "z": "length-unit", "range": "length-unit", "azimuth": "angle-unit"}
_KEYS |= {"elevation": "angle-unit", "doppler": "speed-unit"}


@dataclass(frozen=True, slots=True)
class StatedReading:
    """What the user states about the radar's messages.

    Attributes:
        column_map: the user's --map.
        axes: the user's --radar-axes.
    """

    column_map: tuple[MappedColumn, ...] = ()
    axes: RadarAxes | None = None

    def within(self, path: str, names: Sequence[str]) -> "StatedReading | None":
        """Return the same with columns relative to a list; None if the list lacks one of them.

        Args:
            path: of the list; columns may be spelled from the message on.
            names: of its columns.
        """
        found = []
        for one in self.column_map:
            name = one.column if one.column in names else one.column.removeprefix(f"{path}.")
            if name not in names:
                return None
            found.append(replace(one, column=name))
        return replace(self, column_map=tuple(found))

    def applied(self, plan: ColumnPlan | None) -> ColumnPlan | None:
        """Return a plan with what the user states in place of what was recognised; None if there is neither."""
        if plan is not None and self.axes is not None:
            plan = plan.read_as(self.axes)
        if not self.column_map:
            return plan
        mapped = map_columns(plan, self.column_map)
        return mapped if plan is not None or self.axes is None else mapped.read_as(replace(self.axes, degrees=None))

    def require(self, names: Sequence[str]) -> None:
        """Refuse a --map of columns that a message does not have.

        Raises:
            MessageError: one is missing; the nearest names are given.
        """
        for one in self.column_map:
            if one.column not in names:
                near = difflib.get_close_matches(one.column, names, 3, 0.3) or sorted(names)[:8]
                raise MessageError(
                    f"--map {one.words}: the messages have no column '{one.column}'; the nearest are {', '.join(near) or 'none'}"
                )


NOTHING_STATED = StatedReading()
"""The user states nothing."""


def map_columns(plan: ColumnPlan | None, column_map: Sequence[MappedColumn]) -> ColumnPlan:
    """Return the plan with the user's columns, units and signs in place of its own.

    Args:
        plan: what was recognised; None if nothing was.
        column_map: columns that exist.

    Raises:
        OptionError: the position is incomplete, or a time is mapped.
    """
    given = {one.quantity: one for one in column_map}
    if "time" in given:
        raise OptionError(
            f"--map {given['time'].words}: messages carry their time in their headers; choose the clock with --clock"
        )
    start = plan or ColumnPlan(position=(), polar=True, described=True)
    assumed: list[ColumnAssumption] = []
    made = _position(start, given, assumed)
    made = _speed(made, start, given, assumed)
    if "amplitude" in given:
        made = replace(made, amplitude=given["amplitude"].column, amplitude_scale=given["amplitude"].scale)
    made = _sigma(made, given)
    kept = tuple(one for one in start.assumptions if not _settled(one, given, made))
    readings = tuple(one for one in start.readings if one.quantity not in given and not _replaced(one, made))
    return replace(
        made,
        mapped=tuple(one.words for one in column_map),
        assumptions=(*kept, *assumed),
        readings=(*readings, *(_reading(one) for one in column_map)),
    )


def _replaced(reading: ColumnReading, made: ColumnPlan) -> bool:
    gone = _CARTESIAN if made.polar else _POLAR
    return reading.quantity in gone or (reading.quantity == "velocity" and not made.velocity)


def _settled(one: ColumnAssumption, given: Mapping[str, MappedColumn], made: ColumnPlan) -> bool:
    unit = one.assumption.key.endswith("-unit")
    if set(one.quantities) & set(_CARTESIAN if made.polar else _POLAR):
        return True  # about columns that are no longer read
    return bool(one.quantities) and all(q in given and (given[q].unit or not unit) for q in one.quantities)


def _reading(one: MappedColumn) -> ColumnReading:
    sign = _SIDES.get(one.quantity, "")
    return ColumnReading(
        one.quantity,
        one.column,
        one.unit or "as before",
        f"opposite of {sign}" if sign and one.sign < 0 else sign,
        f"--map {one.words}",
    )


def _position(start: ColumnPlan, given: Mapping[str, MappedColumn], assumed: list[ColumnAssumption]) -> ColumnPlan:
    """Return the plan with its position made of the given columns and the remaining ones of the plan."""
    cartesian, polar = not given.keys().isdisjoint(_CARTESIAN), not given.keys().isdisjoint(_POLAR)
    if not cartesian and not polar:
        if not start.position:
            raise OptionError("--map: say where the position is: x and y, or range and azimuth")
        return start
    names = _CARTESIAN if cartesian else _POLAR
    same = bool(start.position) and start.polar != cartesian
    old = dict(zip(names, zip(start.position, _scales(start), strict=False), strict=False)) if same else {}
    columns: list[str] = []
    scales: list[float] = []
    for quantity in names:
        before = old.get(quantity)
        if quantity in given:
            one = given[quantity]
            usual = abs(before[1]) if before and before[0] == one.column else _unit_of_axes(start, quantity)
            columns.append(one.column)
            scales.append(one.scale if one.unit else one.sign * (usual or 1.0))
            if not one.unit and usual is None:
                assumed.append(_about_unit(one))
        elif before is not None:
            columns.append(before[0])
            scales.append(before[1])
        elif quantity != names[2]:
            raise OptionError(
                f"--map: {quantity} is not known; add --map {quantity}=COLUMN:{next(iter(MAPPED_UNITS[quantity]))}"
            )
        else:
            break
    whole = {"x", "y"} <= given.keys()
    factor = math.pi / 180.0 if start.degrees else 1.0
    return replace(
        start,
        position=tuple(columns),
        polar=not cartesian,
        degrees=False,
        scales=(scales[0], scales[1], scales[2] if len(scales) > 2 else 1.0),
        sigma_scales=(start.sigma_scales[0], factor * start.sigma_scales[1], factor * start.sigma_scales[2]),
        azimuth_sign=1.0 if "azimuth" in given else start.azimuth_sign,
        directions=("forward", "left", "up") if whole or not same else start.directions,
        claimed=(None, None, None),
        covariance=None,
    )


def _unit_of_axes(plan: ColumnPlan, quantity: str) -> float | None:
    """Return the angle unit that --radar-axes gives, as a factor to rad; None if it gives none."""
    if quantity not in ("azimuth", "elevation") or plan.axes is None or plan.axes.degrees is None:
        return None
    return math.pi / 180.0 if plan.axes.degrees else 1.0


def _scales(plan: ColumnPlan) -> tuple[float, float, float]:
    """Return the factors of the position's columns to m and rad."""
    factor = math.pi / 180.0 if plan.polar and plan.degrees else 1.0
    return plan.scales[0], factor * plan.scales[1], factor * plan.scales[2]


def _about_unit(one: MappedColumn) -> ColumnAssumption:
    unit = next(iter(MAPPED_UNITS[one.quantity]))
    return ColumnAssumption(
        Assumption(
            _KEYS[one.quantity],
            "",
            f"{one.column} is taken as {unit}; --map {one.words} does not state the unit",
            f"--map {one.words}:{unit}",
        ),
        (one.quantity,),
    )


def _speed(
    made: ColumnPlan, start: ColumnPlan, given: Mapping[str, MappedColumn], assumed: list[ColumnAssumption]
) -> ColumnPlan:
    """Return the plan with the given speed; without one, velocities follow their axes."""
    one = given.get("doppler")
    if one is not None:
        same = start.doppler == one.column
        if not one.unit and not same:
            assumed.append(_about_unit(one))
        scale = one.scale if one.unit or not same else one.sign * abs(start.doppler_scale)
        return replace(made, doppler=one.column, doppler_scale=scale, velocity=())
    if made.velocity and made.position != start.position:
        places = [start.position.index(name) if name in start.position else -1 for name in made.position]
        fits = not start.polar and not made.polar and all(0 <= place < len(made.velocity) for place in places)
        return replace(made, velocity=tuple(made.velocity[place] for place in places) if fits else ())
    return made


def _sigma(made: ColumnPlan, given: Mapping[str, MappedColumn]) -> ColumnPlan:
    sigma, scales = list(made.sigma), list(made.sigma_scales)
    for place, quantity in enumerate(_POLAR):
        one = given.get(f"sigma_{quantity}")
        if one is not None:
            sigma[place] = one.column
            scales[place] = abs(one.scale) / (math.pi / 180.0 if place and made.degrees else 1.0)
    return replace(made, sigma=(sigma[0], sigma[1], sigma[2]), sigma_scales=(scales[0], scales[1], scales[2]))
