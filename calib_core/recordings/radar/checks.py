"""Check radar messages for contradictions: ranges and positions, signs and units of angles."""

import numpy as np

from calib_core.radar import polar_from_cartesian
from calib_core.recordings.radar.column_plan import ColumnPlan
from calib_core.recordings.radar.columns import Returns
from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.results import DataWarning

_SAMPLED_SCANS = 12
_FEW = 5
_MIN_ANGLE_RAD = 0.02
_MIRROR = "--radar-axes forward,right,up"


def about_claims(radar: RadarStream) -> list[DataWarning]:
    """Warn about contradictions in a sample of a radar's messages."""
    plan, name = radar.layout.plan, radar.topic.name
    return _contradictions(name, plan, radar.claims(_SAMPLED_SCANS)) if any(plan.claimed) else []


def _contradictions(name: str, plan: ColumnPlan, found: Returns) -> list[DataWarning]:
    if found.claimed_polar is None:
        return []
    sound = np.isfinite(found.points_radar_m).all(axis=1)
    points, claimed = found.points_radar_m[sound], found.claimed_polar[sound]
    if len(points) < _FEW:
        return []
    if plan.polar:
        return _angle_unit(name, plan, claimed[:, 1:])
    own = polar_from_cartesian(points)
    return [
        *_range(name, plan, claimed[:, 0], own[:, 0]),
        *_azimuth(name, plan, claimed[:, 1], own[:, 1]),
        *_elevation(name, plan, claimed[:, 2], own[:, 2]),
    ]


def _angle_unit(name: str, plan: ColumnPlan, angles: np.ndarray) -> list[DataWarning]:
    """Warn about angles whose values do not fit the unit they are read in."""
    angles = np.abs(angles[np.isfinite(angles)])
    if not len(angles) or not angles.any():
        return []
    largest = float(angles.max())
    if not plan.degrees and largest > 2.0 * np.pi:
        what, hint = f"has angles up to {largest:.1f}, which cannot be radians", "degrees"
    elif plan.degrees and largest < np.pi / 2 and len(angles) >= 4 * _FEW:
        what, hint = f"has no angle above {largest:.2f}, which is small for degrees", "radians"
    else:
        return []
    read = "degrees" if plan.degrees else "radians"
    return [
        DataWarning(
            "radar-angle-unit", f"{name} {what}; they are read as {read}", f"if they are {hint}: --radar-axes {hint}"
        )
    ]


def _range(name: str, plan: ColumnPlan, claimed: np.ndarray, own: np.ndarray) -> list[DataWarning]:
    known = np.isfinite(claimed) & (claimed != 0)
    if np.count_nonzero(known) < _FEW:
        return []
    apart = np.abs(claimed[known] - own[known])
    typical = float(np.median(apart))
    if typical <= 0.1 + 0.02 * float(np.median(own[known])):
        return []
    return [
        DataWarning(
            "radar-range-contradicts",
            f"{name}: {plan.claimed[0]} and the length of {', '.join(plan.position)} differ by {typical:.2f} m (median); "
            "the positions are used",
            "ask the driver's authors which is right: positions may be in another unit or frame, such as the vehicle's",
        )
    ]


def _azimuth(name: str, plan: ColumnPlan, claimed: np.ndarray, own: np.ndarray) -> list[DataWarning]:
    """Find the sign and unit in which the message's azimuth matches its x and y."""
    telling = np.isfinite(claimed) & (np.abs(own) > _MIN_ANGLE_RAD)
    if plan.axes is not None or np.count_nonzero(telling) < _FEW or not np.any(claimed[telling]):
        return []
    claimed, own = claimed[telling], own[telling]
    apart = {
        (sign, unit): float(np.median(np.abs(np.angle(np.exp(1j * (sign * scale * claimed - own))))))
        for sign in (1, -1)
        for unit, scale in (("rad", 1.0), ("deg", np.pi / 180.0))
    }
    (sign, _), error = min(apart.items(), key=lambda item: item[1])
    columns = f"{name}: {plan.claimed[1]} and the direction of {plan.position[0]}, {plan.position[1]}"
    if error > 0.1:
        return [
            DataWarning(
                "radar-azimuth-contradicts",
                f"{columns} disagree in every unit and sign (by {np.degrees(error):.0f} degrees at best); "
                "the positions are used",
                "ask the driver's authors which is right; if x is not forward, say so with --radar-axes",
            )
        ]
    if sign > 0:
        return []
    return [
        DataWarning(
            "radar-azimuth-mirrored",
            f"{columns} have opposite signs; the positions are used, with y to the left",
            f"if y points to the right: {_MIRROR}; the handedness check of the calibration shows which is right",
        )
    ]


def _elevation(name: str, plan: ColumnPlan, claimed: np.ndarray, own: np.ndarray) -> list[DataWarning]:
    known = np.isfinite(claimed)
    if not known.any() or claimed[known].any() or float(np.median(np.abs(own[known]))) < _MIN_ANGLE_RAD:
        return []
    return [
        DataWarning(
            "radar-elevation-zero",
            f"{name}: {plan.claimed[2]} is always 0, but the heights of the positions are not; the positions are used",
            "no action needed if the driver just does not fill in the angle; otherwise ask its authors what z means",
        )
    ]
