"""Refined intrinsics: estimated with the pose from what is known of them, and stated as well as they are known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.accuracy.defects.wrong_lens import WrongLens, board_covariance, draw_wrong_lens, measure_wrong_lens
from calib_core.calibration import calibrate_pairs, preview_pairs, solve_again
from calib_core.camera import Camera, CameraCovariance
from calib_core.errors import OptionError
from calib_core.evaluation.residuals import residual_test
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions, RefiningOptions
from calib_core.results import Calibration
from calib_core.results.actions import CalibrateLens
from calib_core.words.warnings import warning_remark
from cocalib.view.figures import refined_sentences

TOLD = WrongLens("focal 2 %", refined=True, scale_told=True, alone=True)
UNTOLD = WrongLens("focal 2 %", refined=True)


def solved(pairs: tuple[Pair, ...], camera: Camera, options: CalibrationOptions) -> Calibration:
    return calibrate_pairs(pairs, camera, options).unwrap()


@cache
def refined(case: WrongLens = TOLD) -> Calibration:
    simulated, given = draw_wrong_lens(case, 0)
    return solved(simulated.pairs, given, case.options)


@pytest.mark.slow
def test_a_focal_error_of_2_percent_comes_below_0_3_percent_where_the_scale_is_told():
    trials = [measure_wrong_lens(TOLD, trial) for trial in range(10)]
    errors = np.array([one["focal"] for one in trials], dtype=np.float64)
    sigmas = np.array([one["focal_sigma"] for one in trials], dtype=np.float64)
    assert np.sqrt((errors**2).mean()) < 0.003
    assert (np.abs(errors) < 3.0 * sigmas).all()
    assert not any("code lens-or-radar-scale" in one for one in trials)


@pytest.mark.slow
def test_with_the_default_prior_on_the_scale_the_data_cannot_tell_and_sigma_says_so():
    trials = [measure_wrong_lens(replace(UNTOLD, lens="refining priors"), trial) for trial in range(7)]
    assert all("code lens-or-radar-scale" in one for one in trials)
    errors = np.array([one["focal"] for one in trials], dtype=np.float64)
    sigmas = np.array([one["focal_sigma"] for one in trials], dtype=np.float64)
    assert 0.4 < np.sqrt(((errors / sigmas) ** 2).mean()) < 1.6
    (warning,) = [one for one in refined(UNTOLD).warnings if one.code == "lens-or-radar-scale"]
    assert [one.name for one in warning.facts["scales"]] == ["azimuth_scale", "elevation_scale"]
    assert warning_remark(warning).action == CalibrateLens()


@pytest.mark.slow
def test_refining_with_a_true_covariance_does_not_make_the_pose_worse():
    given, better = (
        [measure_wrong_lens(WrongLens("covariance", refined=one), trial) for trial in range(5)] for one in (False, True)
    )
    for name in ("rotation_rad", "position_m"):
        before, after = (np.array([one[name] for one in trials], dtype=np.float64) for trials in (given, better))
        assert np.sqrt((after**2).mean()) < 1.02 * np.sqrt((before**2).mean())


def test_the_answer_holds_the_refined_camera_how_well_it_is_known_and_what_it_came_from():
    _, given = draw_wrong_lens(TOLD, 0)
    found = refined()
    np.testing.assert_array_equal(found.given_camera.parameters, given.parameters)
    assert found.camera.covariance.order == ("fx_px", "fy_px", "cx_px", "cy_px", "k1")
    assert 0.0 < found.camera.covariance.sigma("fx_px") < 0.01 * given.matrix_px[0, 0]
    by_name = {one.name: one for one in found.systematic_errors}
    focal = by_name["focal_length"]
    assert found.camera.matrix_px[0, 0] == pytest.approx(given.matrix_px[0, 0] * (1.0 + focal.value))
    assert focal.estimated
    assert focal.sigma < focal.prior_sigma == RefiningOptions().focal_length_sigma


def test_residuals_are_those_through_the_refined_camera():
    found = refined()
    for pair in found.pairs:
        np.testing.assert_allclose(pair.projected_px, found.reproject(pair.point_radar_m[None])[0])


def test_an_excluded_pair_is_seen_through_the_refined_camera_too():
    simulated, given = draw_wrong_lens(TOLD, 0)
    outcome = calibrate_pairs(simulated.pairs, given, TOLD.options, frozenset({"p3"})).unwrap()
    (one,) = [pair for pair in outcome.pairs if pair.excluded]
    np.testing.assert_allclose(one.projected_px, outcome.reproject(one.point_radar_m[None])[0])


def test_solving_the_file_again_starts_from_the_given_camera_and_gives_the_same_bytes():
    text = calibration_text(refined())
    read = read_calibration(text).calibration
    assert read.given_camera is not None
    again = solve_again(read).unwrap()
    assert calibration_text(again) == text


def test_without_refining_the_same_file_is_solved_with_the_given_camera():
    read = read_calibration(calibration_text(refined())).calibration
    plain = solve_again(read, replace(read.options, refining=RefiningOptions())).unwrap()
    assert plain.given_camera is None
    np.testing.assert_array_equal(plain.camera.matrix_px, draw_wrong_lens(TOLD, 0)[1].matrix_px)


def test_a_file_says_nothing_of_refining_if_there_was_none():
    simulated, given = draw_wrong_lens(replace(TOLD, refined=False), 0)
    text = calibration_text(solved(simulated.pairs, given, CalibrationOptions()))
    assert "given_camera" not in text
    assert "refining" not in text


def test_the_preview_refines_as_well():
    simulated, given = draw_wrong_lens(TOLD, 0)
    first = preview_pairs(simulated.pairs, given, TOLD.options)
    assert first.camera.matrix_px[0, 0] == pytest.approx(refined().camera.matrix_px[0, 0], rel=1e-3)


def test_other_pairs_are_tested_with_the_refined_camera():
    simulated, _ = draw_wrong_lens(TOLD, 0)
    tested = residual_test(simulated.pairs, refined())
    assert not tested.misfits.any()
    np.testing.assert_allclose(tested.distances_px, [pair.distance_px for pair in refined().pairs], rtol=1e-6)


def test_where_a_covariance_and_the_pairs_disagree_the_warning_says_by_how_much():
    simulated, given = draw_wrong_lens(TOLD, 0)
    camera = replace(given, covariance=board_covariance(given))
    for refine in (False, True):
        options = replace(TOLD.options, refining=RefiningOptions(intrinsics=refine))
        found = solved(simulated.pairs, camera, options).warnings
        (warning,) = [one for one in found if one.code == "intrinsics-suspected"]
        assert abs(warning.facts["focal_length"]) == pytest.approx(0.02, abs=3.5 * warning.facts["sigma"])


def test_a_covariance_wide_enough_for_the_error_is_no_reason_for_a_warning():
    simulated, given = draw_wrong_lens(TOLD, 0)
    camera = replace(given, covariance=board_covariance(given, size=20.0))
    found = solved(simulated.pairs, camera, replace(TOLD.options, refining=RefiningOptions()))
    assert "intrinsics-suspected" not in {one.code for one in found.warnings}


def with_lens(camera: Camera, *, focal: float = 1.0, k1: float | None = None) -> Camera:
    values = camera.parameters.copy()
    values[:2] *= focal
    values[4] = values[4] if k1 is None else k1
    return camera.with_parameters(values)


@pytest.mark.parametrize("focal", [1.12, 1.15])
def test_a_lens_refined_far_beyond_its_prior_is_not_passed_off_as_known(focal):
    simulated, given = draw_wrong_lens(TOLD, 0)
    found = solved(simulated.pairs, with_lens(given, focal=focal), TOLD.options)
    (warning,) = [one for one in found.warnings if one.code == "intrinsics-suspected"]
    (focal,) = [one for one in warning.facts["refined_too_far"] if one.name == "focal_length"]
    assert focal.value < -3.0 * focal.prior_sigma
    assert warning_remark(warning).action == CalibrateLens()


@pytest.mark.parametrize("k1", [0.35, *(pytest.param(k1, marks=pytest.mark.slow) for k1 in (0.4, 0.5, 0.6))])
def test_a_distortion_that_refining_does_not_reach_leaves_large_residuals(k1):
    simulated, given = draw_wrong_lens(TOLD, 0)
    found = solved(simulated.pairs, with_lens(given, k1=k1), TOLD.options)
    (warning,) = [one for one in found.warnings if one.code == "residuals-too-large"]
    assert warning.facts["chi2_per_degree"] > 2.0


def test_a_change_that_the_pairs_leave_uncertain_is_stated_all_the_same():
    simulated, given = draw_wrong_lens(TOLD, 0)
    found = solved(simulated.pairs, with_lens(given, k1=0.3), TOLD.options)
    assert found.camera.matrix_px[0, 0] < 0.95 * given.matrix_px[0, 0]
    (sentence,) = refined_sentences(found)
    assert "focal length by -" in str(sentence)


def test_a_good_lens_is_refined_without_suspicion():
    assert "intrinsics-suspected" not in {one.code for one in refined().warnings}


@pytest.mark.parametrize(
    ("names", "sigma_px", "refine", "worst"),
    [
        (("fx_px", "fy_px"), 0.0, True, ""),
        (("fx_px", "fy_px"), 2000.0, True, "fx_px"),
        (("fx_px", "fy_px"), 2000.0, False, "fx_px"),
        (("cx_px", "cy_px"), 3000.0, False, "cx_px"),
        (("cy_px", "k1"), 3000.0, True, "cy_px"),
    ],
)
def test_a_covariance_that_leaves_nothing_to_refine_or_nothing_known_is_refused(names, sigma_px, refine, worst):
    simulated, given = draw_wrong_lens(TOLD, 0)
    camera = replace(given, covariance=CameraCovariance(names, sigma_px**2 * np.eye(2)))
    options = CalibrationOptions(refining=RefiningOptions(intrinsics=refine))
    outcome = calibrate_pairs(simulated.pairs, camera, options)
    assert outcome.code == "useless-lens-covariance"
    assert outcome.facts.get("parameter", "") == worst
    assert outcome.facts.get("sigma_px", 0.0) == pytest.approx(sigma_px)


def test_exact_intrinsics_that_are_not_to_be_refined_are_used():
    simulated, given = draw_wrong_lens(TOLD, 0)
    camera = replace(given, covariance=CameraCovariance(("fx_px", "fy_px"), np.zeros((2, 2))))
    assert isinstance(calibrate_pairs(simulated.pairs, camera), Calibration)


def test_residuals_that_an_uncertain_lens_leaves_are_not_blamed_on_the_radar_alone():
    simulated, given = draw_wrong_lens(TOLD, 0)
    wrong = with_lens(given, k1=0.1)
    camera = replace(wrong, covariance=CameraCovariance(("fx_px", "fy_px", "k1"), np.diag([1e4, 1e4, 0.4**2])))
    uncertain = {}
    for refine in (False, True):
        options = replace(TOLD.options, refining=RefiningOptions(intrinsics=refine))
        found = solved(simulated.pairs, camera, options)
        uncertain[refine] = [one.facts["uncertain_lens"] for one in found.warnings if one.code == "smooth-angle-errors"]
    assert uncertain == {False: [True], True: []}


def test_the_papers_method_takes_the_intrinsics_as_they_are():
    simulated, given = draw_wrong_lens(TOLD, 0)
    options = CalibrationOptions(method="paper", refining=RefiningOptions(intrinsics=True))
    with pytest.raises(OptionError, match="the method paper takes the intrinsics as they are"):
        calibrate_pairs(simulated.pairs, given, options)


def test_nothing_to_refine_is_refused():
    simulated, given = draw_wrong_lens(TOLD, 0)
    options = CalibrationOptions(refining=RefiningOptions(True, 0.0, 0.0, 0.0))
    with pytest.raises(OptionError, match="nothing to refine"):
        calibrate_pairs(simulated.pairs, given, options)
