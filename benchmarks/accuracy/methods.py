"""The estimators that are compared. All get the same pairs; pixel thresholds are set to their best value."""

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.accuracy.cases import Case, options_of
from benchmarks.accuracy.reproduced import bias_compensated_pnp, gmlpnp
from benchmarks.simulated_pairs import NOISE_PROFILES, SimulatedPairs
from calib_core.calibration import calibrate_pairs
from calib_core.geometry import RigidTransform
from calib_core.options import CalibrationOptions
from calib_core.paper.pnp import refine_lm, solve_pnp
from calib_core.radar import sigma_polar_of
from calib_core.results import Calibration

Method = Callable[[SimulatedPairs, Case], "RigidTransform | None"]

_ITERATIONS = 2000
_DEFAULT_PX = 8.0  # OpenCV's


def best_threshold_px(case: Case, camera_focal_px: float) -> float:
    """Return three sigmas of the residual, which only the simulation knows."""
    profile = NOISE_PROFILES[case.noise]
    angles_px = camera_focal_px * sigma_polar_of(profile)[1:]
    return float(3.0 * np.sqrt((angles_px**2).mean() + profile.sigma_px**2))


def solve_ours(simulated: SimulatedPairs, case: Case) -> Calibration | None:
    """Run the default method."""
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, options_of(case))
    return outcome if isinstance(outcome, Calibration) else None


def as_printed(simulated: SimulatedPairs, threshold_px: float) -> RigidTransform | None:
    """Run Algorithm 1, starting with RANSAC."""
    options = CalibrationOptions(method="paper")
    paper = replace(options.paper, ransac_threshold_px=threshold_px, ransac_iterations=_ITERATIONS)
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, replace(options, paper=paper))
    return outcome.camera_from_radar if isinstance(outcome, Calibration) else None


def _algorithm_1(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    return as_printed(simulated, _DEFAULT_PX)


def _algorithm_1_tuned(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    return as_printed(simulated, _best_px(simulated, case))


def sqpnp_lm(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    """Run SQPnP, then Levenberg-Marquardt, on all pairs."""
    points, pixels = _arrays(simulated)
    pose = solve_pnp(points, pixels, simulated.camera, "sqpnp")
    return None if pose is None else refine_lm(points, pixels, simulated.camera, pose)


def _magsac_lm(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    """Run OpenCV's USAC MAGSAC, then Levenberg-Marquardt on its inliers."""
    import cv2

    points, pixels = _arrays(simulated)
    camera = simulated.camera
    parameters = cv2.UsacParams()
    parameters.threshold = _best_px(simulated, case)
    parameters.maxIterations = _ITERATIONS
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
    kept = np.asarray(rows).ravel()
    pose = RigidTransform(cv2.Rodrigues(turn)[0], shift.ravel())
    return refine_lm(points[kept], pixels[kept], camera, pose)


def _poselib(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    """Run PoseLib's LO-RANSAC with its own refinement."""
    import poselib as library

    points, pixels = _arrays(simulated)
    pose, _ = library.estimate_absolute_pose(
        pixels, points, _colmap_camera(simulated), {"max_reproj_error": _best_px(simulated, case)}, {}
    )
    return _finite(np.asarray(pose.R), np.asarray(pose.t))


def _pycolmap(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    """Run COLMAP's LO-RANSAC with its own refinement."""
    import pycolmap as library

    points, pixels = _arrays(simulated)
    options = library.AbsolutePoseEstimationOptions()
    options.ransac.max_error = _best_px(simulated, case)
    options.ransac.max_num_trials = _ITERATIONS
    options.ransac.random_seed = 0
    found = library.estimate_and_refine_absolute_pose(
        pixels + 0.5, points, library.Camera(_colmap_camera(simulated, half_px=0.5)), options
    )
    if found is None:
        return None
    pose = np.asarray(found["cam_from_world"].matrix())
    return _finite(pose[:, :3], pose[:, 3])


def _gmlpnp(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    """Run GMLPnP, which is told nothing about the noise."""
    return gmlpnp(*_arrays(simulated), simulated.camera)


def _bias_compensated(simulated: SimulatedPairs, case: Case) -> RigidTransform | None:
    """Run the bias-compensated PnP with the true noise."""
    profile = NOISE_PROFILES[case.noise]
    sigma_polar = np.tile(sigma_polar_of(profile), (len(simulated.pairs), 1))
    return bias_compensated_pnp(*_arrays(simulated), sigma_polar, profile.sigma_px, simulated.camera)


def _finite(rotation: np.ndarray, translation_m: np.ndarray) -> RigidTransform | None:
    if not (np.isfinite(rotation).all() and np.isfinite(translation_m).all()):
        return None
    u, _, vt = np.linalg.svd(rotation)
    return RigidTransform(u @ vt, translation_m)


def _colmap_camera(simulated: SimulatedPairs, *, half_px: float = 0.0) -> dict[str, Any]:
    """Describe the camera as COLMAP does; its pixel centres are at half pixels."""
    matrix, distortion = simulated.camera.matrix_px, np.zeros(4)
    distortion[: min(4, len(simulated.camera.distortion))] = simulated.camera.distortion[:4]
    parameters = [matrix[0, 0], matrix[1, 1], matrix[0, 2] + half_px, matrix[1, 2] + half_px, *distortion]
    size = {"width": simulated.camera.width_px, "height": simulated.camera.height_px}
    return {"model": "OPENCV", **size, "params": [float(value) for value in parameters]}


def _arrays(simulated: SimulatedPairs) -> tuple[np.ndarray, np.ndarray]:
    points = np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])
    return points, np.array([pair.pixel_px for pair in simulated.pairs])


def _best_px(simulated: SimulatedPairs, case: Case) -> float:
    return best_threshold_px(case, float(simulated.camera.matrix_px[0, 0]))


PEERS: dict[str, Method] = {
    "Algorithm 1, 8 px": _algorithm_1,
    "Algorithm 1, tuned": _algorithm_1_tuned,
    "SQPnP + LM": sqpnp_lm,
    "MAGSAC + LM": _magsac_lm,
    "PoseLib": _poselib,
    "pycolmap": _pycolmap,
    "GMLPnP": _gmlpnp,
    "bias-compensated PnP": _bias_compensated,
}

_MODULES = {"PoseLib": "poselib", "pycolmap": "pycolmap"}


def available(name: str) -> bool:
    """Return whether the library of a method is installed."""
    return name not in _MODULES or importlib.util.find_spec(_MODULES[name]) is not None
