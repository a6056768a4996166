"""What placements cover before there is a pose: counts of different places, the emptiest part of the field, heights."""

import numpy as np
import pytest

from calib_core.advice.coverage import ENOUGH_PLACEMENTS, Place, placement_coverage
from calib_core.radar import cartesian_from_polar

HALF_VIEW_RAD = np.deg2rad(30.0)
RANGES_M = (3.5, 7.0, 12.0)
BEARINGS_RAD = np.deg2rad([20.0, 0.0, -20.0])


def positions(polar: list[tuple[float, float]], z_m: float = 0.0) -> np.ndarray:
    found = cartesian_from_polar(
        np.array([(range_m, azimuth_rad, 0.0) for range_m, azimuth_rad in polar]).reshape(-1, 3)
    )
    found[:, 2] = z_m
    return found


def everywhere(repeats: int) -> np.ndarray:
    shift = 0.7 * np.arange(repeats)
    return positions([(r + s, a) for s in shift for r in RANGES_M for a in BEARINGS_RAD])


def test_without_placements_the_whole_field_is_missing():
    coverage = placement_coverage(np.zeros((0, 3)), half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 0
    assert coverage.next is not None
    assert not coverage.is_enough


@pytest.mark.parametrize("missing", [(r, a) for r in range(3) for a in range(3)])
def test_the_part_of_the_field_without_a_placement_is_next(missing):
    there = [(r, a) for i, r in enumerate(RANGES_M) for j, a in enumerate(BEARINGS_RAD) if (i, j) != missing]
    coverage = placement_coverage(positions(there), half_view_rad=HALF_VIEW_RAD)
    side = ("left", "ahead", "right")[missing[1]]
    limits = ((2.0, 5.0), (5.0, 10.0), (10.0, 15.0))[missing[0]]
    assert coverage.next == Place(side, *limits)


def test_enough_placements_everywhere_are_enough():
    coverage = placement_coverage(everywhere(3), half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 27 >= ENOUGH_PLACEMENTS
    assert coverage.next is None
    assert coverage.is_enough


def test_many_placements_on_one_side_are_not():
    one_side = positions([(2.5 + 0.6 * i, BEARINGS_RAD[0]) for i in range(20)])
    coverage = placement_coverage(one_side, half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 20
    assert not coverage.is_enough
    assert coverage.next is not None
    assert coverage.next.side != "left"


def test_two_placements_at_one_place_count_once():
    coverage = placement_coverage(positions([(5.0, 0.0), (5.1, 0.01)]), half_view_rad=HALF_VIEW_RAD)
    assert coverage.placements == 1


def test_one_height_is_told_only_where_the_radar_measures_heights():
    flat = everywhere(2)
    assert not placement_coverage(flat, half_view_rad=HALF_VIEW_RAD).one_height
    flat[:, 2] += np.linspace(0.0, 0.1, len(flat))
    assert placement_coverage(flat, half_view_rad=HALF_VIEW_RAD).one_height
    flat[0, 2] = 1.0
    assert not placement_coverage(flat, half_view_rad=HALF_VIEW_RAD).one_height
