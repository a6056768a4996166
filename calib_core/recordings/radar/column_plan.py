"""Which columns of a radar message are read, what they mean, and why."""

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33
from calib_core.errors import MessageError, OptionError
from calib_core.geometry import RigidTransform
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.field_words import MAPPED_UNITS, MappedColumn

_AXIS_AND_SIGN = {
    "forward": (0, 1), "backward": (0, -1),
    "left": (1, 1), "right": (1, -1),
    "up": (2, 1), "down": (2, -1),
}  # fmt: skip
_UNITS = ("degrees", "radians")
_EXAMPLE = "for example --radar-axes forward,right,up or --radar-axes forward,left,up,degrees"


@dataclass(frozen=True, slots=True)
class RadarAxes:
    """The user's --radar-axes.

    Polar messages are first converted to x, y, z with azimuth positive to the left and elevation positive upwards, so
    "forward,right,up" also means that azimuth is positive to the right.

    Attributes:
        directions: the directions of the message's x, y and z.
        degrees: whether its angles are in degrees (True) or radians (False); None for the layout's own unit.
        directed: whether the user gave the directions.
    """

    directions: tuple[str, str, str] = ("forward", "left", "up")
    degrees: bool | None = None
    directed: bool = True

    @property
    def matrix(self) -> Matrix33:
        """The signed permutation from the message's axes to x forward, y left, z up."""
        matrix = np.zeros((3, 3))
        for column, word in enumerate(self.directions):
            axis, sign = _AXIS_AND_SIGN[word]
            matrix[axis, column] = sign
        return matrix

    @property
    def words(self) -> str:
        """The value of --radar-axes."""
        unit = () if self.degrees is None else ("degrees" if self.degrees else "radians",)
        return ",".join((*self.directions, *unit))

    def describe(self) -> str:
        """Describe the axes and the unit as text."""
        words = ", ".join(f"{axis} {word}" for axis, word in zip("xyz", self.directions, strict=True))
        unit = "" if self.degrees is None else f", angles in {'degrees' if self.degrees else 'radians'}"
        return f"axes as given: {words}{unit}"


def parse_radar_axes(text: str) -> RadarAxes:
    """Parse the value of --radar-axes: three directions, an angle unit, or both.

    Args:
        text: such as "forward,right,up", "degrees" or "forward,left,up,degrees".

    Raises:
        OptionError: a word is unknown, one is missing, or two directions lie on the same axis.
    """
    words = [word for word in re.split(r"[,\s]+", text.strip().lower()) if word]
    unknown = next((word for word in words if word not in _AXIS_AND_SIGN and word not in _UNITS), None)
    if unknown is not None:
        raise OptionError(
            f"--radar-axes {text}: '{unknown}' is unknown; use forward, backward, left, right, up, down, "
            f"and degrees or radians for the angles; {_EXAMPLE}"
        )
    units = [word for word in words if word in _UNITS]
    directions = [word for word in words if word in _AXIS_AND_SIGN]
    if len(units) > 1 or len(directions) not in (0, 3) or not words:
        raise OptionError(
            f"--radar-axes {text}: give the directions of the message's x, y and z in this order, and at most one unit; "
            f"{_EXAMPLE}"
        )
    degrees = units[0] == "degrees" if units else None
    if not directions:
        return RadarAxes(degrees=degrees, directed=False)
    if len({_AXIS_AND_SIGN[word][0] for word in directions}) < 3:
        raise OptionError(
            f"--radar-axes {text}: two of the directions lie on the same axis; x, y and z must differ; {_EXAMPLE}"
        )
    x, y, z = directions
    return RadarAxes((x, y, z), degrees)


_NO_SCALES = (1.0, 1.0, 1.0)
_DIRECTIONS = ("forward", "left", "up")
_ANGLES = ("azimuth", "elevation")


