"""PMM: the pose of the mounting, judged on clicks that it does not depend on."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.baselines.mounting import calibrate_by_mounting, mounting_rotation
from calib_core.calibration import calibrate, calibrate_pairs
from calib_core.camera import Camera
from calib_core.measurements import Candidate, Pair, RadarScans, Unsolvable
from calib_core.metrics import aed, cdsd
from calib_core.options import CalibrationOptions, CameraPositionPrior, MountingOptions, SolvingOptions
from calib_core.results import Calibration
from calib_core.verdict import verdict_on

CAMERA = Camera("pinhole", 1280, 720, np.array([[800.0, 0.0, 640.0], [0.0, 800.0, 360.0], [0.0, 0.0, 1.0]]))
TAPE = SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.1)))
OPTIONS = CalibrationOptions(method="pmm", solving=TAPE)


def pair(name: str, point_m: tuple[float, float, float], pixel_px: tuple[float, float]) -> Pair:
    sigma = np.array([0.03, 0.01, 0.02])
    return Pair(name, np.array(pixel_px), (Candidate(np.array(point_m), sigma, np.eye(3)),))


PAIRS = [
    pair("a", (8.0, 0.0, 0.1), (643.0, 364.0)),  # on the axis, 5 px from (640, 360)
    pair("b", (4.0, 1.0, 0.1), (440.0, 372.0)),  # 0.25 to the left is 200 px: 12 px from (440, 360)
    pair("c", (5.0, 0.0, -0.9), (640.0, 541.0)),  # a metre below is 160 px: 21 px from (640, 520)
]


def solved(outcome: Calibration | Unsolvable) -> Calibration:
    assert isinstance(outcome, Calibration), outcome
    return outcome


def test_the_residuals_are_those_of_the_hand_computed_projection() -> None:
    result = solved(calibrate_pairs(PAIRS, CAMERA, OPTIONS))
    assert [one.distance_px for one in result.pairs] == pytest.approx([5.0, 12.0, 21.0])
    assert (result.metrics.aed_px, result.metrics.n) == (pytest.approx(aed(np.array([5.0, 12.0, 21.0]))), 3)
    assert result.metrics.cdsd_px == pytest.approx(cdsd(np.array([5.0, 12.0, 21.0])))


def test_no_click_moves_the_pose_and_none_is_needed() -> None:
    alone = solved(calibrate_pairs([], CAMERA, OPTIONS))
    with_pairs = solved(calibrate_pairs(PAIRS, CAMERA, OPTIONS))
    assert np.array_equal(alone.camera_from_radar.as_matrix(), with_pairs.camera_from_radar.as_matrix())
    assert alone.camera_from_radar.inverse().translation_m == pytest.approx([0.0, 0.0, 0.1])
    assert solved(calibrate([], RadarScans(), CAMERA, OPTIONS)).metrics.n == 0


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
    found = mounting_rotation(options) @ np.array(seen_m)
    if options.roll_deg:
        found = -found  # up in the picture is -y
    assert found == pytest.approx(optical, abs=1e-12)


def test_it_states_no_uncertainty_and_is_never_called_usable() -> None:
    result = solved(calibrate_pairs(PAIRS[:1], CAMERA, OPTIONS))
    assert np.isnan(result.covariance).all()
    assert "states no error" in verdict_on(result).reason
    assert verdict_on(result).level == "weak"


def test_pairs_agree_where_the_assumed_noise_explains_them() -> None:
    far = pair("far", (8.0, 0.0, 0.1), (640.0, 460.0))
    result = solved(calibrate_pairs([*PAIRS, far], CAMERA, OPTIONS))
    assert [one.inlier for one in result.pairs] == [True, True, True, False]


def test_excluded_pairs_are_shown_but_do_not_count() -> None:
    result = solved(calibrate_pairs(PAIRS, CAMERA, OPTIONS, frozenset({"c"})))
    assert (result.metrics.n, result.pairs[2].excluded) == (2, True)
    assert result.metrics.aed_px == pytest.approx(8.5)


def test_without_a_measured_position_it_says_what_to_measure() -> None:
    outcome = calibrate_by_mounting(PAIRS, CAMERA, replace(OPTIONS, solving=SolvingOptions()))
    assert isinstance(outcome, Unsolvable)
    assert outcome.code == "no-camera-position"
    assert "--camera-position-m" in outcome.hint


def test_a_camera_that_looks_elsewhere_is_said_to_miss_the_picture() -> None:
    turned = replace(OPTIONS, mounting=MountingOptions(yaw_deg=120.0))
    result = solved(calibrate_pairs(PAIRS, CAMERA, turned))
    (warning,) = (one for one in result.warnings if one.code == "outside-picture")
    assert "all 3 clicked radar positions outside the picture" in warning.message
    assert verdict_on(result).level == "contradictory"
    assert result.metrics.n == 0
