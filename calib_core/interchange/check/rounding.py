"""How many digits the numbers of a pose were written with, and how far rounding to them can move it."""

from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from calib_core.arrays import Vector3
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.interchange.imported import WrittenPose
from calib_core.interchange.rotations import LINK_FROM_OPTICAL

_FULL_DIGITS = 15
_FLOAT_32 = 1e-6
_HARMLESS_RAD, _HARMLESS_M = 2e-4, 1e-3
_LARGEST = 0.02  # metres and radians: numbers such as 1 and 0.5 are usually not rounded


@dataclass(frozen=True, slots=True)
class Rounding:
    """What rounding can have done to a pose.

    Attributes:
        digits: of its numbers; 15 and more are all that a number has.
        angle_rad: the largest rotation that rounding can have added.
        distance_m: the largest shift of the translation as written.
    """

    digits: int
    angle_rad: float
    distance_m: float

    @property
    def is_harmless(self) -> bool:
        """Whether it moves the pose by less than any calibration knows it: about 0.01 degrees and a millimetre."""
        return self.angle_rad <= _HARMLESS_RAD and self.distance_m <= _HARMLESS_M

    def at(self, point_radar_m: Vector3, camera_from_radar: RigidTransform) -> float:
        """Return how far rounding can have moved a radar point (3,) in the camera frame [m]."""
        arm_m = float(np.linalg.norm(point_radar_m) + np.linalg.norm(camera_from_radar.translation_m))
        return self.distance_m + self.angle_rad * arm_m

    @property
    def text(self) -> str:
        """What was done to the numbers."""
        return f"the numbers are rounded to {self.digits} digits"


def rounding_of(pose: WrittenPose) -> Rounding:
    """Find out from the numbers of a pose how they were rounded; angles may have been written in degrees."""
    digits, tolerance = _last_digits(pose.rotation)
    if pose.form == "rpy":
        in_degrees, tolerance_deg = _last_digits(np.degrees(pose.rotation))
        if in_degrees < digits:
            digits, tolerance = in_degrees, np.radians(tolerance_deg)
    half_angles = 2.0 if pose.form.startswith("quaternion") else 1.0
    angle_rad = float(tolerance.sum()) if pose.form == "rpy" else half_angles * float(np.linalg.norm(tolerance))
    shift_digits, shift_m = _last_digits(pose.translation_m)
    found = (digits, shift_digits)
    return Rounding(
        max(found) if max(found) < _FULL_DIGITS else min(found),
        min(angle_rad, _LARGEST) + _FLOAT_32,
        min(float(np.linalg.norm(shift_m)), _LARGEST) + _FLOAT_32,
    )


def within_rounding(pose: WrittenPose, camera_from_radar: RigidTransform, rounding: Rounding) -> bool:
    """Return whether a pose, as written, is the given one up to rounding.

    Raises:
        ValueError: its rotation is not a rotation.
    """
    written, wanted = pose.as_written(), as_in_file(pose, camera_from_radar)
    angle_rad = rotation_angle_rad(written.rotation @ wanted.rotation.T)
    far_m = _FLOAT_32 * float(np.linalg.norm(wanted.translation_m))
    distance_m = float(np.linalg.norm(written.translation_m - wanted.translation_m))
    return angle_rad <= rounding.angle_rad and distance_m <= rounding.distance_m + far_m


def as_in_file(pose: WrittenPose, camera_from_radar: RigidTransform) -> RigidTransform:
    """Return the transform that the file would hold for another pose: in its direction, with its camera axes."""
    meant = LINK_FROM_OPTICAL @ camera_from_radar if pose.axes == "link" else camera_from_radar
    return meant if pose.direction == "camera_from_radar" else meant.inverse()


def _last_digits(values: np.ndarray) -> tuple[int, np.ndarray]:
    """Return the most significant digits of any value, and for each value half a unit of its last digit.

    Trailing zeros are not visible in a number, so that the digit is that of the value with the most digits.
    """
    flat = np.abs(np.asarray(values, dtype=np.float64)).ravel()
    parts = [_digits_and_decimals(value) for value in flat.tolist() if value]
    digits = max((digits for digits, _ in parts), default=1)
    decimals = max((decimals for _, decimals in parts), default=0)
    if digits >= _FULL_DIGITS:
        return digits, np.zeros(len(flat))
    exponents = np.floor(np.log10(np.where(flat > 0, flat, 1.0)))
    by_digits = np.where(flat > 0, 0.5 * 10.0 ** (exponents + 1 - digits), 0.0)
    return digits, np.maximum(by_digits, 0.5 * 10.0**-decimals)


def _digits_and_decimals(value: float) -> tuple[int, int]:
    number = Decimal(repr(value)).normalize().as_tuple()
    return len(number.digits), max(0, -int(number.exponent))