def plain_name(name: str) -> str:
    """Return a name without capitals, dots and underscores."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


@dataclass(frozen=True, slots=True)
class ColumnReading:
    """What was taken for what: one row of the table that `cocalib info` shows.

    Attributes:
        quantity: x, y, z, range, azimuth, elevation, doppler, velocity, amplitude, noise or another use.
        column: the field or fields it is read from, as the recording spells them.
        unit: of the field's values; "" if it has none.
        sign: the direction in which its values grow; "" if that does not matter.
        why: how this is known.
    """

    quantity: str
    column: str
    unit: str
    sign: str
    why: str

    def stated(self, *, unit: str = "", sign: str = "") -> "ColumnReading":
        """Return the same with what --radar-axes states."""
        unit, sign = unit or self.unit, sign or self.sign
        return (
            self if (unit, sign) == (self.unit, self.sign) else replace(self, unit=unit, sign=sign, why="--radar-axes")
        )


@dataclass(frozen=True, slots=True)
class ColumnAssumption:
    """An assumption about columns, and the --map of which quantities settles it.

    Attributes:
        assumption: its topic is empty: a layout does not know its topic.
        quantities: all of them must be mapped; for a unit, with a unit.
        axes: whether directions in --radar-axes settle it.
        angle_unit: whether it also needs an angle unit in --radar-axes, or is settled by that alone.
    """

    assumption: Assumption
    quantities: tuple[str, ...]
    axes: bool = False
    angle_unit: bool = False

    def settled_by(self, axes: RadarAxes) -> bool:
        """Return whether the user's --radar-axes states what is assumed."""
        unit = axes.degrees is not None
        if self.axes and self.angle_unit:
            return axes.directed and unit
        return (self.axes and axes.directed) or (self.angle_unit and unit)


