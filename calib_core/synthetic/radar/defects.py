"""What a real radar and its driver do to a position: scales, biases, missing elevation, a second azimuth.

Positions here are rows of direction cosines: range [m], sines of azimuth and elevation as in `direction_cosines`.
"""

import numpy as np

from calib_core.arrays import Flags, Points3, Values
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.synthetic.radar_options import RadarDefects

_ROUNDING_RAD = 1e-6
_PERIOD = 0.6
"""Distance of the two azimuths in sine: antennas 1.7 wavelengths apart cannot tell them apart."""
_FADING_M = 0.9
"""How often over range the wrong one of two azimuths is taken for the better one."""


def distorted(cosines: Points3, defects: RadarDefects) -> Points3:
    """Apply scales and biases to what a perfect radar would measure."""
    ideal = RadarDefects()
    names = (
        "azimuth_scale",
        "elevation_scale",
        "azimuth_bias_deg",
        "elevation_bias_deg",
        "range_bias_m",
        "range_scale",
    )
    if all(getattr(defects, name) == getattr(ideal, name) for name in names):
        return cosines
    r, u, w = cosines.T
    elevation = np.arcsin(np.clip(w, -1.0, 1.0))
    azimuth = np.arctan2(u, np.sqrt(np.maximum(0.0, 1.0 - u * u - w * w)))
    azimuth = _scaled(azimuth, defects.azimuth_scale, defects) + np.deg2rad(defects.azimuth_bias_deg)
    elevation = _scaled(elevation, defects.elevation_scale, defects) + np.deg2rad(defects.elevation_bias_deg)
    range_m = r * defects.range_scale + defects.range_bias_m
    return np.stack([range_m, np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=1)


def _scaled(angle_rad: Values, scale: float, defects: RadarDefects) -> Values:
    if defects.scaled == "angle":
        return angle_rad * scale
    return np.arcsin(np.clip(np.sin(angle_rad) * scale, -1.0, 1.0))


def reported_points(rng: np.random.Generator, cosines: Points3, defects: RadarDefects) -> Points3:
    """Convert to x, y, z as the driver does: with its axes, its unit and its origin of z, and perhaps without elevation.

    Args:
        rng: used for the rounding error only.
        cosines: (n, 3) the measured ones.
        defects: what the driver does.
    """
    r, u, w = cosines.T
    if defects.elevation != "measured":
        size = _ROUNDING_RAD if defects.elevation == "rounding" else 0.0
        w = size * rng.uniform(-1.0, 1.0, len(w)) if size else np.zeros(len(w))
    x = r * np.sqrt(np.maximum(0.0, 1.0 - u * u - w * w))
    z = r * w + defects.z_offset_m if defects.z_offset_m else r * w
    points = np.stack([x, -r * u if defects.mirrored else r * u, z], axis=1)
    return points if defects.length_unit_m == 1.0 else points / defects.length_unit_m


def radar_from_reported(defects: RadarDefects) -> RigidTransform:
    """Return the radar's frame from the frame in which it reports: a bias of the angles turns it, an offset of z moves it.

    The azimuth's bias and the offset of z are exactly such a motion, the elevation's bias only straight ahead.
    """
    turn = rotation_exp(np.array([0.0, 0.0, -np.deg2rad(defects.azimuth_bias_deg)]))
    nod = rotation_exp(np.array([0.0, np.deg2rad(defects.elevation_bias_deg), 0.0]))
    rotation = nod @ turn
    return RigidTransform(rotation, -rotation @ np.array([0.0, 0.0, defects.z_offset_m]))


def second_azimuths(points_radar_m: Points3) -> Points3:
    """Return the positions (n, 3) [m] with the other azimuth that the antennas cannot tell apart from the given one."""
    x, y, z = points_radar_m.T
    across = np.hypot(x, y)
    far = np.maximum(np.hypot(across, z), 1e-9)
    u = y / far
    other = far * (u - np.where(u >= 0.0, _PERIOD, -_PERIOD))
    return np.stack([np.sqrt(np.maximum(0.0, across**2 - other**2)), other, z], axis=1)


def second_is_true(range_m: Values, phase: float, share: float) -> Flags:
    """Return at which ranges the radar takes the wrong azimuth for the better one: a pattern of reflections, not chance.

    Args:
        range_m: (n,) of the returns.
        phase: where the pattern begins, 0 to 1; a property of one recording.
        share: of all ranges.
    """
    return np.asarray((range_m / _FADING_M + phase) % 1.0 < share)
