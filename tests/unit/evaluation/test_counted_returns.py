"""A frame's scan is the nearest by the recorded stamps, within half a scan period."""

import numpy as np

from calib_core.evaluation.counted_returns import frame_scans, longest_gap_s

SCANS = np.array([0, 100, 200, 300, 700], dtype=np.int64) * 1_000_000


def frames(*milliseconds: float) -> np.ndarray:
    return np.array([round(time * 1e6) for time in milliseconds], dtype=np.int64)


def test_the_nearest_scan_within_half_a_period_is_taken():
    assert frame_scans(frames(0, 49, 51, 250, 349, 351), SCANS).tolist() == [0, 0, 1, 2, 3, -1]


def test_of_two_equally_near_scans_the_earlier_one_is_taken():
    assert frame_scans(frames(50, 150), SCANS).tolist() == [0, 1]


def test_a_stated_limit_replaces_half_the_period():
    assert frame_scans(frames(351, 520), SCANS, max_gap_s=0.2).tolist() == [3, 4]
    assert frame_scans(frames(1), SCANS, max_gap_s=0.0).tolist() == [-1]


def test_the_period_is_the_median_so_gaps_do_not_widen_it():
    assert longest_gap_s(SCANS) == 0.05


def test_without_scans_no_frame_has_one():
    assert frame_scans(frames(1, 2), np.zeros(0, dtype=np.int64)).tolist() == [-1, -1]
