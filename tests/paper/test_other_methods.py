"""PMM: the pose of the mounting, judged on clicks that it does not depend on. Exchanges: the rotation of one calibration
with the translation of another."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import mounting_rotation
from calib_core.measurements import Candidate, Pair
from calib_core.options import CalibrationOptions, CameraPositionPrior, MountingOptions, SolvingOptions
from calib_core.paper.other_methods import calibrate_by_mounting, swapped
from calib_core.results import Calibration
from calib_core.results.metrics import aed, cdsd
from calib_core.results.verdict import verdict_on
from calib_core.synthetic import random_rig, simulate_pairs, typical_camera

CAMERA = Camera("pinhole", 1280, 720, np.array([[800.0, 0.0, 640.0], [0.0, 800.0, 360.0], [0.0, 0.0, 1.0]]))
TAPE = SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.1)))
OPTIONS = CalibrationOptions(method="paper", solving=TAPE)


def pair(name: str, point_m: tuple[float, float, float], pixel_px: tuple[float, float]) -> Pair:
    sigma = np.array([0.03, 0.01, 0.02])
    return Pair(name, np.array(pixel_px), (Candidate(np.array(point_m), sigma, np.eye(3)),))


PAIRS = [
    pair("a", (8.0, 0.0, 0.1), (643.0, 364.0)),  # on the axis, 5 px from (640, 360)
    pair("b", (4.0, 1.0, 0.1), (440.0, 372.0)),  # 0.25 to the left is 200 px: 12 px from (440, 360)
    pair("c", (5.0, 0.0, -0.9), (640.0, 541.0)),  # a metre below is 160 px: 21 px from (640, 520)
]


def test_the_residuals_are_those_of_the_hand_computed_projection() -> None:
    result = calibrate_by_mounting(PAIRS, CAMERA, OPTIONS)
    assert [one.distance_px for one in result.pairs] == pytest.approx([5.0, 12.0, 21.0])
    assert (result.metrics.aed_px, result.metrics.n) == (pytest.approx(aed(np.array([5.0, 12.0, 21.0]))), 3)
    assert result.metrics.cdsd_px == pytest.approx(cdsd(np.array([5.0, 12.0, 21.0])))


def test_no_click_moves_the_pose_and_none_is_needed() -> None:
    alone = calibrate_by_mounting([], CAMERA, OPTIONS)
    with_pairs = calibrate_by_mounting(PAIRS, CAMERA, OPTIONS)
    assert np.array_equal(alone.camera_from_radar.as_matrix(), with_pairs.camera_from_radar.as_matrix())
    assert alone.camera_from_radar.inverse().translation_m == pytest.approx([0.0, 0.0, 0.1])
    assert alone.metrics.n == 0


@pytest.mark.parametrize(
    ("options", "seen_m", "optical"),
    [
        (MountingOptions(yaw_deg=90.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),  # looks left: what is left is ahead
        (MountingOptions(pitch_deg=30.0), (np.cos(np.pi / 6), 0.0, -0.5), (0.0, 0.0, 1.0)),  # looks down
        (MountingOptions(roll_deg=90.0), (0.0, -1.0, 0.0), (0.0, 1.0, 0.0)),  # its head to the right: right is up there
    ],
)
def test_angles_turn_the_camera_as_they_say(
    options: MountingOptions, seen_m: tuple[float, ...], optical: tuple[float, ...]
) -> None:
    found = mounting_rotation(*astuple(options)) @ np.array(seen_m)
    if options.roll_deg:
        found = -found  # up in the picture is -y
    assert found == pytest.approx(optical, abs=1e-12)


def test_it_states_no_uncertainty_and_is_never_called_usable() -> None:
    result = calibrate_by_mounting(PAIRS[:1], CAMERA, OPTIONS)
    assert np.isnan(result.covariance).all()
    assert "states no error" in verdict_on(result).reason
    assert verdict_on(result).level == "coarse"


def test_pairs_agree_where_the_assumed_noise_explains_them() -> None:
    far = pair("far", (8.0, 0.0, 0.1), (640.0, 460.0))
    result = calibrate_by_mounting([*PAIRS, far], CAMERA, OPTIONS)
    assert [one.inlier for one in result.pairs] == [True, True, True, False]


def test_excluded_pairs_are_shown_but_do_not_count() -> None:
    result = calibrate_by_mounting(PAIRS, CAMERA, OPTIONS, excluded=frozenset({"c"}))
    assert (result.metrics.n, result.pairs[2].excluded) == (2, True)
    assert result.metrics.aed_px == pytest.approx(8.5)


def test_without_a_measured_position_it_says_what_to_measure() -> None:
    with pytest.raises(InputError, match="forward, left, up"):
        calibrate_by_mounting(PAIRS, CAMERA, replace(OPTIONS, solving=SolvingOptions()))


def test_a_camera_that_looks_elsewhere_is_said_to_miss_the_picture() -> None:
    turned = replace(OPTIONS, mounting=MountingOptions(yaw_deg=120.0))
    result = calibrate_by_mounting(PAIRS, CAMERA, turned)
    (warning,) = (one for one in result.warnings if one.code == "outside-picture")
    assert "all 3 clicked radar positions outside the picture" in warning.message
    assert verdict_on(result).level == "contradictory"
    assert result.metrics.n == 0


@pytest.fixture(scope="module")
def by_both() -> tuple[Calibration, Calibration]:
    rng = np.random.default_rng(9)
    rig = random_rig(rng, camera=typical_camera())
    pairs = simulate_pairs(15, rng=rng, rig=rig, noise="imaging").pairs
    tape = SolvingOptions(camera_position=CameraPositionPrior(tuple(rig.camera_position_radar_m.tolist())))
    options = CalibrationOptions(method="paper", solving=tape)
    return calibrate_pairs(pairs, rig.camera, options).unwrap(), calibrate_by_mounting(pairs, rig.camera, options)


def test_each_part_comes_from_its_own_calibration(by_both: tuple[Calibration, Calibration]) -> None:
    paper, mounting = by_both
    found = swapped(paper, mounting)
    assert np.array_equal(found.camera_from_radar.rotation, paper.camera_from_radar.rotation)
    assert np.array_equal(found.camera_from_radar.translation_m, mounting.camera_from_radar.translation_m)


def test_it_is_judged_on_the_pairs_of_the_first_by_its_own_projection(by_both: tuple[Calibration, Calibration]) -> None:
    paper, mounting = by_both
    found = swapped(paper, mounting)
    points = np.array([pair.point_radar_m for pair in paper.pairs])
    clicks = np.array([pair.pixel_px for pair in paper.pairs])
    pixels = paper.camera.project(found.camera_from_radar @ points)
    assert found.metrics.aed_px == pytest.approx(aed(np.linalg.norm(pixels - clicks, axis=1)))
    assert found.metrics.n == len(paper.pairs)


def test_swapping_with_itself_changes_no_residual(by_both: tuple[Calibration, Calibration]) -> None:
    paper, _ = by_both
    assert swapped(paper, paper).metrics.aed_px == pytest.approx(paper.metrics.aed_px)


def test_it_says_what_it_is_and_states_no_error(by_both: tuple[Calibration, Calibration]) -> None:
    found = swapped(*by_both)
    (note,) = (one for one in found.warnings if one.code == "swapped-parts")
    assert "rotation of one calibration and the translation of another" in note.message
    assert np.isnan(found.covariance).all()
    assert verdict_on(found).level in ("coarse", "contradictory")


def test_two_cameras_cannot_be_combined(by_both: tuple[Calibration, Calibration]) -> None:
    paper, mounting = by_both
    other = replace(mounting, camera=paper.camera.scaled(0.5))
    with pytest.raises(InputError, match="different intrinsics"):
        swapped(paper, other)
    shifted = replace(paper.camera, matrix_px=paper.camera.matrix_px + np.array([[0, 0, 5.0], [0, 0, 0], [0, 0, 0]]))
    with pytest.raises(InputError, match="different intrinsics"):
        swapped(paper, replace(mounting, camera=shifted))
