"""Residuals by hand, associations that no judged calibration chooses, and whole placements left out."""

import dataclasses

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.association.clustering import candidate_at
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.evaluation.figures import ResidualFigures, edges_of, spreads
from calib_core.evaluation.paired_difference import acc_difference, residual_difference
from calib_core.evaluation.residuals import associated_pairs, held_out, residual_figures, residual_test
from calib_core.evaluation.target_tracking import find_targets
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, Pair, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, Metrics
from calib_core.results.metrics import metrics_of
from tests.box_figures import box_figures
from tests.street import CAMERA, OPTICAL_FROM_RADAR, TRUE_POSE, street, turned

PINHOLE = Camera("pinhole", 200, 100, np.array([[100.0, 0.0, 100.0], [0.0, 100.0, 50.0], [0.0, 0.0, 1.0]]))
AHEAD = Calibration(
    camera_from_radar=RigidTransform(OPTICAL_FROM_RADAR, np.zeros(3)),
    covariance=np.full((6, 6), np.nan),
    camera=PINHOLE,
    metrics=Metrics(),
    pairs=(),
    unpaired=(),
    warnings=(),
    options=CalibrationOptions(),
)


def pair(name: str, point: tuple[float, float, float], pixel: tuple[float, float], time_s: float = 0.0) -> Pair:
    candidate = candidate_at(np.array(point, dtype=np.float64), CalibrationOptions().noise)
    return Pair(name, np.array(pixel), (candidate,), image_time=TimeNs(int(time_s * NS_PER_S)))


@pytest.fixture(scope="module")
def solved() -> tuple[Calibration, tuple[Pair, ...]]:
    simulated = simulate_pairs(14, rng=np.random.default_rng(3), noise="imaging")
    return calibrate_pairs(simulated.pairs, simulated.camera).unwrap(), simulated.pairs


def test_the_figures_are_those_computed_by_hand():
    pairs = [pair("a", (10, 0, 0), (103, 54)), pair("b", (10, 1, 0), (90, 50)), pair("c", (20, 2, 1), (90, 57))]
    figures = residual_figures(pairs, AHEAD, with_held_out=False)

    assert figures.projected_px == pytest.approx(np.array([[100, 50], [90, 50], [90, 45]]))
    assert figures.distances_px == pytest.approx([5, 0, 12])
    assert figures.metrics.aed_px == pytest.approx(17 / 3)
    spread = sum((e - 17 / 3) ** 2 for e in (5, 0, 12))
    assert figures.metrics.cdsd_px == pytest.approx((spread / 2) ** 0.5)
    assert figures.median_px == 5.0
    assert figures.metrics.n == 3
    assert sum(one.n for one in figures.by_range) == 3
    assert figures.by_row[0].low <= 50
    assert figures.by_row[-1].high >= 57


def test_a_residual_that_no_noise_explains_is_no_inlier():
    pairs = [pair("a", (10, 0, 0), (101, 50)), pair("b", (10, 1, 0), (190, 50))]
    figures = residual_figures(pairs, AHEAD, with_held_out=False)

    assert figures.inliers.tolist() == [True, False]
    assert figures.inlier_share == 0.5


def test_a_reflector_behind_the_camera_has_no_residual_and_is_counted_as_lost():
    figures = residual_figures([pair("a", (10, 0, 0), (100, 50)), pair("b", (-10, 0, 0), (100, 50))], AHEAD)

    assert figures.metrics.n == 1
    assert figures.metrics.aed_px == 0.0
    assert np.isnan(figures.distances_px[1])
    assert figures.inlier_share == 0.5


def test_the_judged_calibration_does_not_choose_the_returns(solved):
    calibration, pairs = solved
    true = [one.candidates[0] for one in pairs]
    wrong_pose = calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, np.radians(4.0), 0]))
    wrong = dataclasses.replace(calibration, camera_from_radar=wrong_pose)
    # beside each reflector stands something that the wrong calibration would put on the click
    tempting = []
    for one in pairs:
        range_m = np.linalg.norm(one.candidates[0].position_radar_m)
        ray = calibration.camera.rays(one.pixel_px[None])[0]
        point = wrong_pose.inverse() @ (ray * range_m)[None]
        half = [
            dataclasses.replace(candidate_at(place, CalibrationOptions().noise), score=0.5)
            for place in (one.candidates[0].position_radar_m, point[0])
        ]
        tempting.append(dataclasses.replace(one, candidates=tuple(half)))
    tempting[0:5] = pairs[0:5]
    found = associated_pairs(tempting, calibration.camera, calibration.options)

    assert [one.candidates[0].position_radar_m.tolist() for one in found.pairs] == [
        one.position_radar_m.tolist() for one in true
    ]
    judged = residual_figures(found, wrong, with_held_out=False)
    assert judged.median_px > 5.0 * residual_figures(found, calibration, with_held_out=False).median_px


