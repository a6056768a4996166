"""Measurements: stamps, clicks, scans, pairs."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.measurements import (
    NS_PER_S,
    Pair,
    RadarScan,
    RadarScans,
    TimeNs,
    time_from_parts,
    time_parts,
)


def scan_at(time_ns: int, *ranges_m: float) -> RadarScan:
    n = len(ranges_m)
    points = np.array([[range_m, 0.0, 0.0] for range_m in ranges_m]).reshape(n, 3)
    return RadarScan(TimeNs(time_ns), points, np.zeros(n), np.arange(n) + 10.0, np.full((n, 3), np.nan))


def scans_at(*times_ns: int) -> RadarScans:
    return RadarScans.from_scans([scan_at(time_ns, float(i + 1)) for i, time_ns in enumerate(times_ns)])


@given(st.integers(0, 2**62))
def test_a_stamp_survives_being_split_into_seconds_and_nanoseconds(time_ns):
    sec, nanosec = time_parts(TimeNs(time_ns))
    assert 0 <= nanosec < NS_PER_S
    assert time_from_parts(sec, nanosec) == time_ns


def test_scans_are_stacked_in_order_of_time_with_their_returns():
    scans = RadarScans.from_scans([scan_at(30, 3.0), scan_at(10, 1.0, 1.5), scan_at(20)])
    assert scans.times_ns.tolist() == [10, 20, 30]
    assert scans.first_return.tolist() == [0, 2, 2, 3]
    assert scans.points_radar_m[:, 0].tolist() == [1.0, 1.5, 3.0]
    assert scans.scan_of_return().tolist() == [0, 0, 2]


def test_one_scan_is_returned_unchanged():
    scan = scan_at(20, 2.0, 2.5)
    again = RadarScans.from_scans([scan_at(10, 1.0), scan, scan_at(30)]).scan(1)
    assert again.time == 20
    assert len(again) == 2
    for name in ("points_radar_m", "doppler_mps", "snr_db", "sigma_polar"):
        np.testing.assert_array_equal(getattr(again, name), getattr(scan, name))


def test_no_scans_make_an_empty_recording():
    assert len(RadarScans.from_scans([])) == 0
    assert RadarScans().scan_of_return().tolist() == []
    assert len(RadarScans().between(TimeNs(0), TimeNs(10))) == 0


@given(st.lists(st.integers(0, 1000), min_size=1, max_size=20), st.integers(-100, 1100))
def test_the_nearest_scan_is_the_one_a_search_through_all_finds(times_ns, time_ns):
    scans = scans_at(*times_ns)
    nearest = scans.nearest(TimeNs(time_ns))
    gaps = np.abs(scans.times_ns - time_ns)
    assert gaps[nearest] == gaps.min()
    assert scans.times_ns[nearest] == scans.times_ns[gaps == gaps.min()].min()


def test_of_two_scans_equally_near_the_earlier_is_taken():
    assert scans_at(10, 20).nearest(TimeNs(15)) == 0


def test_no_scans_have_no_nearest_scan():
    with pytest.raises(ValueError, match="no scans"):
        RadarScans().nearest(TimeNs(5))


@given(st.lists(st.integers(0, 100), max_size=20), st.integers(-10, 110), st.integers(-10, 110))
def test_between_keeps_the_scans_from_start_to_end_with_both_ends(times_ns, start, end):
    scans = scans_at(*times_ns)
    kept = scans.between(TimeNs(start), TimeNs(end))
    inside = [i for i, time_ns in enumerate(scans.times_ns.tolist()) if start <= time_ns <= end]
    assert kept.times_ns.tolist() == scans.times_ns[inside].tolist()
    np.testing.assert_array_equal(kept.points_radar_m, scans.points_radar_m[inside])


@pytest.mark.parametrize(
    ("times_ns", "first_return", "reason"),
    [
        ([20, 10], [0, 1, 2], "ascending"),
        ([10, 20], [0, 1, 1], "first_return"),
        ([10, 20], [1, 1, 2], "first_return"),
        ([10, 20], [0, 3, 2], "first_return"),
        ([10, 20], [0, 2], "expected an array"),
    ],
)
def test_columns_that_do_not_fit_together_are_refused(times_ns, first_return, reason):
    with pytest.raises(ValueError, match=reason):
        RadarScans(
            np.array(times_ns), np.array(first_return), np.zeros((2, 3)), np.zeros(2), np.zeros(2), np.zeros((2, 3))
        )


def test_a_scan_whose_columns_differ_in_length_is_refused():
    with pytest.raises(ValueError, match="expected an array of 2"):
        RadarScan(TimeNs(0), np.zeros((2, 3)), np.zeros(3), np.zeros(2), np.zeros((2, 3)))


def test_measurements_cannot_be_changed():
    scan = scan_at(10, 1.0)
    with pytest.raises(ValueError, match="read-only"):
        scan.points_radar_m[0, 0] = 2.0
    with pytest.raises(FrozenInstanceError):
        scan.time = TimeNs(3)


def test_a_pair_without_a_radar_position_is_refused():
    with pytest.raises(ValueError, match="c1 has no radar position"):
        Pair("c1", np.array([1.0, 2.0]), ())
