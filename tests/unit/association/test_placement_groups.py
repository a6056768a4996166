"""Clicks of one placement are one pair, and each still has a result of its own."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.association.clustering import clusters_of
from calib_core.association.exclusive_returns import exclusive_rows, shared_returns
from calib_core.association.gating import static_returns
from calib_core.association.pairing import balanced_pairs, pair_clicks, scores_of
from calib_core.association.placement_groups import click_sigmas, linked_clicks, placement_groups
from calib_core.association.placements import find_placements
from calib_core.calibration import calibrate, calibrate_pairs, solve_again
from calib_core.estimation.pair_results import _click_result
from calib_core.interchange.own.calibration_json import calibration_text
from calib_core.measurements import NS_PER_S, Candidate, Pair, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions, GatingOptions, RadarOptions
from calib_core.radar import cartesian_from_polar
from calib_core.results import Calibration
from tests.scans import scan_of

OPTIONS = CalibrationOptions(radar=RadarOptions(elevation_lean_sigma=0.0))  # as the simulated radars


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
    return calibrate_pairs(pairs, simulated.camera, OPTIONS).unwrap()


@pytest.mark.parametrize("timed", [True, False], ids=["with times", "without times"])
def test_three_clicks_of_a_placement_are_one_pair_with_their_mean(timed):
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


def test_single_clicks_keep_their_pairs_as_they_are():
    simulated = simulate_pairs(40, rng=np.random.default_rng(2), decoys=3, outlier_share=0.2)
    groups = placement_groups(simulated.pairs, OPTIONS)
    assert all(group.pair is pair for group, pair in zip(groups, simulated.pairs, strict=True))


def test_the_same_pixel_with_another_radar_position_is_another_placement():
    simulated = simulate_pairs(2, rng=np.random.default_rng(3))
    one, other = simulated.pairs
    moved = replace(other, pixel_px=one.pixel_px)
    assert len(placement_groups([one, moved], OPTIONS)) == 2


def test_two_reflectors_clicked_in_neighbouring_frames_are_two_placements():
    simulated = simulate_pairs(2, rng=np.random.default_rng(4))
    both = tuple(candidate for pair in simulated.pairs for candidate in pair.candidates)
    pairs = [
        replace(pair, candidates=both, image_time=TimeNs(k * NS_PER_S // 5)) for k, pair in enumerate(simulated.pairs)
    ]
    assert len(placement_groups(pairs, OPTIONS)) == 2


def test_two_marks_of_one_frame_are_two_reflectors_unless_they_are_at_one_point():
    pair = simulate_pairs(1, rng=np.random.default_rng(3)).pairs[0]
    one = replace(pair, id="one", image_time=TimeNs(NS_PER_S))
    beside = replace(one, id="beside", pixel_px=pair.pixel_px + np.array([8.5, 0.0]))
    again = replace(one, id="again", pixel_px=pair.pixel_px + np.array([2.0, 0.0]))
    later = replace(beside, id="later", image_time=TimeNs(2 * NS_PER_S))
    assert len(linked_clicks([one, beside], OPTIONS)) == 2
    assert len(linked_clicks([one, again], OPTIONS)) == 1
    assert len(linked_clicks([one, later], OPTIONS)) == 1


def test_a_click_far_from_the_others_of_its_placement_is_out_and_shown_as_an_outlier():
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


def test_two_clicks_that_contradict_each_other_count_with_their_own_scatter():
    (pair,) = simulate_pairs(1, rng=np.random.default_rng(6)).pairs
    apart = replace(pair, id="again", pixel_px=pair.pixel_px + np.array([14.0, 0.0]))
    (group,) = placement_groups([pair, apart], OPTIONS)
    assert not group.off.any()
    assert group.pair.sigma_px is not None
    assert group.pair.sigma_px > 4.0


def test_noisier_clicks_than_assumed_are_not_thrown_out_by_the_dozen():
    rng = np.random.default_rng(7)
    simulated = simulate_pairs(20, rng=rng)
    pairs = [
        replace(pair, pixel_px=pair.pixel_px + 3.0 * rng.standard_normal(2)) for pair in repeated(simulated, 3, rng)
    ]
    assert sum(group.off.sum() for group in placement_groups(pairs, OPTIONS)) <= 2


def test_every_click_has_a_result_and_metrics_count_placements():
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


def test_a_single_click_is_expected_farther_off_than_its_placement_by_the_clicks_noise():
    rng = np.random.default_rng(8)
    simulated = simulate_pairs(12, rng=rng)
    pairs = repeated(simulated, 3, rng)
    calibration = replace(solved(pairs, simulated), noise_scale=(1.5, 1.0, 1.0, 1.0))
    (group,) = (one for one in placement_groups(pairs, OPTIONS) if pairs[0] in one.clicks)
    of_pair = calibration.pairs[0]
    click = _click_result(calibration, of_pair, group.pair, pairs[0], off=False)
    own_px, pair_px = click_sigmas((pairs[0], group.pair), OPTIONS).tolist()
    assert own_px > pair_px
    more = click.expected_covariance_px2 - of_pair.expected_covariance_px2
    assert more == pytest.approx(1.5**2 * (own_px**2 - pair_px**2) * np.eye(2))


def test_solved_again_from_the_clicks_it_has_the_same_bits():
    rng = np.random.default_rng(9)
    simulated = simulate_pairs(12, rng=rng, decoys=2)
    calibration = solved(repeated(simulated, 3, rng, timed=True), simulated)
    again = solve_again(calibration).unwrap()
    assert calibration_text(again) == calibration_text(calibration)
    assert again.covariance.tobytes() == calibration.covariance.tobytes()


def test_many_clicks_of_three_placements_are_unsolvable_with_both_counts():
    rng = np.random.default_rng(10)
    simulated = simulate_pairs(3, rng=rng)
    outcome = calibrate_pairs(repeated(simulated, 3, rng), simulated.camera, OPTIONS)
    assert outcome.code == "degenerate-placements"
    assert (outcome.facts["clicks"], outcome.facts["placements"]) == (9, 3)


def scans_of(simulated: SimulatedPairs, rng: np.random.Generator) -> RadarScans:
    """Six seconds of scans per placement, 20 s apart, with range bins as noise and one angle error per placement."""
    scans = []
    for i, pair in enumerate(simulated.pairs):
        for k in range(60):
            point = pair.candidates[0].position_radar_m + 0.01 * rng.standard_normal(3)
            scans.append(scan_of(20 * i + 10 + k / 10, point, snr_db=20.0))
    return RadarScans.from_scans(scans)


def test_clicks_of_overlapping_windows_share_the_pooled_scans():
    rng = np.random.default_rng(11)
    simulated = simulate_pairs(8, rng=rng)
    clicks = [
        ReflectorClick(TimeNs((20 * i + 12 + k) * NS_PER_S), f"c{i}.{k}", *(pixel + rng.standard_normal(2)).tolist())
        for i, pixel in enumerate(simulated.pixels_px)
        for k in range(3)
    ]
    outcome = calibrate(clicks, scans_of(simulated, rng), simulated.camera, OPTIONS).unwrap()
    assert len(outcome.pairs) == 24
    for i in range(8):
        measured = [pair.measured for pair in outcome.pairs[3 * i : 3 * i + 3]]
        positions = {pair.candidates[0].position_radar_m.tobytes() for pair in measured if pair is not None}
        assert len(positions) == 1
    assert outcome.pairs[0].measured.candidates[0].scans > 40  # of two seconds more than one window
    again = solve_again(outcome).unwrap()
    assert calibration_text(again) == calibration_text(outcome)


@pytest.mark.slow
def test_the_stated_uncertainty_of_repeated_clicks_is_right():
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
    assert 0.8 < rotation < 1.6  # forty draws know it to a tenth; smooth errors that are not drawn here are feared
    assert 0.8 < position < 1.6
    assert covered >= 34
    assert not codes & {"mirrored-axes", "repeated-placements"}


def test_a_thousand_single_clicks_are_linked_to_none():
    simulated = simulate_pairs(6, rng=np.random.default_rng(12))
    rng = np.random.default_rng(13)
    pairs = [
        replace(simulated.pairs[k % 6], id=str(k), pixel_px=rng.uniform(0.0, 1000.0, 2), image_time=TimeNs(k * 10**11))
        for k in range(1000)
    ]
    rows = linked_clicks(pairs, OPTIONS)
    assert sum(len(group) for group in rows) == 1000
    assert len(rows) > 900


# Two azimuths of one return: candidates of their own, but one reflector.


RATE_HZ = 10
OTHER_RAD = -0.6
WALL = (9.0, 0.3)
Place = tuple[float, float]
"""Range [m] and azimuth [rad]."""


def scan(time_s: float, *places: Place, seed: int = 0) -> RadarScan:
    """Return a scan with each place at its azimuth and 0.6 rad to the right of it, as alternatives."""
    rng = np.random.default_rng([seed, round(time_s * 1000)])
    given = np.array(places, dtype=float).reshape(-1, 2) + rng.normal(0.0, 0.002, (len(places), 2))
    n = len(given)
    polar = np.column_stack([np.tile(given, (2, 1)), np.zeros(2 * n)])
    polar[n:, 1] += OTHER_RAD
    return scan_of(time_s, cartesian_from_polar(polar), snr_db=20.0, alternative_of=np.tile(np.arange(n), 2))


def session(stays: dict[Place, tuple[float, float]], duration_s: float) -> RadarScans:
    """Return scans in which a wall stands all the time, and each place is occupied from one time to another."""
    found = []
    for time_s in np.arange(0.0, duration_s, 1.0 / RATE_HZ):
        here = [place for place, (start_s, end_s) in stays.items() if start_s <= time_s < end_s]
        found.append(scan(float(time_s), WALL, *here))
    return RadarScans.from_scans(found)


STAYS: dict[Place, tuple[float, float]] = {(4.0, 0.2): (4.0, 9.0), (6.0, -0.1): (13.0, 18.0), (7.5, 0.4): (22.0, 27.0)}
SCANS = session(STAYS, 31.0)
MOMENTS_S = (6.5, 15.5, 24.5)


def clicks(*moments_s: float) -> list[ReflectorClick]:
    return [ReflectorClick(TimeNs(round(time_s * NS_PER_S)), f"c{i}", 10.0, 10.0) for i, time_s in enumerate(moments_s)]


def test_the_column_survives_cutting_gating_and_stacking():
    static = static_returns(SCANS, GatingOptions(max_range_m=8.0))
    assert static.alternative_of is not None
    assert len(static.alternative_of) == len(static.points_radar_m) < len(SCANS.points_radar_m)
    window = static.between(TimeNs(5 * NS_PER_S), TimeNs(6 * NS_PER_S))
    again = RadarScans.from_scans([window.scan(i) for i in range(len(window))])
    assert again.alternative_of.tolist() == window.alternative_of.tolist() == [1, 1] * len(window)
    plain = replace(window.scan(0), alternative_of=None)
    mixed = RadarScans.from_scans([plain, window.scan(1)])
    assert mixed.alternative_of.tolist() == [-1, -1, 1, 1]


def test_both_azimuths_are_candidates_that_know_each_other():
    pairs = pair_clicks(clicks(*MOMENTS_S), SCANS, CalibrationOptions()).pairs
    for pair, (range_m, azimuth_rad) in zip(pairs, STAYS, strict=True):
        first, second = pair.candidates[:2]
        assert first.alternative_of == second.alternative_of >= 0
        assert first.score == pytest.approx(3.0 * second.score, rel=0.1)  # the radar lists the first one first
        azimuths = sorted(np.arctan2(one.position_radar_m[1], one.position_radar_m[0]) for one in (first, second))
        assert azimuths == pytest.approx([azimuth_rad + OTHER_RAD, azimuth_rad], abs=0.01)
        assert np.linalg.norm(first.position_radar_m) == pytest.approx(range_m, abs=0.02)
        assert sum(one.score for one in pair.candidates) <= 1.0 + 1e-9


def test_what_stands_where_the_other_azimuth_of_another_placement_was_is_still_new():
    ghostly = (4.0, 0.2 + OTHER_RAD)  # true here, and wrong of the first placement
    scans = session({(4.0, 0.2): (4.0, 9.0), ghostly: (13.0, 18.0)}, 22.0)
    windows = [scans.between(TimeNs(a * NS_PER_S), TimeNs((a + 3) * NS_PER_S)) for a in (5, 14)]
    clusters = [clusters_of(window, most=12) for window in windows]
    for own, scores in zip(clusters, scores_of(windows, clusters), strict=True):
        walls = np.array([abs(cluster.centre[0] - WALL[0]) < 0.1 for cluster in own])
        assert walls.sum() == 2
        assert scores[walls].sum() < 0.02  # seen in the only other window


def candidate(range_m: float, azimuth_rad: float, of: int = -1, score: float = 0.3) -> Candidate:
    position = cartesian_from_polar(np.array([[range_m, azimuth_rad, 0.0]]))[0]
    return Candidate(position, np.full(3, 0.01), np.eye(3) * 1e-4, score, alternative_of=of)


def test_a_return_taken_at_one_azimuth_cannot_be_taken_at_the_other():
    shown = (candidate(5.0, 0.2, 0), candidate(5.0, -0.4, 0), candidate(8.0, 0.1))
    pairs = [Pair(name, np.zeros(2), shown, image_time=TimeNs(time)) for name, time in (("a", 0), ("b", NS_PER_S))]
    labels = shared_returns(pairs, window_s=3.0)
    assert labels[0] == labels[1] == labels[3] == labels[4]
    assert labels[2] == labels[5] != labels[0]
    first = np.array([0, 3, 6])
    rows = exclusive_rows(np.array([0.0, 9.0, 5.0, 9.0, 1.0, 5.0]), first, labels)
    assert rows.tolist() in ([0, 5], [2, 4])


def test_alternatives_share_what_their_return_gets_against_its_companion():
    def pair(name: str, range_m: float) -> Pair:
        near, far = range_m, range_m + 1.0
        return Pair(
            name,
            np.zeros(2),
            (
                candidate(far, 0.2, 0),
                candidate(far, -0.4, 0),
                candidate(near, 0.2, 1, 0.1),
                candidate(near, -0.4, 1, 0.1),
            ),
        )

    for balanced in balanced_pairs([pair(f"p{i}", 4.0 + 1.7 * i) for i in range(6)]):
        scores = [one.score for one in balanced.candidates]
        assert scores == pytest.approx([0.24, 0.24, 0.16, 0.16])
        assert sorted(one.alternative_of for one in balanced.candidates[:2]) == [1, 1]


def test_both_azimuths_of_one_reflector_are_one_placement():
    found = find_placements(SCANS, GatingOptions())
    assert len(found) == len(STAYS)
    for placement, ((range_m, azimuth_rad), (start_s, end_s)) in zip(found, STAYS.items(), strict=True):
        assert placement.start / NS_PER_S == pytest.approx(start_s, abs=0.3)
        assert placement.end / NS_PER_S == pytest.approx(end_s, abs=0.3)
        shown = cartesian_from_polar(np.array([[range_m, azimuth_rad, 0.0]]))[0]  # listed before the other azimuth
        assert placement.position_radar_m == pytest.approx(shown, abs=0.05)


def test_without_the_scans_around_it_a_dwell_is_still_one_placement():
    cuts = [SCANS.between(TimeNs(a * NS_PER_S), TimeNs(b * NS_PER_S - 1)) for a, b in ((4, 9), (13, 18), (22, 27))]
    islands = RadarScans.from_scans([cut.scan(i) for cut in cuts for i in range(len(cut))])
    assert len(find_placements(islands, GatingOptions())) == len(STAYS)