@pytest.mark.slow
def test_clicks_of_one_placement_are_left_out_together():
    simulated = simulate_pairs(8, rng=np.random.default_rng(4), noise="imaging")
    twice = [
        dataclasses.replace(one, id=f"{one.id}-{k}", image_time=TimeNs((10 * i + k) * NS_PER_S))
        for i, one in enumerate(simulated.pairs)
        for k in range(2)
    ]
    calibration = calibrate_pairs(twice, simulated.camera).unwrap()
    figures = residual_figures(twice, calibration)

    assert figures.placements.tolist() == [i for i in range(8) for _ in range(2)]
    assert figures.held_out.folds == 8
    assert figures.k_fold.folds == 5
    singly = residual_figures(twice[::2], calibration)
    assert figures.held_out.distances_px[::2] == pytest.approx(singly.held_out.distances_px, abs=1.5)


def test_held_out_clicks_are_predicted_without_themselves(solved):
    calibration, pairs = solved
    moved = dataclasses.replace(pairs[3], pixel_px=pairs[3].pixel_px + np.array([60.0, 0.0]))
    found = associated_pairs([*pairs[:3], moved, *pairs[4:]], calibration.camera, calibration.options)
    groups = np.arange(len(pairs))
    distances = held_out(found, calibration.camera, calibration.options, groups).distances_px

    assert 50.0 < distances[3] < 70.0
    assert np.median(np.delete(distances, 3)) < 10.0


def test_the_same_clicks_give_the_same_figures(solved):
    calibration, pairs = solved
    first, second = (residual_figures(pairs, calibration) for _ in range(2))
    assert first.held_out.distances_px.tobytes() == second.held_out.distances_px.tobytes()


def test_bins_have_round_edges_that_hold_every_value():
    assert edges_of(np.array([3.2, 17.0])).tolist() == [0, 5, 10, 15, 20]
    assert edges_of(np.array([5.0])).tolist()[0] <= 5.0 <= edges_of(np.array([5.0])).tolist()[-1]
    assert len(edges_of(np.zeros(0))) == 0
    bins = spreads(np.array([1.0, 2.0, 9.0, np.nan]), np.array([1.0, 3.0, np.nan, 2.0]))
    assert sum(one.n for one in bins) == 2


def solved_and_fresh(seed: int) -> tuple[Calibration, tuple[Pair, ...]]:
    """Return a calibration and pairs of the same sensors that took no part in it."""
    rng = np.random.default_rng(seed)
    simulated = simulate_pairs(20, rng=rng, noise="imaging")
    calibration = calibrate_pairs(simulated.pairs, simulated.camera).unwrap()
    return calibration, simulate_pairs(15, rng=rng, noise="imaging", rig=simulated.rig, camera=simulated.camera).pairs


@pytest.fixture(scope="module")
def case() -> tuple[Calibration, tuple[Pair, ...]]:
    return solved_and_fresh(1)


def test_fresh_pairs_of_the_same_sensors_fit(case):
    calibration, pairs = case
    test = residual_test(pairs, calibration)

    assert test.p_value > 0.01
    assert test.degrees_of_freedom == 2 * len(pairs)
    assert not test.misfits.any()


def test_pairs_do_not_fit_after_the_camera_moved(case):
    calibration, pairs = case
    turned = calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, np.radians(3.0), 0]))
    test = residual_test(pairs, dataclasses.replace(calibration, camera_from_radar=turned))

    assert test.misfits.mean() > 0.5


def test_one_wrong_pair_is_named_and_does_not_decide(case):
    calibration, pairs = case
    wrong = dataclasses.replace(pairs[0], pixel_px=pairs[0].pixel_px + np.array([80.0, 0.0]))
    test = residual_test((wrong, *pairs[1:]), calibration)

    assert test.misfits.tolist() == [True] + [False] * (len(pairs) - 1)
    assert test.p_value > 0.01


