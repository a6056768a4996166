"""The estimators that are compared. Every one gets the same pairs; pixel thresholds are given their best value as a gift."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.accuracy.cases import Case, options_of
from calib_core.calibrate import calibrate_pairs
from calib_core.geometry import RigidTransform
from calib_core.opencv import refine_lm, solve_pnp
from calib_core.results import Calibration
from calib_core.synthetic import SimulatedPairs

__all__ = ["METHODS", "Estimate", "Method", "best_threshold_px"]

Method = Callable[[SimulatedPairs, Case], "Estimate | None"]


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """A pose, with its covariance where the method has one."""

    camera_from_radar: RigidTransform
    calibration: Calibration | None = None


def best_threshold_px(case: Case) -> float:
    """Return three sigmas of the residual, known to the simulation only."""
    return 14.0 if case.noise == "imaging" else 30.0 if case.noise == "ti_fine" else 53.0


def ours(simulated: SimulatedPairs, case: Case) -> Estimate | None:
    """Run the default method."""
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, options_of(case))
    return Estimate(outcome.camera_from_radar, outcome) if isinstance(outcome, Calibration) else None


def algorithm_1(simulated: SimulatedPairs, case: Case) -> Estimate | None:
    """Run Algorithm 1 as printed, OpenCV's default threshold of 8 px."""
    return _as_printed(simulated, case, 8.0)


def algorithm_1_tuned(simulated: SimulatedPairs, case: Case) -> Estimate | None:
    """Run Algorithm 1 with the best threshold."""
    return _as_printed(simulated, case, best_threshold_px(case))


def _as_printed(simulated: SimulatedPairs, case: Case, threshold_px: float) -> Estimate | None:
    options = options_of(case)
    paper = replace(options.paper, ransac_threshold_px=threshold_px, ransac_iterations=2000)
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, replace(options, method="paper", paper=paper))
    return Estimate(outcome.camera_from_radar) if isinstance(outcome, Calibration) else None


def sqpnp_lm(simulated: SimulatedPairs, case: Case) -> Estimate | None:
    """Run SQPnP, then Levenberg-Marquardt, on all pairs."""
    points, pixels = _arrays(simulated)
    pose = solve_pnp(points, pixels, simulated.camera, "sqpnp")
    refined = None if pose is None else refine_lm(points, pixels, simulated.camera, pose)
    return None if refined is None else Estimate(refined)


def magsac_lm(simulated: SimulatedPairs, case: Case) -> Estimate | None:
    """Run OpenCV's USAC MAGSAC, then Levenberg-Marquardt on its inliers."""
    import cv2

    points, pixels = _arrays(simulated)
    camera = simulated.camera
    parameters = cv2.UsacParams()
    parameters.threshold = best_threshold_px(case)
    parameters.maxIterations = 2000
    parameters.sampler = cv2.SAMPLING_UNIFORM
    parameters.score = cv2.SCORE_METHOD_MAGSAC
    parameters.loMethod = cv2.LOCAL_OPTIM_SIGMA
    try:
        found, _, turn, shift, rows = cv2.solvePnPRansac(
            points, pixels, np.array(camera.matrix_px), np.array(camera.distortion), params=parameters
        )
    except cv2.error:
        return None
    if not found or rows is None or len(rows) < 4 or not np.isfinite(turn).all():
        return None
    pose = RigidTransform(cv2.Rodrigues(turn)[0], shift.ravel())
    kept = np.asarray(rows).ravel()
    refined = refine_lm(points[kept], pixels[kept], camera, pose)
    return None if refined is None else Estimate(refined)


def poselib(simulated: SimulatedPairs, case: Case) -> Estimate | None:
    """Run PoseLib's LO-RANSAC with its own refinement (only where it is installed)."""
    import poselib as library  # type: ignore[import-not-found, unused-ignore]

    points, pixels = _arrays(simulated)
    pose, _ = library.estimate_absolute_pose(
        pixels, points, _colmap_camera(simulated), {"max_reproj_error": best_threshold_px(case)}, {}
    )
    return Estimate(RigidTransform(np.asarray(pose.R), np.asarray(pose.t)))


def _colmap_camera(simulated: SimulatedPairs) -> dict[str, Any]:
    matrix, distortion = simulated.camera.matrix_px, np.zeros(4)
    distortion[: min(4, len(simulated.camera.distortion))] = simulated.camera.distortion[:4]
    parameters = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion]
    size = {"width": simulated.camera.width_px, "height": simulated.camera.height_px}
    return {"model": "OPENCV", **size, "params": [float(value) for value in parameters]}


def _arrays(simulated: SimulatedPairs) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and pixels; of several candidates the most plausible one."""
    points = np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])
    return points, np.array([pair.pixel_px for pair in simulated.pairs])


METHODS: dict[str, Method] = {
    "ours": ours,
    "Algorithm 1": algorithm_1,
    "Algorithm 1, tuned": algorithm_1_tuned,
    "SQPnP + LM": sqpnp_lm,
    "MAGSAC + LM": magsac_lm,
    "PoseLib": poselib,
}
