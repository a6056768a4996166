"""Swaps: the rotation of one calibration with the translation of another."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.baselines.swaps import swapped
from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.metrics import aed
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.synthetic import random_rig, simulate_pairs, typical_camera
from calib_core.verdict import verdict_on


@pytest.fixture(scope="module")
def by_both() -> tuple[Calibration, Calibration]:
    rng = np.random.default_rng(9)
    rig = random_rig(rng, camera=typical_camera())
    pairs = simulate_pairs(15, rng=rng, rig=rig, noise="imaging").pairs
    tape = SolvingOptions(camera_position=CameraPositionPrior(tuple(rig.camera_position_radar_m.tolist())))
    outcomes = [
        calibrate_pairs(pairs, rig.camera, CalibrationOptions(method=method, solving=tape))
        for method in ("paper", "pmm")
    ]
    assert all(isinstance(one, Calibration) for one in outcomes)
    return outcomes[0].unwrap(), outcomes[1].unwrap()


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
    assert "rotation of a calibration by the method paper" in note.message
    assert "translation of one by the method pmm" in note.message
    assert np.isnan(found.covariance).all()
    assert verdict_on(found).level in ("weak", "contradictory")


def test_two_cameras_cannot_be_combined(by_both: tuple[Calibration, Calibration]) -> None:
    paper, mounting = by_both
    other = replace(mounting, camera=paper.camera.scaled(0.5))
    with pytest.raises(InputError, match="different intrinsics"):
        swapped(paper, other)
    shifted = replace(paper.camera, matrix_px=paper.camera.matrix_px + np.array([[0, 0, 5.0], [0, 0, 0], [0, 0, 0]]))
    with pytest.raises(InputError, match="different intrinsics"):
        swapped(paper, replace(mounting, camera=shifted))