@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """The driver's names for the columns in use.

    Attributes:
        position: x, y and optionally z [m]; or range [m], azimuth and optionally elevation.
        polar: whether position is polar.
        degrees: whether the angles are in degrees.
        doppler: radial speed [m/s], or None.
        velocity: components [m/s]; if doppler is None, the radial speed is their part along the line of sight.
        amplitude: amplitude in dB, or None.
        amplitude_scale: unit of the amplitude in dB.
        sigma: standard deviations of range, azimuth and elevation, None for each that is missing.
        spoils_position: flags that mark the position as invalid.
        spoils_doppler: flags that mark the speed as invalid.
        needed: flags that are zero if there is no return.
        azimuth_sign: 1 if azimuth is positive to the left, -1 if to the right.
        covariance: an array with the position's covariance [m^2], or None.
        claimed: columns of range, azimuth and elevation, whether or not the position is made of them; to find contradictions.
        axes: the user's axes and units; None if not given.
        mount: pose of the radar in the frame that the positions are given in; None if they are in the radar's own.
        decoder: the layout's name in the registry; "" if the message is read by its column names alone.
        shared_with_lidars: whether lidars have the same columns.
        claiming: whether to fill in Returns.claimed_polar.
        scales: factors from the position's columns to m and to the angles' unit; negative for the opposite direction.
        sigma_scales: likewise for the standard deviations.
        claimed_scales: likewise for the claimed columns, to m and rad.
        doppler_scale: factor from the speed's columns to m/s.
        directions: where the message's own x, y and z point, if the user does not give axes.
        described: the columns were recognized by what the message says about itself, not by the registry.
        mapped: the quantities whose columns the user gave.
        other_azimuths: columns that may hold further azimuths of the same returns.
        azimuth_from: one of these, to read the positions at; None reads them at the first azimuth.
        readings: what was taken for what, and why.
        assumptions: what the message does not state.
        notes: what else the user should know about the message, as sentences without their final periods.
    """

    position: tuple[str, ...]
    polar: bool
    degrees: bool = False
    doppler: str | None = None
    velocity: tuple[str, ...] = ()
    amplitude: str | None = None
    amplitude_scale: float = 1.0
    sigma: tuple[str | None, str | None, str | None] = (None, None, None)
    spoils_position: tuple[str, ...] = ()
    spoils_doppler: tuple[str, ...] = ()
    needed: tuple[str, ...] = ()
    azimuth_sign: float = 1.0
    covariance: str | None = None
    claimed: tuple[str | None, str | None, str | None] = (None, None, None)
    axes: RadarAxes | None = None
    mount: RigidTransform | None = None
    decoder: str = ""
    shared_with_lidars: bool = False
    claiming: bool = False
    scales: tuple[float, float, float] = _NO_SCALES
    sigma_scales: tuple[float, float, float] = _NO_SCALES
    claimed_scales: tuple[float, float, float] = _NO_SCALES
    doppler_scale: float = 1.0
    directions: tuple[str, str, str] = _DIRECTIONS
    described: bool = False
    mapped: tuple[str, ...] = ()
    other_azimuths: tuple[str, ...] = ()
    azimuth_from: str | None = None
    readings: tuple[ColumnReading, ...] = ()
    assumptions: tuple[ColumnAssumption, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def is_plain_xyz(self) -> bool:
        """Return whether the position is that of columns x, y and z, in meters, forward, left and up."""
        unchanged = (self.axes, self.mount, self.azimuth_from, self.scales, self.directions) == (
            None,
            None,
            None,
            _NO_SCALES,
            _DIRECTIONS,
        )
        return unchanged and not self.polar and self.position == ("x", "y", "z")

    @property
    def looks_like_radar(self) -> bool:
        """Return whether there are columns other than the position and intensity that a lidar also has."""
        if self.decoder:
            return not self.shared_with_lidars
        amplitude = self.amplitude is not None and plain_name(self.amplitude) != "intensity"
        return self.polar or self.doppler is not None or bool(self.velocity) or amplitude

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns that are read."""
        one = (self.doppler, self.amplitude, self.covariance, *self.sigma)
        flags = (*self.spoils_position, *self.spoils_doppler, *self.needed)
        return (*self.position, *self.velocity, *flags, *(name for name in one if name))

    def describe(self) -> str:
        """Describe briefly which columns are read."""
        words = [f"position from {', '.join(self.position)}"]
        if self.polar:
            side = "left" if self.azimuth_sign > 0 else "right"
            words[0] += f" (azimuth positive to the {side}, {'degrees' if self.degrees else 'radians'})"
        elif self.axes is None:
            words[0] += f" ({', '.join(self.directions[: len(self.position)])})"
        speed = self.doppler or ", ".join(self.velocity)
        words.append(f"speed from {speed}" if speed else "no speed")
        words.append(f"amplitude from {self.amplitude}" if self.amplitude else "no amplitude")
        if any(self.sigma):
            words.append(f"noise from {', '.join(name for name in self.sigma if name)}")
        elif self.covariance:
            words.append(f"noise from {self.covariance}")
        if self.axes:
            words.append(self.axes.describe())
        return (f"{self.decoder}: " if self.decoder else "") + "; ".join(words)

    @property
    def turn(self) -> Matrix33 | None:
        """The rotation or reflection from the message's axes to x forward, y left, z up; None if there is nothing to turn."""
        if self.axes is not None:
            return self.axes.matrix
        return None if self.directions == ("forward", "left", "up") else RadarAxes(self.directions).matrix

    def read_as(self, axes: RadarAxes) -> "ColumnPlan":
        """Apply the user's axes and units; directions that the user does not give stay those of the message."""
        if not axes.directed and self.directions != ("forward", "left", "up"):
            axes = replace(axes, directions=self.directions)
        scales, readings = self.scales, self.readings
        if axes.degrees is not None:
            scales = (scales[0], math.copysign(1.0, scales[1]), math.copysign(1.0, scales[2])) if self.polar else scales
            unit = "deg" if axes.degrees else "rad"
            readings = tuple(
                reading.stated(unit=unit) if reading.quantity in _ANGLES else reading for reading in readings
            )
        if axes.directed:
            sides = dict(zip("xyz", axes.directions, strict=True))
            readings = tuple(reading.stated(sign=sides.get(reading.quantity, reading.sign)) for reading in readings)
        return replace(
            self,
            axes=axes,
            scales=scales,
            readings=readings,
            degrees=self.degrees if axes.degrees is None else axes.degrees,
            assumptions=tuple(assumption for assumption in self.assumptions if not assumption.settled_by(axes)),
        )


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


def column_readings(plan: ColumnPlan) -> tuple[ColumnReading, ...]:
    """Return what was taken for what: as the message describes itself, or as the registry or ROS defines its layout."""
    if plan.described:
        return plan.readings
    why = f"layout '{plan.decoder}'" if plan.decoder else "ROS defines it (REP 103)"
    angle, side = ("deg" if plan.degrees else "rad"), ("to the left" if plan.azimuth_sign > 0 else "to the right")
    directions = plan.axes.directions if plan.axes else plan.directions
    place = [("xyz"[axis], "m", directions[axis]) for axis in range(3)]
    if plan.polar:
        place = [("range", "m", ""), ("azimuth", angle, side), ("elevation", angle, "upwards")]
    rows = [
        ColumnReading(what, name, unit, sign, why)
        for name, (what, unit, sign) in zip(plan.position, place, strict=False)
    ]
    speed = plan.doppler or ", ".join(plan.velocity)
    rows += [ColumnReading("doppler" if plan.doppler else "velocity", speed, "m/s", "", why)] if speed else []
    rows += [ColumnReading("amplitude", plan.amplitude, "dB", "", why)] if plan.amplitude else []
    noise = plan.covariance or ", ".join(name for name in plan.sigma if name)
    rows += [ColumnReading("noise", noise, "", "", why)] if noise else []
    rows += [ColumnReading("other azimuth", name, "", "", "alternative") for name in plan.other_azimuths]
    mapped = {row.quantity for row in plan.readings}
    return (*(row for row in rows if row.quantity not in mapped), *plan.readings)


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
        """Return a plan with what the user states in place of what was recognized; None if there is neither."""
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
        plan: what was recognized; None if nothing was.
        column_map: columns that exist.

    Raises:
        OptionError: the position is incomplete, or a time is mapped.
    """
    given = {column.quantity: column for column in column_map}
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
    kept = tuple(assumption for assumption in start.assumptions if not _is_settled(assumption, given, made))
    readings = tuple(
        reading for reading in start.readings if reading.quantity not in given and not _is_replaced(reading, made)
    )
    return replace(
        made,
        mapped=tuple(column.words for column in column_map),
        assumptions=(*kept, *assumed),
        readings=(*readings, *(_reading(column) for column in column_map)),
    )


def _is_replaced(reading: ColumnReading, made: ColumnPlan) -> bool:
    gone = _CARTESIAN if made.polar else _POLAR
    return reading.quantity in gone or (reading.quantity == "velocity" and not made.velocity)


def _is_settled(assumption: ColumnAssumption, given: Mapping[str, MappedColumn], made: ColumnPlan) -> bool:
    unit = assumption.assumption.key.endswith("-unit")
    if set(assumption.quantities) & set(_CARTESIAN if made.polar else _POLAR):
        return True  # about columns that are no longer read
    return bool(assumption.quantities) and all(
        q in given and (given[q].unit or not unit) for q in assumption.quantities
    )


def _reading(column: MappedColumn) -> ColumnReading:
    sign = _SIDES.get(column.quantity, "")
    return ColumnReading(
        column.quantity,
        column.column,
        column.unit or "as before",
        f"opposite of {sign}" if sign and column.sign < 0 else sign,
        f"--map {column.words}",
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
                assumed.append(_unit_assumption(one))
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


def _unit_assumption(column: MappedColumn) -> ColumnAssumption:
    unit = next(iter(MAPPED_UNITS[column.quantity]))
    return ColumnAssumption(
        Assumption(
            _KEYS[column.quantity],
            "",
            f"{column.column} is taken as {unit}; --map {column.words} does not state the unit",
            f"--map {column.words}:{unit}",
        ),
        (column.quantity,),
    )


def _speed(
    made: ColumnPlan, start: ColumnPlan, given: Mapping[str, MappedColumn], assumed: list[ColumnAssumption]
) -> ColumnPlan:
    """Return the plan with the given speed; without one, velocities follow their axes."""
    one = given.get("doppler")
    if one is not None:
        same = start.doppler == one.column
        if not one.unit and not same:
            assumed.append(_unit_assumption(one))
        scale = one.scale if one.unit or not same else one.sign * abs(start.doppler_scale)
        return replace(made, doppler=one.column, doppler_scale=scale, velocity=())
    if made.velocity and made.position != start.position:
        places = [start.position.index(name) if name in start.position else -1 for name in made.position]
        fits = not start.polar and not made.polar and all(0 <= place < len(made.velocity) for place in places)
        return replace(made, velocity=tuple(made.velocity[place] for place in places) if fits else ())
    return made


def _sigma(made: ColumnPlan, given: Mapping[str, MappedColumn]) -> ColumnPlan:
    sigma, scales = list(made.sigma), list(made.sigma_scales)
    for index, quantity in enumerate(_POLAR):
        one = given.get(f"sigma_{quantity}")
        if one is not None:
            sigma[index] = one.column
            scales[index] = abs(one.scale) / (math.pi / 180.0 if index and made.degrees else 1.0)
    return replace(made, sigma=(sigma[0], sigma[1], sigma[2]), sigma_scales=(scales[0], scales[1], scales[2]))
