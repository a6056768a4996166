"""Which of two calibrations is better, and whether that is more than noise."""

import dataclasses

import numpy as np
import pytest

from calib_core.evaluation import acc_difference, box_figures, moving_targets, residual_difference
from calib_core.evaluation.figures import ResidualFigures
from calib_core.results.metrics import metrics_of
from tests.street import CAMERA, TRUE_POSE, street, turned


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


def test_acc_is_compared_frame_by_frame():
    scene = street(people=2, seconds=30.0)
    targets = moving_targets(scene.scans)
    right, slightly, wrong = (
        box_figures(turned(TRUE_POSE, 1, angle), CAMERA, scene.scans, scene.boxes, targets=targets)
        for angle in (0.0, 0.05, 3.0)
    )
    clear, close = acc_difference(right, wrong), acc_difference(right, slightly)

    assert clear is not None
    assert clear.winner == "A"
    assert clear.mean < -0.3
    assert close is not None
    assert close.winner in ("unknown", "equal")
    none = dataclasses.replace(right, frames=())
    assert acc_difference(none, none) is None
