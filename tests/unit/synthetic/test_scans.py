"""Simulated radar sessions: bins, static and moving returns, stamps, and their truth."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.errors import OptionError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.radar import direction_cosines
from calib_core.synthetic.options import RadarDefects, SimulationOptions, Traffic
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import SimulatedRecording, simulate

SHORT = SimulationOptions(placements=4, dwell_s=5.0, seed=3)


@pytest.fixture(scope="module")
def session() -> SimulatedRecording:
    return simulate(SHORT)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_scans_and_another_seed_others(session):
    again, other = simulate(SHORT), simulate(replace(SHORT, seed=4))
    assert np.array_equal(session.scans.points_radar_m, again.scans.points_radar_m)
    assert np.array_equal(session.scans.times_ns, again.scans.times_ns)
    assert session.clicks == again.clicks
    assert session.clicks != other.clicks


@pytest.mark.slow
def test_interpolated_azimuths_leave_the_lattice():
    session = simulate(replace(SHORT, defects=RadarDefects(azimuth_bins=0)))
    u = direction_cosines(session.scans.points_radar_m)[:, 1]
    assert np.median(np.abs(32.0 * u - np.round(32.0 * u))) > 0.15


@pytest.mark.slow
def test_the_reflector_shows_in_nearly_every_scan_of_its_dwell_with_doppler_exactly_zero(
    session,
):
    for placement in session.placements:
        window = session.scans.between(placement.start, placement.end)
        error = direction_cosines(window.points_radar_m) - direction_cosines(placement.position_radar_m[None])
        near = (np.abs(error) < [0.1, 0.05, 0.08]).all(axis=1) & (window.doppler_mps == 0.0)
        seen = len(set(window.scan_of_return()[near].tolist())) / len(window)
        assert seen > 0.8, placement.id


def test_without_clutter_and_person_hardly_anything_but_the_reflector_returns():
    session = simulate(replace(SHORT, clutter="none", person=False))
    assert len(session.scans.points_radar_m) < 2.2 * len(session.scans)
    window = session.scans.between(session.placements[1].end, session.placements[2].start)
    assert len(window.points_radar_m) < 0.5 * len(window)


@pytest.mark.slow
def test_clutter_stays_and_a_walking_person_moves(session):
    bare = simulate(replace(SHORT, person=False))
    assert np.mean(bare.scans.doppler_mps == 0.0) > 0.9
    gap = session.scans.between(session.placements[0].end, session.placements[1].start)
    assert np.abs(gap.doppler_mps).max() > 0.5


@pytest.mark.slow
def test_elevation_is_measured_far_worse_than_range_and_azimuth():
    session = simulate(
        replace(SHORT, placements=20, clutter="none", person=False, defects=RadarDefects(azimuth_bins=0))
    )
    errors = []
    for placement in session.placements:
        window = session.scans.between(placement.start, placement.end)
        error = direction_cosines(window.points_radar_m) - direction_cosines(placement.position_radar_m[None])
        errors.append(np.median(error[np.abs(error[:, 0]) < 0.1], axis=0))
    range_m, azimuth, elevation = np.array(errors).std(axis=0)
    assert range_m < 0.03
    assert elevation > 2.0 * azimuth


def test_an_imaging_radar_is_finer():
    session = simulate(replace(SHORT, radar="imaging", clutter="none", person=False))
    placement = session.placements[0]
    window = session.scans.between(placement.start, placement.end)
    error = direction_cosines(window.points_radar_m) - direction_cosines(placement.position_radar_m[None])
    near = np.abs(error[:, 0]) < 0.1
    assert np.abs(np.median(error[near], axis=0)).max() < 0.02


def test_a_click_lies_on_its_truth_pixel_within_its_noise(session):
    frames = set(session.stage.frame_times.header_ns.tolist())
    for click, placement in zip(session.clicks, session.placements, strict=True):
        assert placement.start < click.image_time < placement.end
        assert int(click.image_time) in frames
        assert np.hypot(*([click.u_px, click.v_px] - placement.pixel_px)) < 4.0 * SHORT.click_sigma_px + 0.01


def test_a_truth_pixel_is_the_projection_of_the_true_position(session):
    projected = session.camera.project(session.camera_from_radar @ session.points_radar_m)
    assert np.abs(projected - session.pixels_px).max() < 1e-9
    assert session.camera.sees(session.camera_from_radar @ session.points_radar_m).all()


def test_stamps_rise_and_the_two_sensors_are_not_synchronised(session):
    frames, scans = session.stage.frame_times, session.stage.antennas[0].times
    for times in (frames, scans):
        assert (np.diff(times.header_ns) > 0).all()
        assert (np.diff(times.receive_ns) > 0).all()
        assert (times.receive_ns > times.header_ns).all()
    assert not set(frames.header_ns.tolist()) & set(scans.header_ns.tolist())


@pytest.mark.parametrize("scene", ["rooftop", "field", "aisle", "checkerboard", "open-rooftop", "open-yard", "road"])
def test_every_scene_has_room_for_twenty_placements(scene):
    session = simulate(SimulationOptions(scene=scene, clutter="none", person=False, dwell_s=4.0, radar_rate_hz=2.0))
    ranges = np.linalg.norm(session.points_radar_m, axis=1)
    assert len(session.placements) == 20
    assert ranges.max() - ranges.min() > 5.0
    heights = (session.stage.rig.radar_from_world.inverse() @ session.points_radar_m)[:, 2]
    assert heights == pytest.approx(np.full(20, 0.2), abs=0.06)


def test_on_a_tripod_the_heights_vary():
    session = simulate(SimulationOptions(heights=True, clutter="none", person=False, dwell_s=4.0, radar_rate_hz=2.0))
    heights = (session.stage.rig.radar_from_world.inverse() @ session.points_radar_m)[:, 2]
    assert heights.min() > 0.1
    assert heights.max() - heights.min() > 0.8


@pytest.mark.slow
def test_in_heavy_clutter_something_is_stronger_than_the_reflector():
    session = simulate(replace(SHORT, clutter="heavy", person=False, placements=8))
    placement = session.placements[-1]
    window = session.scans.between(placement.start, placement.end)
    error = np.linalg.norm(window.points_radar_m - placement.position_radar_m, axis=1)
    assert window.snr_db[error > 1.5].max() > window.snr_db[error < 1.0].max()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"placements": 0}, "placements is 0; it must be at least 1 where nothing else moves"),
        ({"dwell_s": 1.0}, "dwell_s is 1.0"),
        ({"jpeg_quality": 0}, "jpeg_quality is 0"),
        ({"placements": -1}, "placements is -1; it must be 0 to"),
        ({"traffic": Traffic(robots=1)}, "robots is 1; it must be 0 in the scene rooftop; ask for scene=aisle"),
        ({"traffic": Traffic(cars=1)}, "ask for scene=road"),
        ({"scene": "road", "traffic": Traffic(walkers=1)}, "must be 0 on the road"),
        ({"scene": "road", "traffic": Traffic(cars=8)}, "cars is 8; it must be at most 4"),
        ({"scene": "road", "traffic": Traffic(cars=1, farthest_m=16.0)}, "at least 12 m beyond"),
        ({"board_corners": 2}, "ask for scene=open-yard"),
        ({"placements": 0, "islands": True, "traffic": Traffic(walkers=1)}, "islands is True"),
        (
            {"traffic": Traffic(walkers=1), "defects": RadarDefects(side_radar=True)},
            "without a radar of several topics",
        ),
    ],
)
def test_an_option_out_of_range_is_refused_by_name(changes, text):
    with pytest.raises(OptionError, match=text):
        replace(SHORT, **changes)


@pytest.mark.slow
def test_traffic_leaves_placements_and_clicks_where_they_are(session):
    busy = simulate(replace(SHORT, traffic=Traffic(walkers=2)))
    assert np.array_equal(busy.points_radar_m, session.points_radar_m)
    assert len(busy.scans.points_radar_m) > len(session.scans.points_radar_m)
    assert np.array_equal(busy.scans.times_ns, session.scans.times_ns)


@pytest.mark.slow
def test_a_reflector_of_twice_the_edge_echoes_12_db_more_and_stands_higher():
    usual, large = (
        simulate(replace(SHORT, clutter="none", person=False, reflector_edge_m=edge)) for edge in (0.16, 0.32)
    )
    levels = [
        np.median([one.scans.between(place.start, place.end).snr_db.max() for place in one.placements])
        for one in (usual, large)
    ]
    assert levels[1] - levels[0] == pytest.approx(40.0 * np.log10(2.0), abs=1.0)
    heights = [(one.stage.rig.radar_from_world.inverse() @ one.points_radar_m)[:, 2].mean() for one in (usual, large)]
    assert heights[1] - heights[0] == pytest.approx(0.32 * 0.16, abs=0.01)


def test_placements_at_the_checkerboard_are_at_its_corners_in_the_image():
    options = replace(PRESETS["paper-d2"], placements=2, board_corners=6, dwell_s=4.0, radar_rate_hz=2.0)
    session = simulate(options)
    board = session.stage.scene.board
    world = session.stage.rig.radar_from_world.inverse() @ session.points_radar_m
    apart = np.linalg.norm(world[:, None] - board.corners_m[None], axis=2).min(axis=1)
    assert (apart < 0.03).sum() == 6
    assert not board.hides(world[apart > 0.03]).any()


def test_only_the_corners_that_the_camera_sees_can_be_asked_for():
    narrow = replace(PRESETS["paper-d2"], board_corners=40, field_of_view_deg=40.0)
    with pytest.raises(OptionError, match=r"board_corners is 40, but the camera sees \d+ inner corners"):
        simulate(narrow)


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["paper-d1", "paper-d2", "paper-d3"])
def test_while_the_reflector_stands_in_the_papers_scenes_hardly_anything_else_does(preset):
    options = replace(PRESETS[preset], placements=4, dwell_s=4.0, radar_rate_hz=4.0)
    session = simulate(replace(options, board_corners=min(options.board_corners, 2)))
    for placement in session.placements:
        middle = (placement.start + placement.end) // 2
        window = session.scans.between(TimeNs(middle - NS_PER_S), TimeNs(middle + NS_PER_S))
        still = window.points_radar_m[
            (window.doppler_mps == 0.0) & (np.linalg.norm(window.points_radar_m, axis=1) < 20.0)
        ]
        far = np.abs(np.linalg.norm(still, axis=1) - np.linalg.norm(placement.position_radar_m)) > 0.3
        assert len(still) >= 4
        assert far.mean() < 0.3, placement.id


def test_a_frame_rate_too_low_for_the_dwell_is_answered_in_words():
    with pytest.raises(OptionError, match="no frame shows placement 1: raise the frame rate or the dwell time"):
        simulate(replace(SHORT, camera_rate_hz=0.1))
