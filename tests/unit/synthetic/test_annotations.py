"""True boxes and labels: around what is drawn, named for every return, absent where nothing is to be judged."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S, Box
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.synthetic.annotations import true_boxes, true_labels
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions, Surroundings, Traffic
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.scene.traffic import ActorLabel, Mover

WALK = SimulationOptions(
    scene="open-rooftop",
    placements=0,
    width_px=320,
    height_px=180,
    camera_rate_hz=2.0,
    traffic=Traffic(walkers=2, duration_s=8.0),
)


def _standing(recording: SimulatedRecording, *places: tuple[ActorLabel, float, float, float]) -> SimulatedRecording:
    """Put objects at places (x, y, heading) where they stay."""
    movers = tuple(
        Mover(label, number, np.array([0.0, 9.0]), np.array([[x, y], [x, y]]), np.full(2, heading))
        for number, (label, x, y, heading) in enumerate(places, start=1)
    )
    story = replace(recording.stage.story, movers=movers)
    return replace(recording, stage=replace(recording.stage, story=story))


def _boxes(*places: tuple[ActorLabel, float, float, float]) -> dict[str, Box]:
    return {box.track: box for box in true_boxes(_standing(simulate(WALK), *places)).frames[3].boxes}


@pytest.mark.slow
@pytest.mark.parametrize(("radar", "container"), [("awr1843", "ros1"), ("imaging", "ros1"), ("awr1843", "mcap")])
def test_labels_are_in_the_order_in_which_the_recording_returns_each_scan(radar, container, tmp_path):
    recording = simulate(replace(WALK, radar=radar, width_px=64, height_px=64, camera_rate_hz=1.0))
    write_recording(recording, tmp_path, (container,))
    sent = {scan.time: scan for scan in recording.scans_of(recording.stage.antennas[0])}
    labelled = {scan.radar_time: scan.tracks for scan in true_labels(recording).scans}
    assert labelled.keys() == sent.keys()
    where = [tmp_path / "radar.bag"] if container == "ros1" else [tmp_path / f"recording_{container}"]
    with open_recording(where, RecordingOptions(), require=("radar",)) as opened:
        scans = opened.radar_scans()
    assert {time for time, scan in sent.items() if len(scan)} <= set(scans.times_ns.tolist())
    for number in range(len(scans)):
        read = scans.scan(number)
        original = sent[read.time]
        assert len(labelled[read.time]) == len(read)
        np.testing.assert_allclose(read.points_radar_m, original.points_radar_m, atol=1e-4)
    named = {track for tracks in labelled.values() for track in tracks}
    assert named == {"", "person-1", "person-2"}


def test_a_return_named_after_a_person_comes_from_where_that_person_is():
    recording = simulate(WALK)
    from_world = recording.stage.rig.radar_from_world
    movers = {mover.track: mover for mover in recording.stage.story.movers}
    times = recording.stage.antennas[0].times
    checked = 0
    for scan, labels, moment_s in zip(
        recording.scans_of(recording.stage.antennas[0]),
        true_labels(recording).scans,
        times.moment_s.tolist(),
        strict=True,
    ):
        for point, track in zip(scan.points_radar_m, labels.tracks, strict=True):
            if track:
                place = movers[track].at(moment_s).state.place_m
                body = from_world @ np.array([[*place, 1.0]])
                assert abs(np.linalg.norm(point) - np.linalg.norm(body)) < 0.9
                checked += 1
    assert checked > 100


@pytest.mark.slow
def test_a_box_touches_what_the_renderer_draws():
    recording = _standing(simulate(replace(WALK, width_px=640, height_px=360)), ("person", 6.0, 0.4, 2.0))
    stage = recording.stage
    renderer = recording.renderer
    moment = stage.story.at(1.0)
    drawn = np.abs(
        renderer.render(moment, person=False).astype(int)
        - renderer.render(replace(moment, traffic=()), person=False).astype(int)
    ).max(axis=2)
    [box] = true_boxes(recording).frames[0].boxes
    rows = np.flatnonzero((drawn > 25).any(axis=1))
    assert rows.min() == pytest.approx(box.top_px, abs=1.5)
    upper = drawn[: round(0.4 * box.top_px + 0.6 * box.bottom_px)] > 15  # a shadow falls on the ground only
    assert np.flatnonzero(upper.any(axis=0)).max() == pytest.approx(box.right_px, abs=2.5)
    assert np.flatnonzero((drawn > 15).any(axis=0)).min() == pytest.approx(
        box.left_px, abs=2.5
    )  # no shadow on that side


def test_a_car_has_a_box_from_its_wheels_to_its_roof_by_the_pinhole_rule():
    box = _boxes(("car", 20.0, 0.0, 0.0))["car-1"]
    camera = simulate(WALK).camera
    focal_px = float(camera.matrix_px[1, 1])
    assert box.bottom_px - box.top_px == pytest.approx(focal_px * 1.45 / 17.9, rel=0.05)
    assert box.right_px - box.left_px == pytest.approx(focal_px * 1.82 / 17.9, rel=0.08)


def test_who_is_behind_another_is_partly_hidden_or_has_no_box():
    alone = _boxes(("person", 5.0, 0.0, 0.0), ("person", 9.0, 2.0, 0.0))
    partly = _boxes(("person", 5.0, 0.0, 0.0), ("person", 9.0, 0.45, 0.0))
    behind = _boxes(("person", 5.0, 0.0, 0.0), ("car", 12.0, 0.0, 0.0), ("person", 18.0, 0.0, 0.0))
    assert alone["person-2"].score == 1.0
    assert 0.25 <= partly["person-2"].score < 0.9
    assert partly["person-1"].score == 1.0
    assert "person-3" not in behind


def test_a_box_ends_at_the_border_of_the_image_and_nobody_outside_has_one():
    options = simulate(WALK).options
    near = _boxes(("car", 5.5, 3.0, 0.0))["car-1"]
    assert near.left_px == -0.5
    assert near.right_px < options.width_px
    assert near.score < 1.0
    assert not _boxes(("person", 4.0, 9.0, 0.0))
    assert not _boxes(("person", -4.0, 0.0, 0.0))


@pytest.mark.slow
def test_the_files_are_written_where_something_moves_that_is_worth_judging(tmp_path):
    small = replace(WALK, width_px=64, height_px=64, camera_rate_hz=1.0)
    write_recording(simulate(small), tmp_path / "walk")
    boxes = json.loads((tmp_path / "walk" / "boxes.json").read_text())
    labels = json.loads((tmp_path / "walk" / "labels.json").read_text())
    assert (boxes["schema"], labels["schema"]) == ("cocalib/boxes-1", "cocalib/labels-1")
    assert boxes["image_size_px"] == [64, 64]
    first = simulate(small).stage.frame_times.header_ns[0]
    stamp = boxes["frames"][0]["image_time"]
    assert stamp["sec"] * NS_PER_S + stamp["nanosec"] == first
    assert json.loads((tmp_path / "walk" / "clicks.json").read_text())["clicks"] == []
    quiet = replace(small, placements=1, dwell_s=3.5, camera_rate_hz=2.0, traffic=Traffic())
    write_recording(simulate(quiet), tmp_path / "quiet")
    assert {path.name for path in (tmp_path / "quiet").iterdir()} == {
        "camera.bag",
        "clicks.json",
        "radar.bag",
        "truth.json",
    }


@pytest.mark.slow
def test_who_carries_the_reflector_and_passers_by_have_tracks_of_their_own():
    recording = simulate(
        replace(WALK, placements=2, dwell_s=4.0, traffic=Traffic(), surroundings=Surroundings(passers_by=2))
    )
    tracks = {box.track for frame in true_boxes(recording) for box in frame.boxes}
    named = {track for scan in true_labels(recording).scans for track in scan.tracks}
    assert "person-1" in tracks
    assert tracks <= {"person-1", "person-2", "person-3"}
    assert len(tracks) > 1
    assert tracks <= named


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "beyond_m"), [("cars-near", 12.0), ("cars-far", 45.0)])
def test_the_radar_sees_cars_of_both_directions_at_their_ranges(preset, beyond_m):
    options = PRESETS[preset]
    recording = simulate(replace(options, traffic=replace(options.traffic, duration_s=20.0), camera_rate_hz=1.0))
    ranges, speeds = [], []
    for scan, labels in zip(recording.scans_of(recording.stage.antennas[0]), true_labels(recording).scans, strict=True):
        of_cars = np.array([track.startswith("car-") for track in labels.tracks], dtype=bool)
        ranges += np.linalg.norm(scan.points_radar_m[of_cars], axis=1).tolist()
        speeds += scan.doppler_mps[of_cars].tolist()
    assert max(ranges) > beyond_m
    assert min(speeds) < -2.0
    assert max(speeds) > 2.0
    assert np.mean(np.abs(speeds) < 13.0) == 1.0
