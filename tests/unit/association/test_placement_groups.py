"""Clicks of one placement are one pair, and each still has a result of its own."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.association.placement_groups import linked_clicks, placement_groups
from calib_core.calibration import calibrate, calibrate_pairs, solve_again
from calib_core.interchange import calibration_text
from calib_core.measurements import NS_PER_S, Pair, RadarScan, RadarScans, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.synthetic import SimulatedPairs, simulate_pairs

OPTIONS = CalibrationOptions()


def repeated(simulated: SimulatedPairs, clicks: int, rng: np.random.Generator, *, timed: bool = False) -> list[Pair]:
    """Click every placement several times with 2 px of noise; its radar position has one error."""
    return [
        replace(
            pair,
            id=f"{pair.id}.{k}",
            pixel_px=pixel + 2.0 * rng.standard_normal(2),
            image_time=TimeNs((20 * i + k) * NS_PER_S) if timed else None,
        )
        for i, (pair, pixel) in enumerate(zip(simulated.pairs, simulated.pixels_px, strict=True))
        for k in range(clicks)
    ]


def solved(pairs: list[Pair], simulated: SimulatedPairs) -> Calibration:
    outcome = calibrate_pairs(pairs, simulated.camera, OPTIONS)
    assert isinstance(outcome, Calibration), outcome
    return outcome


@pytest.mark.parametrize("timed", [True, False], ids=["with times", "without times"])
def test_three_clicks_of_a_placement_are_one_pair_with_their_mean(timed: bool) -> None:
    rng = np.random.default_rng(1)
    pairs = repeated(simulate_pairs(6, rng=rng), 3, rng, timed=timed)
    groups = placement_groups(pairs, OPTIONS)
    assert [group.pair.id for group in groups] == [f"p{i}.0" for i in range(1, 7)]
    for i, group in enumerate(groups):
        assert [click.id for click in group.clicks] == [pair.id for pair in pairs[3 * i : 3 * i + 3]]
        mean_px = np.mean([click.pixel_px for click in group.clicks], axis=0)
        np.testing.assert_allclose(group.pair.pixel_px, mean_px, atol=1e-9)
        assert group.pair.sigma_px == pytest.approx(np.sqrt(1.0 + 4.0 / 3.0))
        assert not group.off.any()


def test_single_clicks_keep_their_pairs_as_they_are() -> None:
    simulated = simulate_pairs(40, rng=np.random.default_rng(2), decoys=3, outlier_share=0.2)
    groups = placement_groups(simulated.pairs, OPTIONS)
    assert all(group.pair is pair for group, pair in zip(groups, simulated.pairs, strict=True))


def test_the_same_pixel_with_another_radar_position_is_another_placement() -> None:
    simulated = simulate_pairs(2, rng=np.random.default_rng(3))
    one, other = simulated.pairs
    moved = replace(other, pixel_px=one.pixel_px)
    assert len(placement_groups([one, moved], OPTIONS)) == 2


def test_two_reflectors_clicked_in_neighbouring_frames_are_two_placements() -> None:
    simulated = simulate_pairs(2, rng=np.random.default_rng(4))
    both = tuple(candidate for pair in simulated.pairs for candidate in pair.candidates)
    pairs = [
        replace(pair, candidates=both, image_time=TimeNs(k * NS_PER_S // 5)) for k, pair in enumerate(simulated.pairs)
    ]
    assert len(placement_groups(pairs, OPTIONS)) == 2


def test_two_marks_of_one_frame_are_two_reflectors_unless_they_are_at_one_point() -> None:
    pair = simulate_pairs(1, rng=np.random.default_rng(3)).pairs[0]
    one = replace(pair, id="one", image_time=TimeNs(NS_PER_S))
    beside = replace(one, id="beside", pixel_px=pair.pixel_px + np.array([8.5, 0.0]))
    again = replace(one, id="again", pixel_px=pair.pixel_px + np.array([2.0, 0.0]))
    later = replace(beside, id="later", image_time=TimeNs(2 * NS_PER_S))
    assert len(linked_clicks([one, beside], OPTIONS)) == 2
    assert len(linked_clicks([one, again], OPTIONS)) == 1
    assert len(linked_clicks([one, later], OPTIONS)) == 1


def test_a_click_far_from_the_others_of_its_placement_is_out_and_shown_as_an_outlier() -> None:
    rng = np.random.default_rng(5)
    simulated = simulate_pairs(10, rng=rng)
    pairs = repeated(simulated, 3, rng)
    pairs[4] = replace(pairs[4], pixel_px=simulated.pixels_px[1] + np.array([11.0, 0.0]))
    (group,) = [group for group in placement_groups(pairs, OPTIONS) if group.pair.id == "p2.0"]
    assert group.off.tolist() == [False, True, False]
    np.testing.assert_allclose(group.pair.pixel_px, (pairs[3].pixel_px + pairs[5].pixel_px) / 2, atol=1e-9)
    result = {pair.id: pair for pair in solved(pairs, simulated).pairs}["p2.1"]
    assert not result.inlier
    assert not result.excluded
    assert result.outlier_probability == 1.0


def test_two_clicks_that_contradict_each_other_count_with_their_own_scatter() -> None:
    (pair,) = simulate_pairs(1, rng=np.random.default_rng(6)).pairs
    apart = replace(pair, id="again", pixel_px=pair.pixel_px + np.array([14.0, 0.0]))
    (group,) = placement_groups([pair, apart], OPTIONS)
    assert not group.off.any()
    assert group.pair.sigma_px is not None
    assert group.pair.sigma_px > 4.0


def test_noisier_clicks_than_assumed_are_not_thrown_out_by_the_dozen() -> None:
    rng = np.random.default_rng(7)
    simulated = simulate_pairs(20, rng=rng)
    pairs = [
        replace(pair, pixel_px=pair.pixel_px + 3.0 * rng.standard_normal(2)) for pair in repeated(simulated, 3, rng)
    ]
    assert sum(group.off.sum() for group in placement_groups(pairs, OPTIONS)) <= 2


def test_every_click_has_a_result_and_metrics_count_placements() -> None:
    rng = np.random.default_rng(8)
    simulated = simulate_pairs(12, rng=rng)
    pairs = repeated(simulated, 3, rng)
    calibration = solved(pairs, simulated)
    assert [result.id for result in calibration.pairs] == [pair.id for pair in pairs]
    for result, pair in zip(calibration.pairs, pairs, strict=True):
        assert result.pixel_px.tobytes() == pair.pixel_px.tobytes()
        assert result.measured is pair
        assert np.isfinite(result.expected_covariance_px2).all()
    assert calibration.metrics.n <= 12
    assert "repeated-placements" not in {warning.code for warning in calibration.warnings}


def test_solved_again_from_the_clicks_it_has_the_same_bits() -> None:
    rng = np.random.default_rng(9)
    simulated = simulate_pairs(12, rng=rng, decoys=2)
    calibration = solved(repeated(simulated, 3, rng, timed=True), simulated)
    again = solve_again(calibration)
    assert isinstance(again, Calibration)
    assert calibration_text(again) == calibration_text(calibration)
    assert again.covariance.tobytes() == calibration.covariance.tobytes()


def test_many_clicks_of_three_placements_are_unsolvable_with_both_counts() -> None:
    rng = np.random.default_rng(10)
    simulated = simulate_pairs(3, rng=rng)
    outcome = calibrate_pairs(repeated(simulated, 3, rng), simulated.camera, OPTIONS)
    assert isinstance(outcome, Unsolvable)
    assert outcome.code == "degenerate-placements"
    assert "9 clicks show 3" in outcome.reason


def scans_of(simulated: SimulatedPairs, rng: np.random.Generator) -> RadarScans:
    """Six seconds of scans per placement, 20 s apart, with range bins as noise and one angle error per placement."""
    scans = []
    for i, pair in enumerate(simulated.pairs):
        for k in range(60):
            time = TimeNs((20 * i + 10) * NS_PER_S + k * NS_PER_S // 10)
            point = pair.candidates[0].position_radar_m + 0.01 * rng.standard_normal(3)
            scans.append(RadarScan(time, point[None], np.zeros(1), np.array([20.0]), np.full((1, 3), np.nan)))
    return RadarScans.from_scans(scans)


def test_clicks_of_overlapping_windows_share_the_pooled_scans() -> None:
    rng = np.random.default_rng(11)
    simulated = simulate_pairs(8, rng=rng)
    clicks = [
        ReflectorClick(TimeNs((20 * i + 12 + k) * NS_PER_S), f"c{i}.{k}", *(pixel + rng.standard_normal(2)).tolist())
        for i, pixel in enumerate(simulated.pixels_px)
        for k in range(3)
    ]
    outcome = calibrate(clicks, scans_of(simulated, rng), simulated.camera, OPTIONS)
    assert isinstance(outcome, Calibration)
    assert len(outcome.pairs) == 24
    for i in range(8):
        measured = [pair.measured for pair in outcome.pairs[3 * i : 3 * i + 3]]
        positions = {pair.candidates[0].position_radar_m.tobytes() for pair in measured if pair is not None}
        assert len(positions) == 1
    assert outcome.pairs[0].measured is not None
    assert outcome.pairs[0].measured.candidates[0].scans > 40  # of two seconds more than one window
    again = solve_again(outcome)
    assert isinstance(again, Calibration)
    assert calibration_text(again) == calibration_text(outcome)


@pytest.mark.slow
def test_the_stated_uncertainty_of_repeated_clicks_is_right() -> None:
    errors, variances, covered, codes = [], [], 0, set()
    for trial in range(40):
        rng = np.random.default_rng([2026, trial])
        simulated = simulate_pairs(12, rng=rng, noise="ti")
        calibration = solved(repeated(simulated, 3, rng), simulated)
        error = simulated.camera_from_radar.error_from(calibration.camera_from_radar)
        errors.append(error)
        variances.append(np.diag(calibration.covariance))
        covered += bool(error @ np.linalg.solve(calibration.covariance, error) < calibration.covariance_quantile)
        codes |= {warning.code for warning in calibration.warnings}
    rms, stated = (np.sqrt(np.mean(values, axis=0)) for values in (np.square(errors), variances))
    rotation, position = (np.linalg.norm(stated[k]) / np.linalg.norm(rms[k]) for k in (slice(3, 6), slice(0, 3)))
    assert 0.8 < rotation < 1.15
    assert 0.8 < position < 1.2  # forty draws know it to a tenth
    assert covered >= 34
    assert not codes & {"mirrored-axes", "repeated-placements"}


def test_a_thousand_single_clicks_are_linked_to_none() -> None:
    simulated = simulate_pairs(6, rng=np.random.default_rng(12))
    rng = np.random.default_rng(13)
    pairs = [
        replace(simulated.pairs[k % 6], id=str(k), pixel_px=rng.uniform(0.0, 1000.0, 2), image_time=TimeNs(k * 10**11))
        for k in range(1000)
    ]
    rows = linked_clicks(pairs, OPTIONS)
    assert sum(len(group) for group in rows) == 1000
    assert len(rows) > 900
