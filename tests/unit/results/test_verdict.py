"""The verdict: its limits, the consequence of each warning, and the one action."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy.cases import tape_measured
from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.measurements import Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, RadarOptions
from calib_core.results import Calibration, DataWarning, NextPlacement
from calib_core.results.actions import (
    ClickFirst,
    ClickMore,
    ConfirmAssumptions,
    Export,
    FollowHint,
    PlaceReflector,
    ReduceError,
    ReviewPairs,
    SetOption,
)
from calib_core.results.calibration import CovarianceParts
from calib_core.results.verdict import by_consequence, stated_error, verdict_on

FEW = Unsolvable.reported("too-few-pairs", "2 of at least 4 required pairs", "click the reflector at more placements")


def solved(
    count: int = 40, *, tape_m: float | None = 0.01, method: str = "default", noise: str = "imaging"
) -> Calibration:
    simulated = simulate_pairs(count, rng=np.random.default_rng(8), noise=noise)
    calibrated_array = RadarOptions(elevation_lean_sigma=0.0)
    options = CalibrationOptions(method=method, radar=calibrated_array, solving=tape_measured(tape_m))
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


@pytest.fixture(scope="module")
def good() -> Calibration:
    calibration = solved()
    assert verdict_on(calibration).level == "good"
    return calibration


def warned(calibration: Calibration, *codes: str) -> Calibration:
    return replace(
        calibration, warnings=tuple(DataWarning.reported(code, f"about {code}", f"mend {code}") for code in codes)
    )


def test_before_any_click_there_is_nothing_and_an_action():
    verdict = verdict_on(None)
    assert verdict.level == "nothing"
    assert verdict.action == ClickFirst()
    assert verdict_on(None, left=3).action == ClickFirst(placements_known=True)


def test_too_few_pairs_are_nothing_and_the_placements_left_are_the_action():
    assert (verdict_on(FEW).action, verdict_on(FEW).cause) == (FollowHint(), FEW)
    assert verdict_on(FEW, left=7).action == ClickMore(7)
    lost = replace(FEW, unpaired=(Unpaired.reported("c1", "no-scan", "no scan", "click elsewhere"),))
    assert verdict_on(lost, left=7).action == verdict_on(lost).action


def test_pairs_that_agree_on_no_pose_are_contradictory():
    outcome = Unsolvable("no-pose", {"agreeing": 3, "pairs": 9})
    assert (verdict_on(outcome).level, verdict_on(outcome).cause) == ("contradictory", outcome)


def test_a_good_calibration_states_its_error_and_is_done(good):
    verdict = verdict_on(good)
    assert (verdict.level, verdict.error, verdict.cause) == ("good", stated_error(good), None)
    assert verdict.action == verdict_on(good, left=0).action == Export()
    assert verdict.done


def test_a_larger_stated_error_is_usable_then_coarse(good):
    levels = [verdict_on(replace(good, covariance=good.covariance * factor**2)).level for factor in (1, 2, 20)]
    assert levels == ["good", "usable", "coarse"]


def test_the_stated_error_is_larger_than_one_sigma_and_grows_with_the_quantile(good):
    sigma_deg = np.rad2deg(np.sqrt(np.trace(good.covariance[3:, 3:])))
    stated = stated_error(good)
    assert sigma_deg < stated.rotation_deg < 3.5 * sigma_deg
    assert stated_error(replace(good, covariance_quantile=40.0)).rotation_deg > 1.3 * stated.rotation_deg


def test_each_consequence_has_its_level(good):
    for code, level in (
        ("two-poses", "contradictory"),
        ("intrinsics-suspected", "coarse"),
        ("handedness-assumed", "usable"),
    ):
        verdict = verdict_on(warned(good, code))
        assert verdict.level == level
        assert (verdict.action, verdict.cause.code) == (FollowHint(), code)
    assert verdict_on(warned(good, "clock-chosen-early")).level == "good"


def test_the_gravest_warning_decides_whatever_the_order(good):
    codes = ("not-closed", "handedness-assumed", "intrinsics-suspected", "two-poses")
    assert verdict_on(warned(good, *codes)).cause.code == "two-poses"
    ordered = by_consequence(warned(good, *codes).warnings)
    assert [warning.code for warning in ordered] == list(reversed(codes))


def test_few_pairs_are_counted_in_neutral_words():
    calibration = replace(solved(6), warnings=())
    verdict = verdict_on(calibration)
    assert verdict.level == "coarse"
    assert (verdict.pairs, verdict.cause) == (6, None)
    checked = verdict_on(solved(6))
    assert (checked.level, checked.pairs) == ("coarse", 6)
    assert checked.cause.facts == {"agreeing": 6, "pairs": 6, "needed": 8, "clear": True}


def test_what_no_pair_can_show_is_stated(good):
    free, measured = verdict_on(solved(tape_m=None)).assumed, verdict_on(good).assumed
    assert (free.measured, measured.measured) == (False, True)
    for assumed in (free, measured):
        assert assumed.elevations
        assert assumed.principal_point_px > 0.0


def test_what_the_figures_cover_does_not_make_them_coarse(good):
    for code in ("agreeing-outliers", "weak-geometry", "one-pair-decides"):
        verdict = verdict_on(warned(good, code))
        assert (verdict.level, verdict.error) == ("usable", stated_error(good))


def test_residuals_that_nothing_explains_make_them_coarse(good):
    """Of 12 such answers with another defect that were usable by their figures, 5 were inside these."""
    assert verdict_on(warned(good, "residuals-too-large")).level == "coarse"


def test_the_papers_method_is_never_good_and_blames_no_mark():
    verdict = verdict_on(solved(30, method="paper"))
    assert verdict.level == "coarse"
    assert verdict.error is None
    assert verdict.rms_px > 0.0
    assert verdict.action == SetOption("method", "default")
    contradicted = verdict_on(warned(solved(30, method="paper"), "two-poses"))
    assert (contradicted.level, contradicted.action) == ("contradictory", verdict.action)


def test_what_is_assumed_of_the_recording_must_be_confirmed_first(good):
    verdict = verdict_on(good, unconfirmed=2)
    assert verdict.level == "coarse"
    assert verdict.action == ConfirmAssumptions()


def test_the_action_is_what_gains_most_a_placement_or_a_tape():
    calibration = solved(tape_m=None)
    near = NextPlacement(np.array([3.0, 1.0, 0.0]), np.array([10.0, 10.0]), 1.05, may_stop=False)
    shared = verdict_on(replace(calibration, next_placement=near))
    assert shared.action == ReduceError(calibration.dominant_errors()[0].largest.name, measured=False)
    placed = verdict_on(replace(calibration, next_placement=replace(near, gain=9.0)))
    assert placed.action == PlaceReflector((3.0, 1.0, 0.0), 9.0)


def test_clicks_are_to_be_checked_if_their_scatter_is_most_of_the_error(good):
    parts = CovarianceParts(0.2 * good.covariance, np.zeros((6, 6)))
    large = replace(good, covariance=400.0 * good.covariance, covariance_parts=parts, next_placement=None)
    noisy = replace(large.metrics, chi2=2.0 * large.metrics.degrees_of_freedom)
    action = verdict_on(replace(large, metrics=noisy)).action
    assert isinstance(action, ReviewPairs)
    assert len(action.ids) == 3
    shared = CovarianceParts(0.9 * large.covariance, np.zeros((6, 6)))
    for other in (large, replace(large, metrics=noisy, covariance_parts=shared)):
        assert not isinstance(verdict_on(other).action, ReviewPairs)


def test_placements_without_a_click_come_first_and_the_end_is_said():
    calibration = solved(tape_m=None)
    assert verdict_on(calibration, left=3).action == ClickMore(3)
    assert verdict_on(calibration, left=0).everything_clicked
    assert verdict_on(calibration, left=0).done