def test_without_a_covariance_only_the_distances_are_known(case):
    calibration, pairs = case
    unknown = dataclasses.replace(calibration, covariance=np.full((6, 6), np.nan))
    test = residual_test(pairs, unknown)

    assert np.isnan(test.chi2)
    assert np.isfinite(test.distances_px).all()
    assert not test.outside.any()


def test_pairs_behind_the_camera_are_misfits(case):
    calibration, pairs = case
    behind = calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, np.pi, 0]))
    test = residual_test(pairs, dataclasses.replace(calibration, camera_from_radar=behind))

    assert test.misfits.all()
    assert np.isinf(test.distances_px).all()


# Which of two calibrations is better, and whether that is more than noise.


def residuals(lengths_px: list[float], placements: list[int] | None = None) -> ResidualFigures:
    """Return residuals of these lengths to the right."""
    n = len(lengths_px)
    return ResidualFigures(
        ids=tuple(f"c{i}" for i in range(n)),
        points_radar_m=np.ones((n, 3)),
        pixels_px=np.zeros((n, 2)),
        projected_px=np.stack([np.array(lengths_px), np.zeros(n)], axis=1),
        inliers=np.ones(n, dtype=np.bool_),
        metrics=metrics_of(np.array(lengths_px)),
        median_px=float(np.median(lengths_px)),
        inlier_share=1.0,
        by_range=(),
        by_azimuth=(),
        by_column=(),
        by_row=(),
        placements=np.arange(n) if placements is None else np.array(placements),
    )


def test_the_difference_is_students_t_over_placements():
    a, b = residuals([5, 6, 7, 8]), residuals([4, 4, 6, 5])
    found = residual_difference(a, b, lost_px=1000.0)

    assert found.mean == pytest.approx(-1.75)  # of -1, -2, -1, -3
    assert found.standard_error == pytest.approx(np.std([-1, -2, -1, -3], ddof=1) / 2)
    assert (found.low, found.high) == pytest.approx(
        (-3.2734, -0.2266), abs=1e-3
    )  # t = 3.1824 with 3 degrees of freedom
    assert found.p_value == pytest.approx(0.0352, abs=1e-3)
    assert (found.winner, found.groups) == ("B", 4)
    assert residual_difference(b, a, lost_px=1000.0).winner == "A"


def test_the_same_pose_with_other_digits_is_no_difference():
    lengths = [5.0, 6.0, 7.0, 8.0]
    finer = residual_difference(residuals(lengths), residuals([one + 1e-5 for one in lengths]), lost_px=1000.0)
    one_differs = residual_difference(residuals(lengths), residuals([*lengths[:3], 8.5]), lost_px=1000.0)

    assert (finer.winner, finer.p_value) == ("equal", 1.0)
    assert one_differs.winner == "unknown"


def test_clicks_of_one_placement_do_not_count_as_evidence_each():
    a = residuals([5.0] * 12, [0] * 6 + [1] * 6)
    b = residuals([4.0] * 6 + [4.5] * 6, [0] * 6 + [1] * 6)
    found = residual_difference(a, b, lost_px=1000.0)

    assert (found.groups, found.winner) == (2, "unknown")


def test_noise_is_no_difference():
    rng = np.random.default_rng(1)
    wins = [
        residual_difference(
            residuals(list(rng.uniform(2, 9, 12))), residuals(list(rng.uniform(2, 9, 12))), lost_px=1e3
        ).winner
        for _ in range(100)
    ]
    assert 85 <= wins.count("unknown") <= 99


def test_a_calibration_that_puts_the_reflector_behind_the_camera_loses():
    lost = residuals([float("nan")] * 5)
    assert residual_difference(residuals([5, 6, 4, 7, 5]), lost, lost_px=1000.0).winner == "A"


def test_equal_calibrations_are_equal():
    assert residual_difference(residuals([1, 2, 3]), residuals([1, 2, 3]), lost_px=1000.0).winner == "equal"


@pytest.mark.slow
def test_acc_is_compared_frame_by_frame():
    scene = street(people=2, seconds=30.0)
    targets = find_targets([scene.scans]).tracks
    right, slightly, wrong = (
        box_figures(turned(TRUE_POSE, 1, angle), CAMERA, scene.scans, scene.boxes, targets=targets)
        for angle in (0.0, 0.05, 3.0)
    )
    clear, close = acc_difference(right, wrong), acc_difference(right, slightly)

    assert clear.winner == "A"
    assert clear.mean < -0.3
    assert close.winner in ("unknown", "equal")
    none = dataclasses.replace(right, frames=())
    assert acc_difference(none, none) is None
