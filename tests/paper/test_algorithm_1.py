"""Algorithm 1, line by line. The line numbers are those of docs/paper.md."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, simulate_pairs, study_camera
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.measurements import (
    NS_PER_S,
    Candidate,
    Pair,
    RadarScan,
    RadarScans,
    ReflectorClick,
    TimeNs,
    Unsolvable,
)
from calib_core.options import CalibrationOptions, LocatingOptions, PaperOptions
from calib_core.paper.algorithm_1 import (
    Placement,
    ScoredPose,
    calibrate_as_printed,
    clicks_by_time,
    in_placement_range,
    mean_position,
    nearest_stamp,
    pair_as_printed,
    pose_by_iterative_ransac,
    pose_by_sqpnp_ransac,
    pose_of_smaller_error,
    refined_on_all_pairs,
    solve_pairs_as_printed,
    static_returns_as_printed,
    window_of,
    z_score_inliers,
)
from calib_core.paper.pnp import refine_lm, solve_pnp_ransac
from calib_core.results import Calibration
from calib_core.results.actions import SetOption
from calib_core.results.metrics import aed, cdsd, distances
from calib_core.results.verdict import verdict_on
from calib_core.words.outcomes import outcome_remark
from calib_core.words.text import OptionPart

START_NS = 1_700_000_000_123_456_789
AS_PRINTED = PaperOptions()
OPTIONS = CalibrationOptions(method="paper")


def at(seconds: float) -> TimeNs:
    return TimeNs(START_NS + round(seconds * NS_PER_S))


def scan_of(
    seconds: float, points: list[list[float]], *, doppler: list[float] | None = None, snr: list[float] | None = None
) -> RadarScan:
    n = len(points)
    return RadarScan(
        time=at(seconds),
        points_radar_m=np.array(points, dtype=np.float64).reshape(n, 3),
        doppler_mps=np.zeros(n) if doppler is None else np.array(doppler),
        snr_db=np.full(n, np.nan) if snr is None else np.array(snr),
        sigma_polar=np.full((n, 3), np.nan),
    )


def scans_of(*scans: RadarScan) -> RadarScans:
    return RadarScans.from_scans(list(scans))


def recording_of(simulated: SimulatedPairs, *, spacing_s: float = 10.0) -> tuple[list[ReflectorClick], RadarScans]:
    """Let the reflector rest at each position for 4 s, seen at 10 Hz, and click it in the middle."""
    clicks, scans = [], []
    for i, pair in enumerate(simulated.pairs):
        middle_s = spacing_s * (i + 1)
        u_px, v_px = pair.pixel_px.tolist()
        clicks.append(ReflectorClick(at(middle_s + 0.013), pair.id, u_px, v_px))
        position = pair.candidates[0].position_radar_m.tolist()
        scans += [scan_of(middle_s + step, [position]) for step in np.arange(-2.0, 2.0, 0.1)]
    return clicks, scans_of(*scans)


def pair_at(name: str, point: np.ndarray, pixel: np.ndarray) -> Pair:
    unknown = np.full(3, np.nan)
    return Pair(name, pixel, (Candidate(point, unknown, np.full((3, 3), np.nan)),))


def solved(outcome: Calibration | Unsolvable) -> Calibration:
    assert isinstance(outcome, Calibration), outcome
    return outcome


def unsolvable(outcome: Calibration | Unsolvable) -> Unsolvable:
    assert isinstance(outcome, Unsolvable), outcome
    return outcome


def arrays_of(simulated: SimulatedPairs) -> tuple[np.ndarray, np.ndarray]:
    points = np.stack([pair.candidates[0].position_radar_m for pair in simulated.pairs])
    return points, np.stack([pair.pixel_px for pair in simulated.pairs])


# Line 1: the clicked pixels and the recorded stamps of their frames


def test_algorithm_1_line_1_takes_clicks_by_their_recorded_stamp_to_the_nanosecond():
    early = ReflectorClick(TimeNs(START_NS), "b", 1.0, 2.0)
    late = ReflectorClick(TimeNs(START_NS + 1), "a", 3.0, 4.0)
    assert clicks_by_time([late, early]) == (early, late)
    assert [click.image_time for click in clicks_by_time([late, early])] == [START_NS, START_NS + 1]


# Line 2: velocity = 0 and range < 20 m


def test_algorithm_1_line_2_keeps_velocity_zero_and_range_below_20_m():
    scans = scans_of(
        scan_of(
            0.0,
            [[5.0, 0.0, 0.0], [5.0, 1.0, 0.0], [19.99, 0.0, 0.0], [20.0, 0.0, 0.0], [16.0, 12.0, 1.0]],
            doppler=[0.0, 0.01, 0.0, 0.0, 0.0],
        )
    )
    kept = static_returns_as_printed(scans, AS_PRINTED)
    np.testing.assert_array_equal(kept.points_radar_m, [[5.0, 0.0, 0.0], [19.99, 0.0, 0.0]])


def test_algorithm_1_line_2_measures_the_range_in_space():
    scans = scans_of(scan_of(0.0, [[12.0, 12.0, 12.0], [11.0, 11.0, 11.0]]))  # 20.8 m and 19.1 m
    assert len(static_returns_as_printed(scans, AS_PRINTED).points_radar_m) == 1


def test_algorithm_1_line_2_drops_a_return_without_position_or_velocity_whole():
    nan = float("nan")
    scans = scans_of(
        scan_of(0.0, [[nan, 1.0, 0.0], [4.0, 0.0, 0.0]], snr=[10.0, 20.0]),
        scan_of(0.1, [[4.0, 0.0, 0.1]], doppler=[nan]),
        scan_of(0.2, [[4.0, 0.0, 0.2]], snr=[30.0]),
    )
    kept = static_returns_as_printed(scans, AS_PRINTED)
    assert kept.times_ns.tolist() == [at(0.0), at(0.2)]
    assert kept.snr_db.tolist() == [20.0, 30.0]
    assert kept.scan_of_return().tolist() == [0, 1]


def test_algorithm_1_line_2_has_its_limits_as_options():
    scans = scans_of(scan_of(0.0, [[25.0, 0.0, 0.0], [5.0, 0.0, 0.0]], doppler=[0.0, -0.04]))
    wide = replace(AS_PRINTED, max_range_m=30.0, max_speed_mps=0.05)
    assert len(static_returns_as_printed(scans, wide).points_radar_m) == 2


# Line 3: the nearest radar stamp


def test_algorithm_1_line_3_finds_the_nearest_radar_stamp():
    scans = scans_of(*(scan_of(0.1 * i, [[4.0, 0.0, 0.0]]) for i in range(10)))
    assert nearest_stamp(scans, at(0.44)) == at(0.4)
    assert nearest_stamp(scans, at(0.46)) == at(0.5)
    assert nearest_stamp(scans, at(-5.0)) == at(0.0)
    assert nearest_stamp(scans, at(99.0)) == at(0.9)


def test_algorithm_1_line_3_looks_only_at_scans_that_passed_line_2():
    scans = scans_of(scan_of(0.0, [[4.0, 0.0, 0.0]]), scan_of(0.1, [[4.0, 0.0, 0.0]], doppler=[1.0]))
    assert nearest_stamp(static_returns_as_printed(scans, AS_PRINTED), at(0.1)) == at(0.0)


def test_algorithm_1_line_3_leaves_a_click_far_from_any_scan_unpaired():
    scans = scans_of(*(scan_of(0.1 * i, [[4.0, 0.0, 0.0]]) for i in range(10)))
    click = ReflectorClick(at(3.0), "c1", 10.0, 20.0)
    near = replace(OPTIONS, locating=LocatingOptions(max_time_gap_s=5.0))
    unpaired = pair_as_printed(click, scans, OPTIONS)
    assert (unpaired.id, unpaired.code) == ("c1", "no-static-return")
    assert unpaired.facts["gap_s"] == pytest.approx(2.1)
    assert isinstance(pair_as_printed(click, scans, near), Pair)


# Line 4: the window of 3 s


def test_algorithm_1_line_4_takes_3_s_centred_on_the_nearest_stamp():
    scans = scans_of(*(scan_of(0.5 * i, [[4.0, 0.0, 0.0]]) for i in range(21)))
    window = window_of(scans, at(5.0), AS_PRINTED)
    assert [(time - START_NS) / NS_PER_S for time in window.times_ns.tolist()] == [3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5]


def test_algorithm_1_line_4_can_take_the_authors_window_around_the_whole_second():
    second = START_NS // NS_PER_S
    times = [second * NS_PER_S + round(0.25 * i * NS_PER_S) for i in range(40)]
    scans = RadarScans.from_scans([replace(scan_of(0.0, [[4.0, 0.0, 0.0]]), time=TimeNs(time)) for time in times])
    chosen = TimeNs((second + 5) * NS_PER_S + 750_000_000)
    window = window_of(scans, chosen, replace(AS_PRINTED, window="whole-second"))
    assert window.times_ns[0] == (second + 4) * NS_PER_S
    assert window.times_ns[-1] == (second + 6) * NS_PER_S


# Line 5: the z-score of each axis


def test_algorithm_1_the_placement_range_leaves_out_what_stands_farther_from_the_placement():
    window = scans_of(
        scan_of(0.0, [[5.0, 0.0, 0.0], [5.9, 0.0, 0.0]]), scan_of(0.1, [[6.1, 0.0, 0.0], [0.0, 5.0, 0.0]])
    )
    stood = Placement(np.array([5.0, 0.0, 0.0]), chosen=False)
    near = in_placement_range(window, stood, AS_PRINTED)
    np.testing.assert_array_equal(near.points_radar_m, window.points_radar_m[:2])
    assert len(near) == 1
    for whole in (
        in_placement_range(window, None, AS_PRINTED),
        in_placement_range(window, stood, replace(AS_PRINTED, region_m=0.0)),
    ):
        assert whole is window


def test_algorithm_1_with_an_air_conditioner_in_every_window_needs_the_placement_range():
    simulated = simulate_pairs(12, rng=np.random.default_rng(31), noise="none")
    clicks, scans = recording_of(simulated)
    owner, other = scans.scan_of_return(), np.array([8.0, 2.0, 1.0])
    crowded = scans_of(
        *(
            scan_of((int(time) - START_NS) / NS_PER_S, [*scans.points_radar_m[owner == i], other, other + 0.1])
            for i, time in enumerate(scans.times_ns)
        )
    )
    places = {
        click.id: Placement(pair.candidates[0].position_radar_m, i < 3)
        for i, (click, pair) in enumerate(zip(clicks, simulated.pairs, strict=True))
    }
    result = solved(calibrate_as_printed(clicks, crowded, simulated.camera, OPTIONS, places))
    assert rotation_angle_rad((result.camera_from_radar @ simulated.camera_from_radar.inverse()).rotation) < 1e-3
    (note,) = (warning for warning in result.warnings if warning.code == "placement-ranges")
    assert note.facts == {"chosen": 3, "by_score": 9, "region_m": 1.0}
    assert all(pair.inlier for pair in result.pairs)
    printed = replace(OPTIONS, paper=replace(AS_PRINTED, region_m=0.0))
    outcome = calibrate_as_printed(clicks, crowded, simulated.camera, printed, places)
    assert unsolvable(outcome).code == "points-in-one-line"
    nowhere = {**places, clicks[0].id: Placement(np.array([-9.0, 0.0, 0.0]), chosen=True)}
    (left_out,) = solved(calibrate_as_printed(clicks, crowded, simulated.camera, OPTIONS, nowhere)).unpaired
    assert (left_out.id, left_out.code) == (clicks[0].id, "nothing-in-range")


def test_algorithm_1_line_5_judges_each_axis_by_its_z_score():
    from scipy.stats import zscore

    rng = np.random.default_rng(4)
    points = rng.normal([5.0, 1.0, -0.5], [0.02, 0.3, 0.1], (40, 3))
    expected = (np.abs(zscore(points, axis=0)) <= 1.0).all(axis=1)
    assert 0 < expected.sum() < 40
    np.testing.assert_array_equal(z_score_inliers(points, AS_PRINTED), expected)


def test_algorithm_1_line_5_can_judge_the_axes_in_turn_as_the_authors_do():
    from scipy.stats import zscore

    rng = np.random.default_rng(5)
    points = rng.normal([5.0, 1.0, -0.5], 0.1, (60, 3))
    left = np.arange(60)
    for axis in range(3):
        left = left[np.abs(zscore(points[left, axis])) <= 1.0]
    in_turn = z_score_inliers(points, replace(AS_PRINTED, z_score_axes="in-turn"))
    np.testing.assert_array_equal(np.flatnonzero(in_turn), left)
    assert in_turn.sum() != z_score_inliers(points, AS_PRINTED).sum()


def test_algorithm_1_line_5_rejects_nothing_on_an_axis_without_spread():
    points = np.tile([[5.0, 1.0, -0.5]], (10, 1))
    assert z_score_inliers(points, AS_PRINTED).all()


def test_algorithm_1_line_5_keeps_both_of_two_returns():
    points = np.array([[5.0, 1.0, -0.5], [5.1, 1.3, -0.7]])
    assert z_score_inliers(points, AS_PRINTED).all()


def test_algorithm_1_line_5_has_its_threshold_as_an_option():
    points = np.concatenate([np.tile([[5.0, 1.0, 0.0]], (9, 1)), [[5.4, 1.0, 0.0]]])  # z = 1/3 and 3
    assert z_score_inliers(points, replace(AS_PRINTED, z_score_threshold=2.0)).tolist() == [True] * 9 + [False]
    assert z_score_inliers(points, replace(AS_PRINTED, z_score_threshold=3.0)).all()


def test_algorithm_1_line_5_says_so_when_no_return_is_left():
    # each return is far out on one axis
    scans = scans_of(*(scan_of(0.1 * i, [row]) for i, row in enumerate(np.eye(3).tolist())))
    unpaired = pair_as_printed(ReflectorClick(at(0.1), "c1", 1.0, 2.0), scans, OPTIONS)
    assert unpaired.code == "no-z-score-inlier"
    assert unpaired.facts["returns"] == 3


# Line 6: the mean of the inliers


def test_algorithm_1_line_6_averages_the_inliers():
    points = np.array([[5.0, 1.0, 0.0], [5.2, 1.2, 0.2], [9.0, 9.0, 9.0]])
    np.testing.assert_allclose(mean_position(points, np.array([True, True, False])), [5.1, 1.1, 0.1])


def test_algorithm_1_line_6_pairs_the_click_with_that_mean():
    points = [[5.0, 1.0, -0.5], [5.02, 1.04, -0.52], [5.01, 1.02, -0.51]]
    scans = scans_of(*(scan_of(0.1 * i, [point], snr=[20.0 + i]) for i, point in enumerate(points)))
    loose = replace(OPTIONS, paper=replace(AS_PRINTED, z_score_threshold=3.0))
    pair = pair_as_printed(ReflectorClick(at(0.12), "c1", 10.5, 20.25, sigma_px=0.8), scans, loose)
    np.testing.assert_allclose(pair.candidates[0].position_radar_m, [5.01, 1.02, -0.51])
    np.testing.assert_array_equal(pair.pixel_px, [10.5, 20.25])
    assert (pair.id, pair.radar_time, pair.sigma_px) == ("c1", at(0.1), 0.8)
    assert (pair.candidates[0].returns, pair.candidates[0].scans) == (3, 3)
    assert pair.candidates[0].snr_db == pytest.approx(21.0)


def test_algorithm_1_line_6_follows_the_paper_between_two_objects():
    # This weakness of the printed algorithm is kept on purpose: half of the returns are clutter 4 m behind.
    scans = scans_of(*(scan_of(0.1 * i, [[5.0, 0.0, 0.0], [9.0, 0.0, 0.0]]) for i in range(20)))
    pair = pair_as_printed(ReflectorClick(at(1.0), "c1", 1.0, 2.0), scans, OPTIONS)
    np.testing.assert_allclose(pair.candidates[0].position_radar_m, [7.0, 0.0, 0.0])


# Lines 7 and 8: PnP by RANSAC with two solvers


@pytest.mark.parametrize("outliers", [0.0, 0.2])
def test_algorithm_1_line_7_is_opencvs_ransac_with_the_iterative_solver(outliers):
    simulated = simulate_pairs(20, rng=np.random.default_rng(1), noise="imaging", outlier_share=outliers)
    points, pixels = arrays_of(simulated)
    options = replace(AS_PRINTED, ransac_threshold_px=15.0)
    found = pose_by_iterative_ransac(points, pixels, simulated.camera, options)
    expected = solve_pnp_ransac(points, pixels, simulated.camera, "iterative", threshold_px=15.0, iterations=10_000)
    np.testing.assert_array_equal(found.camera_from_radar.as_matrix(), expected.camera_from_radar.as_matrix())
    np.testing.assert_array_equal(found.inliers, expected.inliers)


def test_algorithm_1_line_8_is_opencvs_ransac_with_sqpnp():
    simulated = simulate_pairs(20, rng=np.random.default_rng(2), noise="imaging")
    points, pixels = arrays_of(simulated)
    options = replace(AS_PRINTED, ransac_threshold_px=15.0, ransac_iterations=300, ransac_confidence=0.9)
    found = pose_by_sqpnp_ransac(points, pixels, simulated.camera, options)
    expected = solve_pnp_ransac(
        points, pixels, simulated.camera, "sqpnp", threshold_px=15.0, iterations=300, confidence=0.9
    )
    np.testing.assert_array_equal(found.camera_from_radar.as_matrix(), expected.camera_from_radar.as_matrix())


def test_algorithm_1_lines_7_and_8_measure_the_mean_error_over_all_pairs():
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging", outlier_share=0.1)
    points, pixels = arrays_of(simulated)
    found = pose_by_sqpnp_ransac(points, pixels, simulated.camera, replace(AS_PRINTED, ransac_threshold_px=15.0))
    pose, camera = found.camera_from_radar, simulated.camera
    turned = cv2.Rodrigues(np.array(pose.rotation))[0]
    matrix, lens = np.array(camera.matrix_px), np.array(camera.distortion)
    seen = cv2.projectPoints(points, turned, np.array(pose.translation_m), matrix, lens)[0].reshape(-1, 2)
    assert found.mean_error_px == pytest.approx(float(np.linalg.norm(seen - pixels, axis=1).mean()), rel=1e-9)


# Line 9: the smaller mean reprojection error


def scored(mean_error_px: float) -> ScoredPose:
    return ScoredPose(RigidTransform.identity(), np.array([True]), mean_error_px)


def test_algorithm_1_line_9_takes_the_smaller_mean_error():
    small, large = scored(3.0), scored(4.0)
    assert pose_of_smaller_error(small, large) is small
    assert pose_of_smaller_error(large, small) is small
    first, second = scored(3.0), scored(3.0)
    assert pose_of_smaller_error(first, second) is second  # "if err_it < err_sq", else SQPnP


def test_algorithm_1_line_9_takes_the_only_one_there_is():
    only = scored(3.0)
    assert pose_of_smaller_error(None, only) is only
    assert pose_of_smaller_error(only, None) is only
    assert pose_of_smaller_error(None, None) is None


def test_algorithm_1_line_9_never_prefers_a_pose_with_a_pair_behind_the_camera():
    behind, in_front = scored(float("nan")), scored(500.0)
    assert pose_of_smaller_error(behind, in_front) is in_front
    assert pose_of_smaller_error(in_front, behind) is in_front


# Line 10: Levenberg-Marquardt on all pairs


def test_algorithm_1_line_10_refines_on_all_pairs_outliers_included():
    simulated = simulate_pairs(20, rng=np.random.default_rng(7), noise="none")
    points, pixels = arrays_of(simulated)
    pixels = pixels.copy()
    pixels[3] += [80.0, -60.0]
    clean = np.arange(20) != 3
    on_all = refined_on_all_pairs(points, pixels, simulated.camera, simulated.camera_from_radar)
    on_inliers = refine_lm(points[clean], pixels[clean], simulated.camera, simulated.camera_from_radar)
    assert rotation_angle_rad(on_inliers.rotation @ simulated.camera_from_radar.rotation.T) < 1e-6
    assert rotation_angle_rad(on_all.rotation @ simulated.camera_from_radar.rotation.T) > 1e-4


def test_algorithm_1_line_10_is_what_the_calibration_holds():
    simulated = simulate_pairs(20, rng=np.random.default_rng(8), noise="imaging", outlier_share=0.1)
    points, pixels = arrays_of(simulated)
    options = replace(OPTIONS, paper=replace(AS_PRINTED, ransac_threshold_px=15.0))
    result = solved(solve_pairs_as_printed(simulated.pairs, simulated.camera, options))
    order = np.argsort([pair.id for pair in simulated.pairs])
    points, pixels = points[order], pixels[order]
    start = pose_of_smaller_error(
        pose_by_iterative_ransac(points, pixels, simulated.camera, options.paper),
        pose_by_sqpnp_ransac(points, pixels, simulated.camera, options.paper),
    )
    refined = refined_on_all_pairs(points, pixels, simulated.camera, start.camera_from_radar)
    np.testing.assert_array_equal(result.camera_from_radar.as_matrix(), refined.as_matrix())
    (contradicted,) = (warning for warning in result.warnings if warning.code == "algorithm-1-contradicted")
    assert contradicted.facts["inliers"] == start.inliers.sum()
    assert contradicted.facts["agreeing"] == sum(pair.inlier for pair in result.pairs)
    assert not start.inliers.all()
    assert verdict_on(result).level == "contradictory"


# The whole algorithm


def test_algorithm_1_finds_the_true_pose_from_clicks_and_scans():
    simulated = simulate_pairs(12, rng=np.random.default_rng(10), noise="none")
    clicks, scans = recording_of(simulated)
    result = solved(calibrate_as_printed(clicks, scans, simulated.camera, OPTIONS))
    assert rotation_angle_rad(result.camera_from_radar.rotation @ simulated.camera_from_radar.rotation.T) < 1e-5
    np.testing.assert_allclose(
        result.camera_from_radar.translation_m, simulated.camera_from_radar.translation_m, atol=1e-4
    )
    assert [pair.id for pair in result.pairs] == [click.id for click in clicks]


def test_algorithm_1_reports_aed_and_cdsd_over_all_pairs_and_claims_no_uncertainty():
    simulated = simulate_pairs(20, rng=np.random.default_rng(11), noise="imaging", outlier_share=0.1)
    options = replace(OPTIONS, paper=replace(AS_PRINTED, ransac_threshold_px=15.0))
    result = solved(solve_pairs_as_printed(simulated.pairs, simulated.camera, options))
    points, pixels = arrays_of(simulated)
    lengths = distances(result.reproject(points), pixels)
    assert result.metrics.n == 20
    assert result.metrics.aed_px == pytest.approx(aed(lengths))
    assert result.metrics.cdsd_px == pytest.approx(cdsd(lengths))
    assert np.isnan(result.metrics.held_out_aed_px)
    assert np.isnan(result.covariance).all()
    # two pairs are wrong
    assert [warning.code for warning in result.warnings] == ["algorithm-1-contradicted", "weak-geometry"]
    assert result.iterative_px > 0.0
    assert result.sqpnp_px > 0.0
    assert all(np.isnan(pair.outlier_probability) for pair in result.pairs)


def test_algorithm_1_says_how_far_the_noise_moves_its_pose_and_is_silent_where_that_is_little():
    far = replace(FIELD, min_range_m=9.0, max_range_m=12.0, max_azimuth_deg=12.0)
    for seed in range(3):
        rng = np.random.default_rng([12, seed])
        good = simulate_pairs(40, rng=rng, noise="imaging")
        assert solved(solve_pairs_as_printed(good.pairs, good.camera, OPTIONS)).warnings == ()
        poor = simulate_pairs(20, rng=rng, noise="imaging", layout=far)
        (weak,) = solved(solve_pairs_as_printed(poor.pairs, poor.camera, OPTIONS)).warnings
        assert weak.code == "weak-geometry"
        assert weak.facts["position_cm"] > 10.0


def test_algorithm_1_does_not_care_about_the_order_of_the_clicks():
    simulated = simulate_pairs(12, rng=np.random.default_rng(12), noise="imaging")
    clicks, scans = recording_of(simulated)
    options = replace(OPTIONS, paper=replace(AS_PRINTED, ransac_threshold_px=15.0))
    forward = solved(calibrate_as_printed(clicks, scans, simulated.camera, options))
    backward = solved(calibrate_as_printed(clicks[::-1], scans, simulated.camera, options))
    assert forward.camera_from_radar.as_matrix().tobytes() == backward.camera_from_radar.as_matrix().tobytes()
    assert forward.metrics == backward.metrics or repr(forward.metrics) == repr(backward.metrics)
    assert [pair.id for pair in forward.pairs] == [pair.id for pair in backward.pairs]


@pytest.mark.slow
def test_an_excluded_click_takes_no_part_but_is_shown_with_its_residual():
    simulated = simulate_pairs(12, rng=np.random.default_rng(13), noise="imaging")
    clicks, scans = recording_of(simulated)
    options = replace(OPTIONS, paper=replace(AS_PRINTED, ransac_threshold_px=15.0))
    wrong = replace(clicks[4], u_px=clicks[4].u_px + 300.0, excluded=True)
    with_it = solved(calibrate_as_printed([*clicks[:4], wrong, *clicks[5:]], scans, simulated.camera, options))
    without = solved(calibrate_as_printed([*clicks[:4], *clicks[5:]], scans, simulated.camera, options))
    np.testing.assert_array_equal(with_it.camera_from_radar.as_matrix(), without.camera_from_radar.as_matrix())
    assert with_it.metrics.n == without.metrics.n == 11
    shown = with_it.pairs[4]
    assert (shown.id, shown.excluded, shown.inlier) == (clicks[4].id, True, False)
    assert shown.distance_px > 200.0


def test_a_click_whose_returns_hold_no_number_stays_unpaired_and_the_others_stay_with_theirs():
    simulated = simulate_pairs(8, rng=np.random.default_rng(14), noise="none")
    clicks, scans = recording_of(simulated)
    points = scans.points_radar_m.copy()
    owner = np.round((scans.times_ns[scans.scan_of_return()] - START_NS) / NS_PER_S / 10.0).astype(int) - 1
    points[owner == 2] = np.nan
    broken = RadarScans(
        times_ns=scans.times_ns,
        first_return=scans.first_return,
        points_radar_m=points,
        doppler_mps=scans.doppler_mps,
        snr_db=scans.snr_db,
        sigma_polar=scans.sigma_polar,
    )
    result = solved(calibrate_as_printed(clicks, broken, simulated.camera, OPTIONS))
    assert [unpaired.id for unpaired in result.unpaired] == [clicks[2].id]
    assert [pair.id for pair in result.pairs] == [click.id for i, click in enumerate(clicks) if i != 2]
    assert result.metrics.aed_px < 1e-3


def test_three_pairs_are_too_few_and_the_reason_counts_them():
    simulated = simulate_pairs(6, rng=np.random.default_rng(15), noise="none")
    clicks, scans = recording_of(simulated)
    outcome = unsolvable(calibrate_as_printed(clicks[:3], scans, simulated.camera, OPTIONS))
    assert outcome.code == "too-few-pairs"
    assert {name: count for name, count in outcome.facts.items() if count} == {"used": 3, "needed": 4}
    lost = replace(clicks[3], image_time=at(9999.0))
    excluded = replace(clicks[4], excluded=True)
    outcome = unsolvable(calibrate_as_printed([*clicks[:3], lost, excluded], scans, simulated.camera, OPTIONS))
    assert [outcome.facts[name] for name in ("used", "needed", "excluded", "unpaired")] == [3, 4, 1, 1]


def test_without_any_radar_return_the_reason_is_too_few_pairs():
    clicks = [ReflectorClick(at(float(i)), f"c{i}", 1.0, 2.0) for i in range(5)]
    outcome = unsolvable(calibrate_as_printed(clicks, RadarScans(), study_camera(), OPTIONS))
    assert outcome.code == "too-few-pairs"
    assert (outcome.facts["used"], outcome.facts["needed"]) == (0, 4)


def test_when_ransac_finds_nothing_the_hint_names_the_threshold_and_the_default_method():
    rng = np.random.default_rng(16)
    points = rng.uniform([2.0, -3.0, -1.0], [15.0, 3.0, 1.0], (20, 3))
    pixels = rng.uniform([0.0, 0.0], [1900.0, 1000.0], (20, 2))
    pairs = [pair_at(f"p{i}", point, pixel) for i, (point, pixel) in enumerate(zip(points, pixels, strict=True))]
    strict = replace(OPTIONS, paper=replace(AS_PRINTED, ransac_threshold_px=0.05, ransac_iterations=200))
    outcome = unsolvable(solve_pairs_as_printed(pairs, study_camera(), strict))
    assert outcome.code == "no-consensus"
    assert outcome.facts == {"pairs": 20, "threshold_px": 0.05}
    remark = outcome_remark(outcome)
    assert remark.action == SetOption("method", "default")
    assert OptionPart("paper.ransac_threshold_px") in remark.hint.parts


def test_positions_on_one_line_are_refused_with_a_reason():
    points = np.array([[4.0 + i, 0.5, -0.5] for i in range(6)])
    pixels = np.array([[900.0 + i, 700.0 - 20.0 * i] for i in range(6)])
    pairs = [pair_at(f"p{i}", point, pixel) for i, (point, pixel) in enumerate(zip(points, pixels, strict=True))]
    assert unsolvable(solve_pairs_as_printed(pairs, study_camera(), OPTIONS)).code == "points-in-one-line"


def test_of_several_radar_positions_the_first_counts():
    simulated = simulate_pairs(12, rng=np.random.default_rng(17), noise="none")
    far = Candidate(np.array([9.0, 9.0, 9.0]), np.full(3, np.nan), np.full((3, 3), np.nan))
    pairs = [replace(pair, candidates=(*pair.candidates, far)) for pair in simulated.pairs]
    result = solved(solve_pairs_as_printed(pairs, simulated.camera, OPTIONS))
    assert result.metrics.aed_px < 1e-3
    assert [pair.id for pair in result.pairs] == [pair.id for pair in pairs]
