"""Unkind scenes: several reflectors, carts, cars, fences, passers-by and gaps; each is measured in the recording."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.errors import OptionError
from calib_core.measurements import NS_PER_S, RadarScans
from calib_core.radar import direction_cosines
from calib_core.synthetic.options import SimulationOptions, Surroundings
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.scene.scenes import scene_named
from calib_core.synthetic.scene.stage import SimulatedPlacement, set_stage
from calib_core.synthetic.scene.surroundings import cart_position, in_sight

QUIET = SimulationOptions(
    scene="field",
    placements=6,
    dwell_s=4.0,
    radar_rate_hz=5.0,
    camera_rate_hz=4.0,
    clutter="none",
    person=False,
    seed=3,
)
CARTS = Surroundings(companion=True)


def _seen(scans: RadarScans, position_m: np.ndarray) -> float:
    """Return the share of scans with a static return at a position."""
    error = np.abs(direction_cosines(scans.points_radar_m) - direction_cosines(position_m[None]))
    near = (error < [0.1, 0.06, 0.1]).all(axis=1) & (scans.doppler_mps == 0.0)
    return len(set(scans.scan_of_return()[near].tolist())) / max(len(scans), 1)


def _window(session: SimulatedRecording, placement: SimulatedPlacement) -> RadarScans:
    return session.scans.between(placement.start, placement.end)


def test_two_reflectors_stand_at_once_and_are_moved_in_turn():
    session = simulate(replace(QUIET, reflectors=2))
    placements = session.placements
    for first, second, third in zip(placements, placements[1:], placements[2:], strict=False):
        assert first.start < second.start < first.end < third.start
    both = session.scans.between(placements[1].start, placements[0].end)
    assert min(_seen(both, placement.position_radar_m) for placement in placements[:2]) > 0.7
    assert min(_seen(_window(session, placement), placement.position_radar_m) for placement in placements) > 0.7


def test_the_further_reflector_of_each_scene_stands_as_much_farther_away_as_asked_for():
    session = simulate(replace(QUIET, placements=6, reflectors=2, reflectors_apart_m=0.7))
    places_m = np.array([resting.position_m[:2] for resting in session.stage.story.restings])
    ranges_m = np.linalg.norm(places_m, axis=1)
    assert ranges_m[1::2] - ranges_m[::2] == pytest.approx(np.full(3, 0.7))
    assert np.linalg.norm(places_m[1::2] - places_m[::2], axis=1).min() >= session.stage.scene.layout.separation_m


def test_the_clicks_of_two_reflectors_name_both_in_one_dwell_but_in_different_frames():
    session = simulate(replace(QUIET, reflectors=2))
    times = [int(click.image_time) for click in session.clicks]
    assert len(set(times)) == 6
    for one, other in ((0, 1), (2, 3), (4, 5)):
        assert abs(times[one] - times[other]) < 1.0 * NS_PER_S
        assert session.placements[one].start < times[other] < session.placements[one].end


def test_a_cart_stands_behind_the_reflector_at_every_placement_and_echoes_more():
    session = simulate(replace(QUIET, surroundings=CARTS))
    from_world = session.stage.rig.radar_from_world
    for placement, resting in zip(session.placements, session.stage.story.restings, strict=True):
        cart = (from_world @ cart_position(resting.position_m)[None])[0]
        window = _window(session, placement)
        assert np.linalg.norm(cart) - np.linalg.norm(placement.position_radar_m) == pytest.approx(1.0, abs=0.15)
        assert _seen(window, cart) > 0.8
        range_m = np.linalg.norm(window.points_radar_m, axis=1)
        at_cart, at_reflector = (
            np.abs(range_m - np.linalg.norm(place)) < 0.08 for place in (cart, placement.position_radar_m)
        )
        assert np.median(window.snr_db[at_cart]) > np.median(window.snr_db[at_reflector])
    gap = session.scans.between(session.placements[0].end, session.placements[1].start)
    assert _seen(gap, session.placements[0].position_radar_m) < 0.1


def test_parked_cars_a_fence_and_a_target_of_29_dbsm_are_always_there_and_hide_nothing():
    strong = Surroundings(parked_cars=3, fence=True, strong_target_dbsm=29.0)
    session = simulate(replace(QUIET, clutter="scene", surroundings=strong))
    plain, scene = scene_named("field"), session.stage.scene
    added = replace(scene, solids=scene.solids[len(plain.solids) :])
    places = session.stage.rig.radar_from_world.inverse() @ session.points_radar_m
    assert in_sight(added, places).all()
    [car, *_] = [one for one in added.solids if one.length_m == 4.4]
    assert not in_sight(added, np.array([[1.5 * car.x_m, 1.5 * car.y_m, 0.2]])).any()
    strongest = max(scene.scatterers, key=lambda one: one.rcs_dbsm)
    position = (session.stage.rig.radar_from_world @ np.array([strongest.position_m]))[0]
    assert strongest.rcs_dbsm == 29.0
    assert _seen(session.scans, position) > 0.95
    count = len(session.scans.points_radar_m) / len(session.scans)
    assert count > len(simulate(replace(QUIET, clutter="scene")).scans.points_radar_m) / len(session.scans) + 5.0


def test_flickering_targets_are_seen_for_a_share_of_the_time_and_by_turns():
    session = simulate(replace(QUIET, radar_rate_hz=10.0, surroundings=Surroundings(flickering_targets=5)))
    times_s = np.arange(0.0, session.stage.story.duration_s, 0.1)
    for one in session.stage.flickers:
        shown = np.array([one.shows(float(time_s)) for time_s in times_s])
        thing = one.scatterer
        position = (session.stage.rig.radar_from_world @ np.array([thing.position_m]))[0]
        assert 0.1 < shown.mean() < 0.75
        assert 2 <= np.abs(np.diff(shown.astype(int))).sum() < 20
        assert _seen(session.scans, position) == pytest.approx(shown.mean(), abs=0.15)


@pytest.mark.slow
def test_passers_by_cross_the_scene_and_some_stop():
    session = simulate(replace(QUIET, radar_rate_hz=10.0, surroundings=Surroundings(passers_by=3)))
    story = session.stage.story
    assert len(story.passers_by) == 3
    for one, stops in zip(story.passers_by, (False, False, True), strict=True):
        times_s = np.arange(0.0, one.start_s + 60.0, 0.1)
        places = np.array([state.place_m for t in times_s if (state := one.at(float(t))) is not None])
        steps_m = np.linalg.norm(np.diff(places, axis=0), axis=1)
        assert steps_m.max() < 0.2
        assert (steps_m[5:-5] < 1e-9).sum() * 0.1 == pytest.approx(one.stop_s, abs=0.3)
        assert (one.stop_s > 0.0) == stops
        assert np.sign(places[0, 1]) == -np.sign(places[-1, 1])
    moving = np.abs(session.scans.doppler_mps) > 0.2
    alone = simulate(replace(QUIET, radar_rate_hz=10.0))
    assert moving.sum() > np.sum(np.abs(alone.scans.doppler_mps) > 0.2) + 50


def test_recordings_in_islands_are_short_with_minutes_between():
    session = simulate(replace(QUIET, islands=True))
    for times in (session.stage.antennas[0].times, session.stage.frame_times):
        gaps_s = np.diff(times.header_ns) / NS_PER_S
        ends = np.flatnonzero(gaps_s > 5.0)
        assert len(ends) == 5
        assert ((gaps_s[ends] > 59.0) & (gaps_s[ends] < 301.0)).all()
        lengths = np.diff(np.concatenate([[0], ends + 1, [len(times)]]))
        rate_hz = 5.0 if times is session.stage.antennas[0].times else 4.0
        assert lengths.min() / rate_hz > 1.5
        assert lengths.max() / rate_hz < 15.5
        assert (np.diff(times.receive_ns) > 0).all()
    stamps = session.scans.times_ns
    for placement, click in zip(session.placements, session.clicks, strict=True):
        assert placement.start < click.image_time < placement.end
        assert ((stamps > placement.start) & (stamps < placement.end)).sum() > 5
        assert _seen(_window(session, placement), placement.position_radar_m) > 0.7


def test_an_island_begins_with_the_reflector_already_there_if_it_is_shorter_than_the_dwell():
    session = simulate(replace(QUIET, islands=True, dwell_s=20.0))
    first = [window for placement in session.placements if len(window := _window(session, placement))]
    assert all(window.times_ns[-1] - window.times_ns[0] < 15.5 * NS_PER_S for window in first)


def test_several_reflectors_carts_and_passers_by_are_in_the_image():
    options = replace(
        QUIET, reflectors=2, width_px=320, height_px=200, surroundings=Surroundings(companion=True, passers_by=1)
    )
    stage = set_stage(options)
    renderer = FrameRenderer.of(stage.scene, stage.rig, companion=True)
    moment = stage.story.at(stage.story.restings[1].left_alone_s - 1.0)
    assert [one.index for one in moment.standing] == [0]
    passer = replace(moment.person, x_m=5.0, y_m=-1.0)
    empty = renderer.still.levels[..., ::-1]
    changed = np.abs(renderer.render(replace(moment, passers_by=(passer,)), person=False) - empty).max(axis=2) > 25.0
    places = [
        *(stage.story.restings[i].position_m - np.array([0.0, 0.0, 0.03]) for i in (0, 1)),
        *(cart_position(stage.story.restings[i].position_m) for i in (0, 1)),
        np.array([passer.x_m, passer.y_m, 1.2]),
    ]
    pixels = stage.rig.camera.project(stage.rig.camera_from_world @ np.array(places))
    for u, v in pixels.round().astype(int).tolist():
        assert changed[v - 1 : v + 2, u - 1 : u + 2].any()


def test_the_aisle_has_no_room_for_cars():
    with pytest.raises(OptionError, match="the aisle has no room"):
        SimulationOptions(scene="aisle", surroundings=Surroundings(parked_cars=1))


def test_a_value_out_of_its_range_is_refused_by_its_name():
    with pytest.raises(OptionError, match=r"surroundings\.parked_cars is 99; it must be 0 to 8"):
        SimulationOptions(surroundings=Surroundings(parked_cars=99))
    with pytest.raises(OptionError, match=r"reflectors is 0; it must be 1 to 4"):
        simulate(SimulationOptions(reflectors=0))
