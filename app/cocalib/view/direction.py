"""Positions as a person says them: how far, and how far to which side."""

import math

from calib_core.arrays import Vector3
from calib_core.radar import polar_from_cartesian

_STRAIGHT_DEG = 0.05


def position_words(position_radar_m: Vector3) -> str:
    """Return where a position (3,) [m] is, as seen from the radar: "20.0 m, 2.5° right, 0.4° down"."""
    range_m, azimuth, elevation = polar_from_cartesian(position_radar_m[None])[0].tolist()
    return ", ".join(
        (
            f"{range_m:.1f} m",
            direction_words(math.degrees(azimuth), "left", "right"),
            direction_words(math.degrees(elevation), "up", "down"),
        )
    )


def direction_words(angle_deg: float, positive: str, negative: str) -> str:
    """Return an angle with its side: "2.5° right"; an angle that rounds to zero has none: "0.0°"."""
    if abs(angle_deg) < _STRAIGHT_DEG:
        return "0.0°"
    return f"{abs(angle_deg):.1f}° {positive if angle_deg > 0 else negative}"
