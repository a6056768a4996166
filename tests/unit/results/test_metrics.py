"""Metrics in addition to the paper's; the paper's equations are in tests/paper."""

import math

import numpy as np
import pytest

from calib_core.results.metrics import acc, aed, cdsd, distances, inside_boxes, metrics_of, rms

LENGTHS = np.array([1.0, 2.0, 6.0])


def test_rms_is_the_root_of_the_mean_square() -> None:
    assert rms(LENGTHS) == pytest.approx(math.sqrt(41.0 / 3.0))


def test_rms_aed_and_cdsd_belong_together() -> None:
    n = len(LENGTHS)
    assert n * rms(LENGTHS) ** 2 == pytest.approx(n * aed(LENGTHS) ** 2 + (n - 1) * cdsd(LENGTHS) ** 2)


def test_without_pairs_there_are_no_metrics() -> None:
    nothing = np.zeros(0)
    assert math.isnan(aed(nothing))
    assert math.isnan(rms(nothing))
    assert math.isnan(cdsd(nothing))
    assert metrics_of(nothing).n == 0


def test_one_pair_has_no_spread() -> None:
    assert aed(np.array([3.0])) == 3.0
    assert math.isnan(cdsd(np.array([3.0])))


def test_the_metrics_contain_the_held_out_figure_and_the_training_one() -> None:
    metrics = metrics_of(LENGTHS, held_out_distances_px=LENGTHS + 1.0, acc=0.5, chi2=4.0, degrees_of_freedom=3)
    assert metrics.aed_px == pytest.approx(3.0)
    assert metrics.held_out_aed_px == pytest.approx(4.0)
    assert (metrics.acc, metrics.chi2, metrics.degrees_of_freedom, metrics.n) == (0.5, 4.0, 3, 3)


def test_without_held_out_pairs_that_figure_is_unknown() -> None:
    metrics = metrics_of(LENGTHS)
    assert math.isnan(metrics.held_out_aed_px)
    assert metrics.acc is None


def test_distances_are_euclidean() -> None:
    np.testing.assert_allclose(
        distances(np.array([[3.0, 4.0], [1.0, 1.0]]), np.array([[0.0, 0.0], [1.0, 1.0]])), [5, 0]
    )


def test_a_pixel_on_a_box_edge_is_inside_and_one_past_it_is_not() -> None:
    boxes = np.array([[10.0, 20.0, 30.0, 40.0], [100.0, 100.0, 110.0, 110.0]])
    pixels = np.array([[10.0, 40.0], [9.99, 30.0], [105.0, 105.0], [20.0, 105.0], [np.nan, 30.0]])
    assert inside_boxes(pixels, boxes).tolist() == [True, False, True, False, False]


def test_no_boxes_contain_no_pixel() -> None:
    assert inside_boxes(np.array([[1.0, 2.0]]), np.zeros((0, 4))).tolist() == [False]
    assert inside_boxes(np.zeros((0, 2)), np.array([[0.0, 0.0, 1.0, 1.0]])).tolist() == []


def test_acc_without_any_frame_is_unknown() -> None:
    assert acc([]) is None
    assert acc([np.zeros(0, dtype=np.bool_)]) is None
    assert acc([np.array([False])], zero_frames="drop") is None
