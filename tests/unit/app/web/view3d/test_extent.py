"""The 3D view fits the data: rings end where they end, and from every viewpoint all of them are in sight."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cocalib.web.view3d.extent import UNKNOWN, Extent, extent_of, fitted_stand, ring_ranges_m

NO_POINTS = np.zeros((0, 3))


def test_two_ghosts_of_a_hundred_returns_do_not_stretch_a_room_but_a_far_reflector_does():
    room = np.column_stack([np.linspace(1.0, 6.0, 198), np.linspace(-2.0, 2.0, 198), np.zeros(198)])
    ghosts = np.array([[180.0, 0.0, 0.0], [0.0, -190.0, 20.0]])
    points, weights = np.concatenate([room, ghosts]), np.ones(200)
    assert 6.0 < extent_of(points, weights, NO_POINTS).range_m < 7.5
    reached = extent_of(points, weights, np.array([[30.0, 30.0, 1.5]]))
    assert 43.0 < reached.range_m < 48.0
    assert 1.5 <= reached.high_m <= 1.7


def test_the_field_is_around_the_reflectors_and_without_any_around_most_returns():
    room = np.column_stack([np.linspace(1.0, 6.0, 198), np.linspace(-2.0, 2.0, 198), np.zeros(198)])
    points = np.concatenate([room, [[180.0, 0.0, 0.0], [0.0, -190.0, 20.0]]])
    without = np.array(extent_of(points, np.ones(200), NO_POINTS).outline_m)
    assert np.allclose(without.min(axis=0), (0.0, -2.0), atol=0.3), "two ghosts do not widen it"
    assert np.allclose(without.max(axis=0), (6.0, 2.0), atol=0.3)
    around = extent_of(points, np.ones(200), np.array([[4.0, 1.0, 0.5], [3.0, -1.0, 0.5], [3.0, 0.0, 0.5]]))
    assert len(around.outline_m) == 3
    assert np.allclose(sorted(around.outline_m), [(0.0, 0.0), (3.0, -1.0), (4.0, 1.0)], atol=0.1), "the radar is in it"


def test_what_was_seen_all_the_time_counts_more_than_what_was_seen_once():
    points = np.array([[5.0, 0.0, 0.0], [100.0, 0.0, 0.0]])
    assert extent_of(points, np.array([1.0, 0.001]), NO_POINTS).range_m == pytest.approx(5.5)
    assert extent_of(points, np.array([0.5, 0.5]), NO_POINTS).range_m == pytest.approx(110.0)


def test_without_data_the_usual_extent_is_assumed():
    assert extent_of(NO_POINTS, np.zeros(0), NO_POINTS) == UNKNOWN
    assert extent_of(np.full((1, 3), np.nan), np.ones(1), NO_POINTS) == UNKNOWN


@pytest.mark.parametrize(
    ("range_m", "rings_m"),
    [
        (6.0, (1, 2, 3, 4, 5, 6)),
        (6.6, (2, 4, 6, 8)),
        (13.0, (5, 10, 15)),
        (30.0, (5, 10, 15, 20, 25, 30)),
        (200.0, (50, 100, 150, 200)),
        (2.0, (0.5, 1.0, 1.5, 2.0)),
    ],
)
def test_rings_reach_as_far_as_the_data(range_m, rings_m):
    assert ring_ranges_m(range_m) == pytest.approx(rings_m)


@given(st.floats(0.5, 2000.0))
def test_there_are_two_to_six_rings_and_the_last_holds_everything(range_m):
    rings_m = ring_ranges_m(range_m)
    assert 2 <= len(rings_m) <= 6
    assert rings_m[-1] >= range_m * (1 - 1e-6)
    assert rings_m[-2] < range_m
    step = float(f"{rings_m[0]:.3e}")
    assert f"{step:e}"[0] in "125"
    assert np.diff(rings_m) == pytest.approx(rings_m[0])


sides = st.floats(-300.0, 300.0)
extents = st.builds(
    Extent,
    range_m=st.just(300.0),
    outline_m=st.lists(st.tuples(sides, sides), min_size=1, max_size=6).map(lambda corners: ((0.0, 0.0), *corners)),
    low_m=st.floats(-5.0, 0.0),
    high_m=st.floats(0.1, 20.0),
)


@given(extents, st.sampled_from(["behind", "above", "side"]), st.floats(0.4, 3.0))
def test_from_every_viewpoint_all_of_the_field_is_in_sight_and_fills_the_view_along_one_axis(extent, viewpoint, aspect):
    stand = fitted_stand(extent, viewpoint, 0.75, aspect)
    ahead = (stand.look_at_m - stand.position_m) / stand.distance_m
    right = np.cross(ahead, stand.up) / np.linalg.norm(np.cross(ahead, stand.up))
    seen = (extent.corners() - stand.position_m) @ np.stack([right, np.cross(right, ahead), ahead]).T
    assert seen[:, 2].min() > 0, "nothing is behind the viewer"
    tangent = np.tan(0.75 / 2.0)
    places = seen[:, :2] / seen[:, 2:] / [tangent * aspect, tangent]
    assert np.abs(places).max() < 0.95
    assert 0.6 < (np.ptp(places, axis=0) / 2.0).max() < 0.95
    assert stand.filled == pytest.approx(np.ptp(places, axis=0) / 2.0, abs=1e-6)


@pytest.mark.parametrize("viewpoint", ["behind", "side"])
def test_a_long_road_is_no_strip_from_behind_and_looked_at_more_steeply_from_the_side_than_a_room(viewpoint):
    road = Extent(250.0, ((0.0, -25.0), (0.0, 25.0), (250.0, -25.0), (250.0, 25.0)), -2.0, 6.0)
    room = Extent(10.0, ((0.0, -5.0), (0.0, 5.0), (10.0, -5.0), (10.0, 5.0)), -1.0, 4.0)
    tilts = []
    for extent in (road, room):
        stand = fitted_stand(extent, viewpoint, 0.75, 1.4)
        tilts.append((stand.position_m - stand.look_at_m)[2] / stand.distance_m)
        assert stand.filled.min() >= (0.15 if viewpoint == "side" and extent is road else 0.5)
    assert tilts[0] >= tilts[1] if viewpoint == "side" else tilts[0] < 0.8
