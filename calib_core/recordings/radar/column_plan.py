"""Which columns of a radar message are read, what they mean, and why."""

import difflib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33
from calib_core.errors import MessageError, OptionError
from calib_core.geometry import RigidTransform
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.field_words import MappedColumn

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
