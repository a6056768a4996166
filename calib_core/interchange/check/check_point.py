"""Does a pose reproduce the check point that its file states?"""

import dataclasses

import numpy as np

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.interchange.check.explanation import CheckResult, explain, explained
from calib_core.interchange.check.pixel_differences import LOST_TEXT, far_outside
from calib_core.interchange.check.rounding import Rounding, rounding_of
from calib_core.interchange.imported import StatedCheckPoint, WrittenPose

CHECK_POINT_MISSED = "check-point-missed"
CHECK_POINT_UNUSED = "check-point-unused"
_CLOSE = 1e-4
_CLOSE_PX = 0.05
_OWN_LENS_PX = 0.01


def by_check_point(
    pose: WrittenPose, stated: StatedCheckPoint, camera: Camera | None, *, own: Camera | None = None
) -> CheckResult:
    """Recompute the check point; if the pose misses it, find the slip or the rounding that explains it.

    Args:
        pose: as written.
        stated: the check point.
        camera: what projects it, if only its pixel is stated.
        own: the camera in the file; it must project the point in the camera frame to the pixel, if both are stated.
    """
    point = "(" + ", ".join(f"{value:.4g}" for value in stated.radar_m) + ") m"
    if stated.camera_m is None and camera is None:
        return CheckResult(
            "warning",
            CHECK_POINT_UNUSED,
            f"the check point {point} is given as a pixel, but there is no camera to project it with",
            "check it with --of calibration.json, which has the camera",
        )

    def miss(candidate: RigidTransform) -> float:
        return _miss(candidate, stated, camera)

    missed = miss(pose.camera_from_radar())
    if missed <= 1.0:
        return _by_own_lens(pose, stated, own, point)
    rounding = rounding_of(pose)
    rounded = _explains(rounding, pose, stated, camera)
    if rounded and rounding.is_harmless:
        return CheckResult("good", "check-point", f"the check point {point} is reproduced; {rounding.text}")
    undone = explain(pose, miss, 1.0)
    mismatch = f"the check point {point} {_mismatch(pose.camera_from_radar(), stated, camera)}"
    if undone is not None:
        return explained(undone, mismatch)
    if rounded:
        return CheckResult("error", "rounded", f"{mismatch}: {rounding.text}", "write all the digits")
    return CheckResult(
        "error",
        CHECK_POINT_MISSED,
        f"{mismatch}, and no known slip explains it",
        "the numbers were changed; export the file again",
    )


def _by_own_lens(pose: WrittenPose, stated: StatedCheckPoint, own: Camera | None, point: str) -> CheckResult:
    """Return the result for a pose that reproduces the point: good, unless the file's own camera puts it elsewhere."""
    pixel_px = stated.pixel_px if stated.rectified_px is None else stated.rectified_px
    if own is not None and stated.camera_m is not None and pixel_px is not None:
        pixel = own.project(stated.camera_m[None])[0]
        if not np.hypot(*(pixel - pixel_px)) <= _OWN_LENS_PX:
            seen = dataclasses.replace(stated, camera_m=None, pixel_px=pixel_px)
            mismatch = _mismatch(pose.camera_from_radar(), seen, own)
            return CheckResult(
                "error",
                "other-lens",
                f"the check point {point} is right in the camera frame, but {mismatch}: the intrinsics are another camera's",
                "export the file again, or put back the camera that it was solved with",
            )
    return CheckResult("good", "check-point", f"the check point {point} is reproduced")


def _explains(rounding: Rounding, pose: WrittenPose, stated: StatedCheckPoint, camera: Camera | None) -> bool:
    """Return whether rounding alone can have moved the check point as far as it is from where it should be."""
    camera_from_radar = pose.camera_from_radar()
    point_camera_m = camera_from_radar @ stated.radar_m
    missed = _miss(camera_from_radar, stated, camera)
    if stated.camera_m is not None:
        missed_m = missed * _CLOSE * float(np.linalg.norm(stated.camera_m))
    elif camera is not None:
        px_per_m = float(np.linalg.norm(camera.project_with_jacobian(point_camera_m[None])[1]))
        missed_m = missed * _CLOSE_PX / px_per_m if px_per_m else float("inf")
    else:
        return False
    return missed_m <= rounding.at(stated.radar_m, camera_from_radar)


def _miss(candidate: RigidTransform, stated: StatedCheckPoint, camera: Camera | None) -> float:
    """Return the error of the check point in units of the tolerance."""
    point_camera_m = candidate @ stated.radar_m[None]
    if stated.camera_m is not None:
        return float(np.linalg.norm(point_camera_m[0] - stated.camera_m) / (_CLOSE * np.linalg.norm(stated.camera_m)))
    if stated.pixel_px is None or camera is None:
        return float("inf")
    apart = float(np.hypot(*(camera.project(point_camera_m)[0] - stated.pixel_px))) / _CLOSE_PX
    return apart if np.isfinite(apart) else float("inf")


def _mismatch(candidate: RigidTransform, stated: StatedCheckPoint, camera: Camera | None) -> str:
    point_camera_m = candidate @ stated.radar_m[None]
    if stated.pixel_px is not None and camera is not None:
        pixel = camera.project(point_camera_m)[0]
        lost = far_outside(np.linalg.norm((pixel - stated.pixel_px)[None], axis=1), camera)[0]
        decimals = 1 if lost or np.abs(pixel - stated.pixel_px).max() > _CLOSE_PX * 2 else 3
        there, right = (f"({one[0]:.{decimals}f}, {one[1]:.{decimals}f})" for one in (pixel, stated.pixel_px))
        return f"projects {LOST_TEXT if lost else f'to {there}'} instead of to pixel {right}"
    wanted = stated.camera_m if stated.camera_m is not None else np.full(3, np.nan)
    got, want = (", ".join(f"{value:.3f}" for value in point) for point in (point_camera_m[0], wanted))
    return f"is at ({got}) m in the camera frame instead of ({want}) m"
