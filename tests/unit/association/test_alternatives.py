"""Two azimuths of one return: candidates of their own, but one reflector."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.association.clustering import clusters_of
from calib_core.association.exclusive_returns import exclusive_rows, shared_returns
from calib_core.association.gating import static_returns
from calib_core.association.pairing import balanced_pairs, pair_clicks, scores_of
from calib_core.association.placements import find_placements
from calib_core.measurements import NS_PER_S, Candidate, Pair, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions, GatingOptions
from calib_core.radar import cartesian_from_polar

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
    return RadarScan(
        TimeNs(round(time_s * NS_PER_S)),
        cartesian_from_polar(polar),
        np.zeros(2 * n),
        np.full(2 * n, 20.0),
        np.full((2 * n, 3), np.nan),
        np.tile(np.arange(n), 2),
    )


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


def test_the_column_survives_cutting_gating_and_stacking() -> None:
    static = static_returns(SCANS, GatingOptions(max_range_m=8.0))
    assert static.alternative_of is not None
    assert len(static.alternative_of) == len(static.points_radar_m) < len(SCANS.points_radar_m)
    window = static.between(TimeNs(5 * NS_PER_S), TimeNs(6 * NS_PER_S))
    again = RadarScans.from_scans([window.scan(i) for i in range(len(window))])
    assert again.alternative_of is not None
    assert window.alternative_of is not None
    assert again.alternative_of.tolist() == window.alternative_of.tolist() == [1, 1] * len(window)
    plain = replace(window.scan(0), alternative_of=None)
    mixed = RadarScans.from_scans([plain, window.scan(1)])
    assert mixed.alternative_of is not None
    assert mixed.alternative_of.tolist() == [-1, -1, 1, 1]


def test_both_azimuths_are_candidates_that_know_each_other() -> None:
    pairs = pair_clicks(clicks(*MOMENTS_S), SCANS, CalibrationOptions()).pairs
    for pair, (range_m, azimuth_rad) in zip(pairs, STAYS, strict=True):
        first, second = pair.candidates[:2]
        assert first.alternative_of == second.alternative_of >= 0
        assert first.score == pytest.approx(second.score, rel=0.1)
        azimuths = sorted(np.arctan2(one.position_radar_m[1], one.position_radar_m[0]) for one in (first, second))
        assert azimuths == pytest.approx([azimuth_rad + OTHER_RAD, azimuth_rad], abs=0.01)
        assert np.linalg.norm(first.position_radar_m) == pytest.approx(range_m, abs=0.02)
        assert sum(one.score for one in pair.candidates) <= 1.0 + 1e-9


def test_what_stands_where_the_other_azimuth_of_another_placement_was_is_still_new() -> None:
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


def test_a_return_taken_at_one_azimuth_cannot_be_taken_at_the_other() -> None:
    shown = (candidate(5.0, 0.2, 0), candidate(5.0, -0.4, 0), candidate(8.0, 0.1))
    pairs = [Pair(name, np.zeros(2), shown, image_time=TimeNs(time)) for name, time in (("a", 0), ("b", NS_PER_S))]
    labels = shared_returns(pairs, window_s=3.0)
    assert labels[0] == labels[1] == labels[3] == labels[4]
    assert labels[2] == labels[5] != labels[0]
    first = np.array([0, 3, 6])
    rows = exclusive_rows(np.array([0.0, 9.0, 5.0, 9.0, 1.0, 5.0]), first, labels)
    assert rows.tolist() in ([0, 5], [2, 4])


def test_alternatives_share_what_their_return_gets_against_its_companion() -> None:
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


def test_both_azimuths_of_one_reflector_are_one_placement() -> None:
    found = find_placements(SCANS, GatingOptions())
    assert len(found) == len(STAYS)
    for placement, ((range_m, azimuth_rad), (start_s, end_s)) in zip(found, STAYS.items(), strict=True):
        assert placement.start / NS_PER_S == pytest.approx(start_s, abs=0.3)
        assert placement.end / NS_PER_S == pytest.approx(end_s, abs=0.3)
        shown = cartesian_from_polar(np.array([[range_m, azimuth_rad, 0.0]]))[0]  # listed before the other azimuth
        assert placement.position_radar_m == pytest.approx(shown, abs=0.05)


def test_without_the_scans_around_it_a_dwell_is_still_one_placement() -> None:
    cuts = [SCANS.between(TimeNs(a * NS_PER_S), TimeNs(b * NS_PER_S - 1)) for a, b in ((4, 9), (13, 18), (22, 27))]
    islands = RadarScans.from_scans([cut.scan(i) for cut in cuts for i in range(len(cut))])
    assert len(find_placements(islands, GatingOptions())) == len(STAYS)
