"""What values say about their unit and axes: plausible ranges, and polar and Cartesian columns that verify each other."""

import math
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values
from calib_core.recordings.field_words.units import Unit, unit_of_word

_NEAREST_M, _FARTHEST_M = 4.0, 500.0
"""No recording of a radar ends nearer than the first, and no automotive radar sees farther than the second [m]."""
_USUAL_M = 300.0
"""Of several units that fit, the one is likelier in which nothing lies farther away than this."""
_NEAREST_METRES = 1.0
"""Values in metres are believed to be metres from here on: in cm or mm they would all lie within a finger's width."""
_FASTEST_MPS = 150.0
_ENOUGH = 20
_WIDEST_RAD = math.pi / 2 + 0.1
_ALIKE_RAD = 0.02


@dataclass(frozen=True, slots=True)
class Finding:
    """A unit found by values.

    Attributes:
        unit: the most plausible one.
        certain: whether no other one is plausible.
        why: in a few words.
    """

    unit: Unit
    certain: bool
    why: str


def _unit(word: str) -> Unit:
    unit = unit_of_word(word)
    assert unit is not None
    return unit


def farthest(*columns: Values) -> float:
    """Return the length below which 99 % of the positions or ranges lie; 0 without values."""
    lengths = np.sqrt(sum(np.square(column) for column in columns)) if columns else np.zeros(0)
    lengths = lengths[np.isfinite(lengths) & (lengths > 0)]
    return float(np.quantile(lengths, 0.99)) if len(lengths) else 0.0


def length_unit(largest: float, *, integer: bool) -> Finding:
    """Find the unit of lengths by the largest.

    Args:
        largest: see farthest.
        integer: an integer in any unit may have a factor that nothing states, so it is never certain.
    """
    fitting = [
        _unit(word)
        for word, nearest in (("m", _NEAREST_METRES), ("cm", _NEAREST_M), ("mm", _NEAREST_M))
        if nearest <= largest * _unit(word).scale <= _FARTHEST_M
    ]
    if not fitting:
        return Finding(_unit("m"), False, "no value tells the unit")
    why = f"values up to {largest:.4g}"
    usual = [unit for unit in fitting if largest * unit.scale <= _USUAL_M]
    return Finding((usual or fitting)[0], len(fitting) == 1 and not integer, why)


def angle_unit(angles: Values, *, integer: bool) -> Finding:
    """Find the unit of angles by the largest one."""
    angles = np.abs(angles[np.isfinite(angles)])
    angles = angles[angles > 0]
    largest = float(angles.max(initial=0.0))
    why = f"angles up to {largest:.4g}"
    if integer:
        factor = 1.0 if largest <= 180 else 0.1 if largest <= 1800 else 0.01
        return Finding(_unit("deg").times(factor), False, why)
    if largest > 2 * math.pi:
        return Finding(_unit("deg") if largest <= 360 else _unit("cdeg"), largest <= 360, f"{why} cannot be radians")
    if len(angles) >= _ENOUGH and largest <= _WIDEST_RAD:
        return Finding(_unit("rad"), True, f"no angle above {largest:.2f} in {len(angles)} returns")
    return Finding(_unit("rad") if largest <= math.pi else _unit("deg"), False, f"only {why}")


def speed_unit(speeds: Values, *, integer: bool) -> Finding:
    """Find the unit of speeds; values alone never make it certain."""
    speeds = np.abs(speeds[np.isfinite(speeds)])
    largest = float(np.quantile(speeds, 0.99)) if len(speeds) else 0.0
    word = "cm/s" if integer and largest > _FASTEST_MPS else "m/s"
    return Finding(_unit(word), False, f"values up to {largest:.4g}")


def forward_axis(x: Values, y: Values) -> str:
    """Return "x" or "y" if only its values are never negative while the other's have both signs; else ""."""
    sound = np.isfinite(x) & np.isfinite(y) & ((x != 0) | (y != 0))
    x, y = x[sound], y[sound]
    if len(x) < _ENOUGH:
        return ""
    behind, sideways = np.mean(x < 0), np.mean(y < 0)
    if behind <= 0.01 and 0.1 <= sideways <= 0.9:
        return "x"
    return "y" if sideways <= 0.01 and 0.1 <= behind <= 0.9 else ""


@dataclass(frozen=True, slots=True)
class PolarAgreement:
    """How polar columns agree with Cartesian ones.

    Attributes:
        angle: the angle's unit.
        forward: the axis at angle 0, "x" or "y".
        toward: 1 if the angle grows towards the positive other axis, -1 if away from it.
        ranges_per_length: length of x, y, z per range, 1 if they have the same unit.
    """

    angle: Unit
    forward: str
    toward: int
    ranges_per_length: float


def agreement(angle: Values, distance: Values | None, x: Values, y: Values, z: Values | None) -> PolarAgreement | None:
    """Find the unit, sign and axis order in which an azimuth matches x and y; None if none matches clearly."""
    telling = np.isfinite(angle) & np.isfinite(x) & np.isfinite(y) & (np.abs(angle) > 0) & ((x != 0) | (y != 0))
    if np.count_nonzero(telling) < _ENOUGH // 2:
        return None
    angle, a, b = angle[telling], x[telling], y[telling]
    fits: list[tuple[float, Unit, str, int]] = []
    for word in ("rad", "deg", "mrad", "cdeg"):
        for forward, own in (("x", np.arctan2(b, a)), ("y", np.arctan2(a, b))):
            for toward in (1, -1):
                apart = np.angle(np.exp(1j * (toward * _unit(word).scale * angle - own)))
                fits.append((float(np.median(np.abs(apart))), _unit(word), forward, toward))
    fits.sort(key=lambda fit: fit[0])
    best, second = fits[0], fits[1]
    if best[0] > _ALIKE_RAD or second[0] < 3 * max(best[0], 1e-3):
        return None
    ratio = 1.0
    if distance is not None:
        lengths = np.sqrt(x**2 + y**2 + (0 if z is None else z**2))
        both = np.isfinite(lengths) & np.isfinite(distance) & (lengths > 0) & (distance > 0)
        ratio = float(np.median(lengths[both] / distance[both])) if both.any() else 1.0
    return PolarAgreement(best[1], best[2], best[3], ratio)
