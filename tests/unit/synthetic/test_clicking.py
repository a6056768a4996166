"""Example clicks as people make them, and the truth about each; the default stays one good click per placement."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calib_core.interchange.own.clicks_json import read_clicks
from calib_core.synthetic.files import clicks_text, truth_text
from calib_core.synthetic.options import Clicking, SimulationOptions
from calib_core.synthetic.recording import SimulatedRecording, simulate

QUIET = SimulationOptions(
    scene="field",
    placements=8,
    dwell_s=4.0,
    radar_rate_hz=0.5,
    camera_rate_hz=3.0,
    clutter="none",
    person=False,
    click_sigma_px=0.5,
    seed=3,
)


def _session(**how: float) -> SimulatedRecording:
    return simulate(replace(QUIET, clicking=Clicking(**how)))


def _offsets(session: SimulatedRecording) -> np.ndarray:
    """Return click minus true pixel of its placement: (n, 2) [px]."""
    pixels = {placement.id: placement.pixel_px for placement in session.placements}
    return np.array([[c.click.u_px, c.click.v_px] - pixels[c.placement_id] for c in session.clicked])


def test_by_default_there_is_one_faultless_click_per_placement():
    session = simulate(QUIET)
    assert [one.placement_id for one in session.clicked] == [placement.id for placement in session.placements]
    assert [click.image_time for click in session.clicks] == [p.best_image_time for p in session.placements]
    assert not any(one.faults for one in session.clicked)
    assert "clicks" not in json.loads(truth_text(simulate(QUIET)))


def test_people_click_a_placement_several_times_in_different_frames():
    session = _session(clicks_per_placement=3)
    frames = set(session.stage.frame_times.header_ns.tolist())
    times = [int(click.image_time) for click in session.clicks]
    assert len(times) == len(set(times)) == 24
    assert set(times) <= frames
    by_id = {placement.id: placement for placement in session.placements}
    for one in session.clicked:
        assert by_id[one.placement_id].start < one.click.image_time < by_id[one.placement_id].end
    assert sum("repeated" in one.faults for one in session.clicked) == 16
    assert session.clicks[0] == simulate(QUIET).clicks[0]
    assert np.abs(_offsets(session)).max() < 2.5


def test_people_click_low_in_pixels():
    offsets = _offsets(_session(low_px=6.0))
    assert np.median(offsets, axis=0) == pytest.approx([0.0, 6.0], abs=0.8)


def test_people_click_the_mouth_below_the_apex():
    session = _session(low_m=0.1)
    scale_px = session.camera.matrix_px[1, 1] / np.linalg.norm(session.points_radar_m, axis=1)
    assert np.median(_offsets(session)[:, 1] / scale_px) == pytest.approx(0.1, abs=0.02)
    assert all(one.faults == ("low",) for one in session.clicked)


def test_late_clicks_name_the_old_place_in_a_frame_of_the_next_dwell():
    session = _session(late_share=0.5)
    late = [one for one in session.clicked if "late" in one.faults]
    assert 2 <= len(late) <= 6
    order = {placement.id: i for i, placement in enumerate(session.placements)}
    for one in late:
        following = session.placements[order[one.placement_id] + 1]
        assert following.start < one.click.image_time < following.end
    assert np.abs(_offsets(session)).max() < 2.5
    times = [int(click.image_time) for click in session.clicks]
    assert len(set(times)) == len(times)


def test_the_first_click_is_hasty():
    session = _session(hasty_first_px=40.0)
    off_px = np.linalg.norm(_offsets(session), axis=1)
    assert off_px[0] == pytest.approx(40.0, abs=2.5)
    assert off_px[1:].max() < 2.5
    assert [one.faults for one in session.clicked] == [("hasty",), *[()] * 7]


def test_the_truth_file_tells_which_placement_each_click_names_and_what_is_wrong_with_it():
    careless = Clicking(clicks_per_placement=2, late_share=0.3, hasty_first_px=30.0)
    recording = simulate(replace(QUIET, clicking=careless))
    told = {entry["id"]: entry for entry in json.loads(truth_text(recording))["clicks"]}
    written = read_clicks(clicks_text(recording))
    assert {click.id for click in written} == set(told)
    assert len(json.loads(truth_text(recording))["placements"]) == 8
    for one in recording.clicked:
        assert told[one.click.id] == {"id": one.click.id, "placement": one.placement_id, "faults": list(one.faults)}
    assert {fault for entry in told.values() for fault in entry["faults"]} == {"repeated", "late", "hasty"}


def test_two_reflectors_may_be_clicked_late_and_twice_too():
    session = simulate(
        replace(QUIET, reflectors=2, islands=True, clicking=Clicking(clicks_per_placement=2, late_share=0.4))
    )
    times = [int(click.image_time) for click in session.clicks]
    assert len(set(times)) == len(times)
    assert any("late" in one.faults for one in session.clicked)
