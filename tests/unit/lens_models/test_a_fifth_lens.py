"""A lens model that the program does not have, added as a contributor would add it: one value, put into the registry."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.files import read_camera
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.exporting import export
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.lens_models.brown_conrady import project_distorted, unproject_distorted
from calib_core.lens_models.lens_model import LensModel, NameElsewhere, TypicalLens
from calib_core.lens_models.registry import LENS_MODELS
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.paper.pnp import solve_pnp_ransac
from calib_core.recordings import open_recording
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
from calib_core.synthetic.rig import typical_camera

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))


def distort(x, y, k):
    """Fitzgibbon's division model: ideal = distorted / (1 + k |distorted|^2), solved for the distorted point."""
    (division,) = k
    r2 = x * x + y * y
    root = np.sqrt(1.0 - 4.0 * division * r2)
    scale = 2.0 / (1.0 + root)
    slope = 4.0 * division / (root * (1.0 + root) ** 2)  # d scale / d r2
    return (x * scale, y * scale), (scale + 2.0 * x * x * slope, 2.0 * x * y * slope, scale + 2.0 * y * y * slope)


def coefficient_jacobian(points, k):
    """Differentiate distort with respect to k: with q the root, d scale / d k is 4 r^2 / (q (1 + q)^2)."""
    x, y = points[..., 0, :] / points[..., 2, :], points[..., 1, :] / points[..., 2, :]
    r2 = x * x + y * y
    root = np.sqrt(1.0 - 4.0 * k[0] * r2)
    slope = 4.0 * r2 / (root * (1.0 + root) ** 2)
    return np.stack([x * slope, y * slope], axis=-2)[..., None, :, :]


DIVISION = LensModel(
    name="division",
    coefficients=("k",),
    counts=(1,),
    project=lambda points, distortion: project_distorted(points, distortion.tolist(), distort),
    unproject=lambda plane, distortion: unproject_distorted(plane, distortion.tolist(), distort),
    coefficient_jacobian=coefficient_jacobian,
    is_perspective=True,
    typical=TypicalLens((-0.2,)),
    names_elsewhere=(NameElsewhere("camera_info", "division", 1), NameElsewhere("colmap", "DIVISION", 1)),
    names_in_files=("division", "fitzgibbon"),
    names_in_messages=("division",),
)


@pytest.fixture
def camera(monkeypatch: pytest.MonkeyPatch) -> Camera:
    monkeypatch.setitem(LENS_MODELS, "division", DIVISION)
    return typical_camera("division")


@pytest.fixture
def file(project_root: Path, camera: Camera) -> CalibrationFile:
    golden = read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    return replace(golden, calibration=replace(golden.calibration, camera=camera))


def points_ahead() -> np.ndarray:
    rng = np.random.default_rng(1)
    return rng.uniform([-3.0, -2.0, 4.0], [3.0, 2.0, 9.0], (40, 3))


def test_it_projects_with_the_slope_of_its_projection(camera):
    points, step_m = points_ahead(), 1e-5
    pixels, jacobian = camera.project_with_jacobian(points)
    columns = [
        (camera.project(points + step_m * axis) - camera.project(points - step_m * axis)) / (2.0 * step_m)
        for axis in np.eye(3)
    ]
    np.testing.assert_allclose(jacobian, np.stack(columns, axis=-1), atol=1e-5)
    undistorted = Camera("division", camera.width_px, camera.height_px, camera.matrix_px, np.zeros(1)).project(points)
    assert np.abs(pixels - undistorted).max() > 5.0
    assert camera.is_distorted


def test_its_pixels_move_with_its_coefficient(camera):
    points, step = points_ahead(), 1e-6 * np.eye(5)[4]
    moved = [camera.with_parameters(camera.parameters + way * step).project(points) for way in (1.0, -1.0)]
    slopes = camera.parameter_planes(points.T)
    np.testing.assert_allclose(slopes[4].T, (moved[0] - moved[1]) / 2e-6, atol=1e-4)


def test_a_point_lies_on_the_ray_of_its_pixel(camera):
    points = points_ahead()
    directions = points / np.linalg.norm(points, axis=1, keepdims=True)
    np.testing.assert_allclose(camera.rays(camera.project(points)), directions, atol=1e-12)
    assert np.isnan(camera.project(-points)).all()
    assert camera.sees(points).tolist() == camera.in_image(camera.project(points)).tolist()


def test_pairs_clicked_through_it_are_solved(camera):
    simulated = simulate_pairs(20, rng=np.random.default_rng(4), camera=camera, outlier_share=0.2)
    calibration = calibrate_pairs(simulated.pairs, simulated.camera, MEASURED).unwrap()
    error = simulated.camera_from_radar.error_from(calibration.camera_from_radar)
    in_sigmas = float(np.sqrt(error @ np.linalg.solve(calibration.covariance, error)))
    assert in_sigmas < np.sqrt(calibration.covariance_quantile)


def test_opencv_solves_it_from_undistorted_points(camera):
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), noise="none", camera=camera)
    solution = solve_pnp_ransac(simulated.points_radar_m, simulated.pixels_px, camera, threshold_px=1.0)
    assert solution.inliers.all()


def test_files_and_formats_that_have_a_name_for_it_store_it(camera, file):
    again = read_camera(camera_info_text(camera))
    assert (again.model, again.distortion.tolist()) == ("division", [-0.2])
    k = camera.matrix_px.ravel().tolist()
    text = json.dumps({"width": 640, "height": 480, "distortion_model": "Fitzgibbon", "D": [0.1, 0.0], "K": k})
    assert read_camera(text).distortion.tolist() == [0.1]
    assert "division" in export(file, "json").data.decode()

    imported = read_any(export(file, "colmap").data, "colmap.zip")
    assert (imported.camera.model, imported.camera.distortion.tolist()) == ("division", [-0.2])


@pytest.mark.slow
def test_a_recording_needs_a_name_for_it_in_camera_info(camera, tmp_path, monkeypatch):
    options = SimulationOptions(camera_model="division", placements=1, width_px=160, height_px=90)
    data = write_recording(simulate(options), tmp_path / "named")
    with open_recording(data) as recording:
        read = recording.camera()
    assert (read.model, read.distortion.tolist()) == ("division", [-0.2])

    monkeypatch.setitem(LENS_MODELS, "division", replace(DIVISION, names_elsewhere=()))
    with pytest.raises(InputError, match="ROS has no name for the lens model division"):
        write_recording(simulate(options), tmp_path / "unnamed")
    assert not (tmp_path / "unnamed").exists()


def test_a_format_without_a_name_for_it_refuses_it_with_a_clear_error(file):
    for name, title in (("kalibr", "Kalibr"), ("opencv", "OpenCV")):
        with pytest.raises(InputError, match=f"{title} has no name for the lens model division; json and matlab"):
            export(file, name)


def test_its_images_are_rectified_with_maps(file):
    camera = file.calibration.camera
    (maps,) = export(file, "kitti").extra_files
    arrays = np.load(io.BytesIO(maps.data), allow_pickle=False)
    corner = np.linalg.inv(arrays["K_new"]) @ [10.0, 20.0, 1.0]
    found_px = arrays["map_x"][20, 10], arrays["map_y"][20, 10]
    np.testing.assert_allclose(found_px, camera.project(corner[None])[0], rtol=0, atol=1e-3)
