"""Axis directions and angle unit of a radar's messages, as given by --radar-axes."""

import re
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix33
from calib_core.errors import OptionError

_DIRECTIONS = {
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
            axis, sign = _DIRECTIONS[word]
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
    unknown = next((word for word in words if word not in _DIRECTIONS and word not in _UNITS), None)
    if unknown is not None:
        raise OptionError(
            f"--radar-axes {text}: '{unknown}' is unknown; use forward, backward, left, right, up, down, "
            f"and degrees or radians for the angles; {_EXAMPLE}"
        )
    units = [word for word in words if word in _UNITS]
    directions = [word for word in words if word in _DIRECTIONS]
    if len(units) > 1 or len(directions) not in (0, 3) or not words:
        raise OptionError(
            f"--radar-axes {text}: give the directions of the message's x, y and z in this order, and at most one unit; "
            f"{_EXAMPLE}"
        )
    degrees = units[0] == "degrees" if units else None
    if not directions:
        return RadarAxes(degrees=degrees, directed=False)
    if len({_DIRECTIONS[word][0] for word in directions}) < 3:
        raise OptionError(
            f"--radar-axes {text}: two of the directions lie on the same axis; x, y and z must differ; {_EXAMPLE}"
        )
    x, y, z = directions
    return RadarAxes((x, y, z), degrees)
