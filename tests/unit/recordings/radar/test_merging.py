"""Scans of several topics of one radar, merged moment by moment."""

from collections.abc import Sequence

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.radar import cartesian_from_polar
from calib_core.recordings.radar.merging import Spread, merged, moments_of, spread_of

SPREAD = Spread(np.array([0.1, 0.02, 0.05]), 0.1)
COARSE = Spread(np.array([0.1, 0.04, 0.05]), 0.1)
Return = tuple[float, float, float]
"""Range [m], azimuth [rad], speed [m/s]."""


def scans_of(*scans: Sequence[Return]) -> RadarScans:
    found = []
    for number, returns in enumerate(scans):
        values = np.array(returns, dtype=float).reshape(-1, 3)
        points = cartesian_from_polar(np.column_stack([values[:, :2], np.zeros(len(values))]))
        n = len(values)
        found.append(
            RadarScan(TimeNs(number * NS_PER_S), points, values[:, 2], np.full(n, 20.0), np.full((n, 3), np.nan))
        )
    return RadarScans.from_scans(found)


def times(*seconds: float) -> np.ndarray:
    return np.round(np.array(seconds) * NS_PER_S).astype(np.int64)


def test_scans_within_half_a_cycle_of_the_fastest_topic_are_one_moment() -> None:
    moments = moments_of([times(0.0, 0.05, 0.10, 0.15), times(0.0, 0.04, 0.08, 0.12, 0.16)])
    assert moments.times_ns.tolist() == times(0.0, 0.04, 0.08, 0.12, 0.16).tolist()
    assert moments.scan_of.tolist() == [[0, 1, 2, -1, 3], [0, 1, 2, 3, 4]]


def test_a_constant_delay_between_two_topics_makes_no_moments_of_their_own() -> None:
    moments = moments_of([times(0.03, 0.13, 0.23), times(0.0, 0.1, 0.2)])
    assert moments.scan_of.tolist() == [[0, 1, 2], [0, 1, 2]]


def test_a_scan_too_far_from_the_others_or_second_in_its_moment_is_a_moment_of_its_own() -> None:
    moments = moments_of([times(0.0, 0.1, 0.2, 0.3), times(0.01, 0.02, 0.9)])
    assert moments.times_ns.tolist() == times(0.0, 0.02, 0.1, 0.2, 0.3, 0.9).tolist()
    assert moments.scan_of.tolist() == [[0, -1, 1, 2, 3, -1], [0, 1, -1, -1, -1, 2]]


def test_every_scan_is_in_exactly_one_moment() -> None:
    rng = np.random.default_rng(4)
    series = [np.unique(rng.integers(0, 10 * NS_PER_S, size)) for size in (90, 55, 70)]
    moments = moments_of(series)
    assert (np.diff(moments.times_ns) >= 0).all()
    for own, numbers in zip(series, moments.scan_of, strict=True):
        assert sorted(numbers[numbers >= 0].tolist()) == list(range(len(own)))


def test_a_return_that_two_topics_report_counts_once_as_the_finer_one_has_it() -> None:
    near = scans_of([(6.02, 0.11, 0.0), (3.0, -0.2, 0.0)])
    far = scans_of([(6.0, 0.10, 0.0), (15.0, 0.0, 0.0)])
    both = merged([near, far], [COARSE, SPREAD], [0, 1])
    ranges = np.linalg.norm(both.points_radar_m, axis=1)
    assert ranges == pytest.approx([6.0, 15.0, 3.0], abs=1e-6)
    assert both.alternative_of is None


@pytest.mark.parametrize("other", [(6.2, 0.10, 0.0), (6.0, 0.25, 0.0), (6.0, 0.10, 0.5)])
def test_returns_in_different_bins_stay_two(other: Return) -> None:
    both = merged([scans_of([(6.0, 0.10, 0.0)]), scans_of([other])], [SPREAD, SPREAD], [0, 1])
    assert len(both.points_radar_m) == 2


def test_two_returns_near_each_other_are_not_both_taken_for_one() -> None:
    one, two = scans_of([(6.0, 0.10, 0.0)]), scans_of([(6.01, 0.10, 0.0), (6.05, 0.11, 0.0)])
    assert len(merged([one, two], [SPREAD, SPREAD], [0, 1]).points_radar_m) == 2


def test_other_azimuths_are_alternatives_of_the_same_return_whatever_their_order() -> None:
    first = scans_of([(6.0, 0.1, 0.0), (9.0, 0.3, 0.0)], [(4.0, 0.0, 1.0)])
    second = scans_of([(9.0, -0.4, 0.0), (6.0, -0.6, 0.0)], [(4.0, 0.7, 1.0)])
    both = merged([first, second], [SPREAD, SPREAD], [0, 0])
    assert both.scan(0).alternative_of is not None
    azimuth = np.arctan2(both.points_radar_m[:, 1], both.points_radar_m[:, 0])
    assert both.alternative_of is not None
    labelled = sorted(
        (int(scan), int(of), round(float(angle), 3))
        for scan, of, angle in zip(both.scan_of_return(), both.alternative_of, azimuth, strict=True)
    )
    assert labelled == [(0, 0, -0.6), (0, 0, 0.1), (0, 1, -0.4), (0, 1, 0.3), (1, 0, 0.0), (1, 0, 0.7)]


def test_an_azimuth_given_twice_or_not_at_all_is_no_alternative() -> None:
    first = scans_of([(6.0, 0.1, 0.0), (9.0, 0.3, 0.0), (12.0, 0.0, 0.0)])
    second = scans_of([(6.0, 0.105, 0.0), (9.0, np.nan, 0.0), (12.0, 0.5, 0.0)])
    both = merged([first, second], [SPREAD, SPREAD], [0, 0])
    assert len(both.points_radar_m) == 4
    assert both.alternative_of is not None
    assert sorted(both.alternative_of.tolist()) == [-1, -1, 0, 0]


def test_a_return_reported_near_and_far_takes_its_alternatives_along() -> None:
    parts = [scans_of([(6.0, 0.1, 0.0)]), scans_of([(6.0, -0.5, 0.0)])]
    four = merged([*parts, *parts], [SPREAD, SPREAD, COARSE, COARSE], [0, 0, 2, 2])
    assert len(four.points_radar_m) == 2
    assert four.alternative_of is not None
    assert four.alternative_of.tolist() == [0, 0]


def test_the_spread_is_measured_in_the_data() -> None:
    rng = np.random.default_rng(1)
    targets = np.array([(4.0, -0.3, 0.0), (7.0, 0.2, 0.0), (11.0, 0.0, 0.0), (15.0, 0.4, 0.25)])
    noise = [0.01, 0.004, 0.0]
    scans = scans_of(*(targets + noise * rng.standard_normal((4, 3)) for _ in range(40)))
    spread = spread_of(scans)
    assert spread.step[0] == pytest.approx(0.035, rel=0.3)
    assert spread.step[1] == pytest.approx(3.5 * 0.0039, rel=0.3)
    assert spread_of(scans.between(TimeNs(0), TimeNs(0))).step[0] > 0.0
