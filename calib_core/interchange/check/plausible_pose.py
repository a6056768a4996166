"""Does a pose look like that of two forward-looking sensors on one vehicle?"""

import numpy as np

from calib_core.geometry import RigidTransform
from calib_core.interchange.check.explanation import CheckResult
from calib_core.interchange.check.slips import undone_slips
from calib_core.interchange.imported import WrittenPose
from calib_core.interchange.rotations import looks_forward, off_forward_rad

_FAR_M = 20.0
_SIDEWAYS_RAD = np.radians(60.0)
_NAMED = 3
_PARALLEL = 1e-9
_SEEN = 0.5


def by_plausibility(pose: WrittenPose, *, verified: bool) -> list[CheckResult]:
    """Warn about poses that two forward-looking sensors on one vehicle do not have; other rigs may have them."""
    results = []
    camera_from_radar = pose.camera_from_radar()
    distance_m = float(np.linalg.norm(camera_from_radar.translation_m))
    if distance_m > _FAR_M:
        message = f"the sensors are {distance_m:.4g} m apart"
        results.append(CheckResult("warning", "far-apart", message, "is the translation in millimetres?"))
    if not verified and _is_placeholder(camera_from_radar):
        message = "the camera is exactly at the radar's place, turned by exact right angles"
        results.append(CheckResult("warning", "placeholder", message, "is this the placeholder of a template?"))
    off = off_forward_rad(camera_from_radar)
    if off > _SIDEWAYS_RAD and not verified:
        likely = [s for s in undone_slips(pose) if len(s.slips) == 1 and _is_forward(s.pose)]
        hint = "if it is not mounted like that, perhaps " + ", or ".join(
            list(dict.fromkeys(s.slips[0].message for s in likely))[:_NAMED]
        )
        message = f"the camera points {np.degrees(off):.0f} deg away from the radar's x axis"
        results.append(
            CheckResult("warning", "looks-elsewhere", message, hint if likely else "is it mounted like that?")
        )
    lean = _lean(camera_from_radar)
    if off <= _SIDEWAYS_RAD and lean > _SIDEWAYS_RAD and not verified:
        message = f"the picture leans {np.degrees(lean):.0f} deg to one side"
        hint = "if the camera is not mounted like that, perhaps its frame has other axes: optical (z forward) or body (x forward)"
        results.append(CheckResult("warning", "on-its-side", message, hint))
    return results


def _lean(camera_from_radar: RigidTransform) -> float:
    """Return how far the radar's up axis leans to one side in the picture [rad]; 0 where it is seen from its end."""
    right, down = camera_from_radar.rotation[0, 2], camera_from_radar.rotation[1, 2]
    return abs(float(np.arctan2(right, -down))) if np.hypot(right, down) > _SEEN else 0.0


def _is_placeholder(camera_from_radar: RigidTransform) -> bool:
    """Return whether a pose is what templates contain: no distance, and axes that are parallel to the last digit."""
    rotation = camera_from_radar.rotation
    parallel = np.abs(np.abs(rotation) - np.abs(rotation).round()).max() <= _PARALLEL
    return bool(parallel and not camera_from_radar.translation_m.any())


def _is_forward(pose: WrittenPose) -> bool:
    """Return whether the camera is upright and looks along the radar's x axis."""
    try:
        return looks_forward(pose.camera_from_radar())
    except ValueError:
        return False
