"""How usual a mounting is: a camera that looks where the radar looks, upright, close to it; and the mounting in words."""

import math

import numpy as np

from calib_core.geometry import RigidTransform
from calib_core.interchange.rotations import off_forward_rad

_ALONG_RAD, _UPRIGHT_RAD = math.radians(20.0), math.radians(12.0)
_USUAL_ALONG_RAD, _USUAL_UPRIGHT_RAD = math.radians(50.0), math.radians(35.0)
_USUAL_M = (0.01, 4.0)
_TYPICAL_M, _FACTOR = 0.4, 3.5
_LOOKS_ANYWHERE, _ANY_ATTITUDE = 0.02, 0.001
_SMALLEST_M = 1e-3


def _tilts_rad(camera_from_radar: RigidTransform) -> tuple[float, float]:
    """Return the angles between the viewing direction and the radar's x axis, and of the picture's lean to one side."""
    rotation = camera_from_radar.rotation
    lean = abs(math.atan2(rotation[0, 2], -rotation[1, 2]))  # of the radar's up axis in the picture
    return off_forward_rad(camera_from_radar), lean


def mounting_weight(camera_from_radar: RigidTransform) -> float:
    """Return how usual a mounting is, as an unnormalised density over attitudes and over the logarithm of the distance.

    Most pairs of sensors look the same way, within about 20 degrees, upright, decimetres apart; a few look elsewhere.
    """
    along, lean = _tilts_rad(camera_from_radar)
    upright = math.exp(-0.5 * (lean / _UPRIGHT_RAD) ** 2)
    facing = math.exp(-0.5 * (along / _ALONG_RAD) ** 2) * upright
    distance_m = max(float(np.linalg.norm(camera_from_radar.translation_m)), _SMALLEST_M)
    apart = math.exp(-0.5 * (math.log(distance_m / _TYPICAL_M) / math.log(_FACTOR)) ** 2)
    return (facing + _LOOKS_ANYWHERE * upright + _ANY_ATTITUDE) * (apart + 1e-6)


def is_usual(camera_from_radar: RigidTransform) -> bool:
    """Return whether two sensors of one vehicle are often mounted like this."""
    along, lean = _tilts_rad(camera_from_radar)
    distance_m = float(np.linalg.norm(camera_from_radar.translation_m))
    near = distance_m <= _USUAL_M[1] and (distance_m >= _USUAL_M[0] or distance_m == 0.0)
    return along <= _USUAL_ALONG_RAD and lean <= _USUAL_UPRIGHT_RAD and near


def mounting_words(camera_from_radar: RigidTransform) -> str:
    """Return where the camera is, seen from the radar, and where it looks."""
    along, lean = _tilts_rad(camera_from_radar)
    forward, left, up = camera_from_radar.rotation[2].tolist()  # the viewing direction in the radar's axes
    if along <= math.radians(10.0):
        looks = "the camera looks where the radar looks"
    elif forward < -0.8:
        looks = "the camera looks backwards"
    else:
        sides = [(abs(left), "left" if left > 0 else "right"), (abs(up), "up" if up > 0 else "down")]
        looks = f"the camera looks {math.degrees(along):.0f} deg to the {max(sides)[1]}".replace(
            "to the up", "up"
        ).replace("to the down", "down")
    if lean > math.radians(135.0):
        looks += ", upside down"
    elif lean > math.radians(45.0):
        looks += ", on its side"
    elif lean > math.radians(10.0):
        looks += f", leaning {math.degrees(lean):.0f} deg"
    return f"{looks}, {_place_words(camera_from_radar.inverse().translation_m)}"


def _place_words(camera_radar_m: np.ndarray) -> str:
    names = (("forward", "back"), ("left", "right"), ("up", "down"))
    parts = [
        f"{abs(value):.2g} m {name if value > 0 else opposite}"
        for value, (name, opposite) in zip(camera_radar_m.tolist(), names, strict=True)
        if abs(value) >= 0.005
    ]
    return f"from the radar {', '.join(parts)}" if parts else "at the radar's place"
