"""OpenCV's solvers behind one interface, for every lens."""

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs, study_camera
from calib_core.camera import CAMERA_MODELS, Camera
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.paper.pnp import PnPSolver, refine_lm, solve_pnp, solve_pnp_ransac, spans_a_plane
from calib_core.synthetic.rig import typical_camera

SOLVERS: tuple[PnPSolver, ...] = ("iterative", "sqpnp")


def pairs_without_noise(camera: Camera, *, count: int = 20, seed: int = 3) -> SimulatedPairs:
    return simulate_pairs(count, rng=np.random.default_rng(seed), noise="none", camera=camera)


def angle_deg(one: RigidTransform, other: RigidTransform) -> float:
    return float(np.rad2deg(rotation_angle_rad(one.rotation @ other.rotation.T)))


def squared_error_px2(points: np.ndarray, pixels: np.ndarray, camera: Camera, pose: RigidTransform) -> float:
    return float(np.square(camera.project(pose @ points) - pixels).sum())


@pytest.mark.parametrize("model", CAMERA_MODELS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_pnp_gives_the_true_pose_through_every_lens(model, solver):
    simulated = pairs_without_noise(typical_camera(model))
    pose = solve_pnp(simulated.points_radar_m, simulated.pixels_px, simulated.camera, solver)
    assert angle_deg(pose, simulated.camera_from_radar) < 0.01
    np.testing.assert_allclose(pose.translation_m, simulated.camera_from_radar.translation_m, atol=2e-3)


@pytest.mark.parametrize("model", CAMERA_MODELS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_ransac_names_the_wrong_pairs_through_every_lens(model, solver):
    simulated = pairs_without_noise(typical_camera(model))
    pixels = simulated.pixels_px.copy()
    wrong = [2, 7, 11]
    pixels[wrong] += [[150.0, -90.0], [-120.0, 130.0], [200.0, 60.0]]
    solution = solve_pnp_ransac(simulated.points_radar_m, pixels, simulated.camera, solver, threshold_px=4.0)
    assert np.flatnonzero(~solution.inliers).tolist() == wrong
    assert angle_deg(solution.camera_from_radar, simulated.camera_from_radar) < 0.02


@pytest.mark.parametrize("model", CAMERA_MODELS)
def test_refinement_reaches_the_least_squares_of_the_pixels(model):
    rng = np.random.default_rng(5)
    simulated = pairs_without_noise(typical_camera(model))
    points, camera = simulated.points_radar_m, simulated.camera
    pixels = simulated.pixels_px + 3.0 * rng.standard_normal(simulated.pixels_px.shape)
    start = simulated.camera_from_radar.perturbed(np.array([0.2, -0.1, 0.1, 0.03, -0.02, 0.04]))
    refined = refine_lm(points, pixels, camera, start)
    assert refined is not None
    least = squared_error_px2(points, pixels, camera, refined)
    assert least < squared_error_px2(points, pixels, camera, simulated.camera_from_radar)
    for error in np.concatenate([np.eye(6), -np.eye(6)]) * np.repeat([3e-3, 3e-4], 3)[None]:
        assert squared_error_px2(points, pixels, camera, refined.perturbed(error)) > least


def test_our_own_refinement_agrees_with_opencvs():
    # a tiny skew selects our own refinement for the same problem
    rng = np.random.default_rng(6)
    simulated = pairs_without_noise(study_camera())
    pixels = simulated.pixels_px + 3.0 * rng.standard_normal(simulated.pixels_px.shape)
    start = simulated.camera_from_radar.perturbed(np.array([0.1, -0.1, 0.1, 0.02, -0.02, 0.02]))
    theirs = refine_lm(simulated.points_radar_m, pixels, simulated.camera, start)
    ours = refine_lm(simulated.points_radar_m, pixels, skewed(simulated.camera, 1e-9), start)
    assert angle_deg(theirs, ours) < 1e-4
    np.testing.assert_allclose(theirs.translation_m, ours.translation_m, atol=1e-5)


def skewed(camera: Camera, skew_px: float) -> Camera:
    matrix = camera.matrix_px.copy()
    matrix[0, 1] = skew_px
    return Camera(camera.model, camera.width_px, camera.height_px, matrix, camera.distortion)


def test_skew_is_not_dropped_silently():
    simulated = pairs_without_noise(skewed(typical_camera("plumb_bob"), 40.0))
    pose = solve_pnp(simulated.points_radar_m, simulated.pixels_px, simulated.camera, "sqpnp")
    assert pose is not None
    assert angle_deg(pose, simulated.camera_from_radar) < 0.01


@pytest.mark.parametrize("count", [4, 5, 6])
@pytest.mark.parametrize("solver", SOLVERS)
def test_few_pairs_are_enough_from_four_on(count, solver):
    simulated = pairs_without_noise(study_camera(), count=count, seed=8)
    points, pixels, camera = simulated.points_radar_m, simulated.pixels_px, simulated.camera
    for pose in (solve_pnp(points, pixels, camera, solver), solve_pnp_ransac(points, pixels, camera, solver)):
        assert pose is not None


@pytest.mark.parametrize("solver", SOLVERS)
def test_three_pairs_are_too_few(solver):
    simulated = pairs_without_noise(study_camera(), count=3)
    points, pixels, camera = simulated.points_radar_m, simulated.pixels_px, simulated.camera
    assert solve_pnp(points, pixels, camera, solver) is None
    assert solve_pnp_ransac(points, pixels, camera, solver) is None
    assert refine_lm(points[:2], pixels[:2], camera, simulated.camera_from_radar) is None


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("step", [0.0, 0.5], ids=["one point", "one line"])
def test_no_pose_from_one_point_or_one_line(solver, step):
    points = np.array([[5.0, 0.3, -0.4]]) + step * np.arange(8)[:, None] * np.array([[1.0, 0.2, 0.1]])
    pixels = np.random.default_rng(1).uniform(100.0, 900.0, (8, 2))
    assert not spans_a_plane(points)
    assert solve_pnp(points, pixels, study_camera(), solver) is None
    assert solve_pnp_ransac(points, pixels, study_camera(), solver) is None


def test_no_pose_where_no_pairs_agree():
    rng = np.random.default_rng(2)
    points = rng.uniform([2.0, -3.0, -1.0], [15.0, 3.0, 1.0], (20, 3))
    pixels = rng.uniform([0.0, 0.0], [1900.0, 1000.0], (20, 2))
    assert solve_pnp_ransac(points, pixels, study_camera(), "sqpnp", threshold_px=0.01, iterations=200) is None


def test_a_fisheye_click_at_ninety_degrees_is_no_inlier_but_does_no_harm():
    simulated = pairs_without_noise(typical_camera("equidistant"))
    camera = simulated.camera
    sideways_px = camera.project(np.array([[1.0, 0.0, -0.05]]))  # seen a little behind the image plane
    points = np.concatenate([simulated.points_radar_m, [[0.0, -3.0, 0.0]]])
    pixels = np.concatenate([simulated.pixels_px, sideways_px])
    solution = solve_pnp_ransac(points, pixels, camera, "sqpnp")
    assert solution.inliers.tolist() == [True] * 20 + [False]


def test_the_same_pairs_give_the_same_bits():
    simulated = simulate_pairs(20, rng=np.random.default_rng(9), noise="imaging", outlier_share=0.2)
    points = np.stack([pair.candidates[0].position_radar_m for pair in simulated.pairs])
    pixels = np.stack([pair.pixel_px for pair in simulated.pairs])
    first, second = (solve_pnp_ransac(points, pixels, simulated.camera, threshold_px=15.0) for _ in range(2))
    assert first.camera_from_radar.as_matrix().tobytes() == second.camera_from_radar.as_matrix().tobytes()
    assert first.inliers.tobytes() == second.inliers.tobytes()
