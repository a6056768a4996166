"""From clicks to a calibration: the shared function, the calibration's text, and the worker."""

import json
import random
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from calib_core.association.pairing import half_window_s
from calib_core.camera import Camera
from calib_core.errors import InputError, OptionError
from calib_core.interchange.cameras.files import CameraFile
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.measurements import RadarScans, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, LocatingOptions
from calib_core.recordings import Recording, RecordingOptions, open_recording
from calib_core.recordings.containers.writing import CloudMessage, RecordedMessage, write_ros1_bag
from calib_core.results import Calibration, DataWarning
from calib_core.results.actions import FollowHint
from calib_core.results.confirmation import lost_data
from calib_core.results.verdict import verdict_on
from cocalib.cli.exit_codes import exit_code
from cocalib.platform.resources import version
from cocalib.session.events import ClicksImported, OptionsChanged
from cocalib.solving.solving import (
    GivenPairs,
    calibration_text,
    calibration_text_of_pairs,
    camera_for,
    solve_clicks,
    solve_in_steps,
    solve_pairs,
)
from cocalib.workspace import open_workspace
from tests.cli.conftest import pairs_text

CAMERA = Camera("pinhole", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))
CLICK = ReflectorClick(TimeNs(10**18), "c1", 1.0, 2.0)


class Radar:
    """A radar recording that records what was requested."""

    def __init__(self, answer: Callable[[], RadarScans] = RadarScans) -> None:
        self.asked: list[tuple[tuple[int, ...], float]] = []
        self._answer = answer

    def radar_scans_around(self, times, half_window_s: float) -> RadarScans:
        self.asked.append((tuple(times), half_window_s))
        return self._answer()


@pytest.fixture(scope="module")
def sample(project_root: Path) -> Path:
    return project_root / "sample_data" / "rooftop"


@pytest.fixture(scope="module")
def solved(recording: Recording, clicks: tuple[ReflectorClick, ...]) -> Calibration:
    return solve_clicks(recording, clicks, recording.camera(), CalibrationOptions()).unwrap()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lost", "leads"),
    [("none", False), ("one in a window", True), ("a few elsewhere", False), ("many elsewhere", True)],
)
def test_lost_returns_lead_the_verdict_where_they_can_matter(tmp_path, recording, clicks, solved, lost, leads):
    scans = recording.radar_scans()
    half_ns = round(half_window_s(CalibrationOptions()) * 1e9)
    reached = [np.abs(scans.times_ns - int(click.image_time)) <= half_ns for click in clicks]
    far = np.flatnonzero(~np.any(reached, axis=0))
    spoilt = {"none": [], "one in a window": np.flatnonzero(reached[3])[:1], "a few elsewhere": far[:1]}.get(lost, far)

    def messages() -> Iterator[RecordedMessage]:
        for number in range(len(scans)):
            scan = scans.scan(number)
            values = np.column_stack([scan.points_radar_m, scan.snr_db, scan.doppler_mps])
            if number in spoilt:
                values[0 if lost == "many elsewhere" else -1 :, 0] = np.nan
            body = CloudMessage(scan.time, "radar", ("x", "y", "z", "snr_db", "doppler_mps"), values)
            yield RecordedMessage("/radar", scan.time, body)

    camera = next(path for path in recording.paths if path.name == "camera.bag")
    with open_recording([camera, write_ros1_bag(tmp_path / "radar.bag", messages())]) as changed:
        changed.radar_scans()
        outcome = solve_clicks(changed, clicks, recording.camera(), CalibrationOptions())
        told = any(warning.code == "lost-returns" for warning in changed.warnings)
    assert isinstance(outcome, Calibration)
    verdict = verdict_on(outcome)
    assert told == (lost != "none")
    cause = verdict.cause.code if isinstance(verdict.cause, DataWarning) else ""
    assert (verdict.level == "coarse" and cause == "lost-returns") == leads
    assert any(warning.code == "lost-returns" for warning in outcome.warnings) == leads


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "count"), [(7, 20), (100, 20), (108, 20), (114, 10), (115, 10)])
def test_clicks_in_the_frames_of_other_placements_leave_nothing_to_rely_on(recording, clicks, seed, count):
    pixels = [(click.u_px, click.v_px) for click in clicks[:count]]
    random.Random(seed).shuffle(pixels)
    mixed = [replace(one, u_px=u_px, v_px=v_px) for one, (u_px, v_px) in zip(clicks, pixels, strict=False)]
    outcome = solve_clicks(recording, tuple(mixed), recording.camera(), CalibrationOptions())
    assert verdict_on(outcome).level == "contradictory"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "code", "lost", "exits"),
    [
        (1.0, "", 0, 0),
        (0.95, "damaged-recording", 1, 0),
        (0.5, "radar-missing", 9, 3),
        (0.3, "radar-mostly-missing", 15, 3),
        (0.125, "radar-mostly-missing", 18, None),
    ],
)
def test_a_recording_cut_off_leads_the_verdict_where_clicks_lost_their_returns(
    sample, tmp_path, clicks, share, code, lost, exits
):
    whole = (sample / "radar.bag").read_bytes()
    (tmp_path / "radar.bag").write_bytes(whole[: int(share * len(whole))])
    with open_recording([tmp_path / "radar.bag", sample / "camera.bag"]) as cut:
        outcome = solve_clicks(cut, clicks, cut.camera(), CalibrationOptions())
        text = calibration_text(outcome, cut) if isinstance(outcome, Calibration) else ""
    verdict = verdict_on(outcome)

    leading = outcome.suspected if isinstance(outcome, Unsolvable) else (verdict.cause,)
    assert [(one.code, one.facts["lost"]) for one in leading if one] == [(code, lost)] * (lost > 0)
    assert not lost or verdict.action == FollowHint()
    if isinstance(outcome, Calibration):
        assert (verdict.level == "contradictory") == (code == "radar-mostly-missing")
        assert exit_code(verdict.level, None, None, outcome.warnings) == exits
        assert not {"few-pairs", "no-consensus"} & {one.code for one in outcome.warnings}
    if text:
        damage = read_calibration(text).provenance.damage
        assert any("could not be parsed" in one for one in damage) == (lost > 0)
        assert ("damage" in json.loads(text)["provenance"]) == (lost > 0)


@pytest.mark.parametrize(
    ("without", "touched", "share", "damaged", "code"),
    [
        (5, 5, 0.0, False, ""),
        (6, 6, 0.0, False, "radar-missing"),
        (10, 10, 0.0, True, "radar-missing"),
        (11, 11, 0.0, False, "radar-mostly-missing"),
        (0, 0, 0.05, True, ""),
        (0, 0, 0.06, True, "damaged-recording"),
        (0, 0, 0.06, False, ""),
        (0, 1, 0.0, True, "damaged-recording"),
    ],
)
def test_lost_data_are_told_by_clicks_and_by_their_share(without, touched, share, damaged, code):
    damage = DataWarning.reported("not-closed", "the end is missing", "copy it again") if damaged else None
    warning = lost_data(clicks=20, without=without, touched=touched, share=share, damage=damage)
    assert (warning.code if warning else "") == code


@pytest.mark.slow
def test_a_gap_within_a_damaged_recording_touches_the_click_in_it(tmp_path, recording, clicks):
    scans = recording.radar_scans()
    gone = np.abs(scans.times_ns - int(clicks[4].image_time)) < 10**9

    def messages() -> Iterator[RecordedMessage]:
        for number in np.flatnonzero(~gone).tolist():
            scan = scans.scan(number)
            values = np.column_stack([scan.points_radar_m, scan.doppler_mps])
            body = CloudMessage(scan.time, "radar", ("x", "y", "z", "doppler_mps"), values)
            yield RecordedMessage("/radar", scan.time, body)

    camera = next(path for path in recording.paths if path.name == "camera.bag")
    whole = write_ros1_bag(tmp_path / "radar.bag", messages())
    for path, touched in ((whole, None), (tmp_path / "cut.bag", 1)):
        path.write_bytes(whole.read_bytes()[: None if touched is None else -300])
        with open_recording([camera, path]) as changed:
            outcome = solve_clicks(changed, clicks, recording.camera(), CalibrationOptions())
        lost = [one.facts["lost"] for one in outcome.warnings if one.code == "damaged-recording"]
        assert lost == ([] if touched is None else [touched])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_right_clicks_alarm_nobody_in_any_order_and_a_wrong_one_is_named(recording, clicks, seed):
    order = [clicks[place] for place in np.random.default_rng(seed).permutation(len(clicks))]
    for count in (5, 9, 12):
        outcome = solve_clicks(recording, order[:count], recording.camera(), CalibrationOptions())
        assert all(pair.inlier for pair in outcome.pairs)
        assert verdict_on(outcome).level != "contradictory"
    wrong = replace(order[11], u_px=abs(order[11].u_px - 45.0))
    outcome = solve_clicks(recording, [*order[:11], wrong], recording.camera(), CalibrationOptions())
    assert verdict_on(outcome).level == "coarse" or wrong.id in [pair.id for pair in outcome.pairs if not pair.inlier]
    outcome = solve_clicks(recording, [*order[:6], wrong], recording.camera(), CalibrationOptions())
    consistent = any(warning.facts["clear"] for warning in outcome.warnings if warning.code == "few-pairs")
    assert consistent == all(pair.inlier for pair in outcome.pairs), "neither does one that is left out look so"


def test_options_out_of_range_are_refused_here_too_and_missing_intrinsics_an_answer():
    assert solve_clicks(Radar(), [CLICK], None, CalibrationOptions()).code == "no-camera"
    wrong = CalibrationOptions(locating=LocatingOptions(window_s=-1.0))
    with pytest.raises(OptionError, match=r"locating\.window_s"):
        solve_clicks(Radar(), [CLICK], CAMERA, wrong)
    with pytest.raises(OptionError, match=r"locating\.window_s"):
        solve_pairs(GivenPairs.read("{}", "pairs.json"), wrong)


def test_scans_are_read_around_every_click_once_excluded_ones_too_as_far_as_any_window_can_reach():
    radar, options = Radar(), CalibrationOptions(locating=LocatingOptions(window_s=10.0, max_time_gap_s=2.0))
    later = replace(CLICK, id="c2", image_time=TimeNs(2 * 10**18), excluded=True)
    outcome = solve_clicks(radar, [later, CLICK, replace(CLICK, id="c3")], CAMERA, options)
    assert radar.asked == [((10**18, 2 * 10**18), half_window_s(options))]
    assert half_window_s(options) >= 10.0 / 2 + 2.0
    assert isinstance(outcome, Unsolvable)


def test_reading_more_scans_than_needed_does_not_change_the_answer(recording, clicks, solved):
    outcome = solve_clicks(Radar(recording.radar_scans), clicks, recording.camera(), CalibrationOptions())
    assert calibration_text(outcome, recording) == calibration_text(solved, recording)


@pytest.mark.parametrize("method", ["default", "paper"])
def test_page_and_command_line_give_the_same_bytes(tmp_path, recording, clicks, method):
    options = CalibrationOptions(method=method)
    by_command = solve_clicks(recording, clicks, recording.camera(), options)
    answered = threading.Event()
    workspace = open_workspace(recording, camera=recording.camera(), session_folder=tmp_path / "s", name="sample")
    workspace.dispatch(OptionsChanged.of(options))
    workspace.dispatch(ClicksImported.of(clicks))
    workspace.subscribe(lambda shown: answered.set() if shown.stage == "solved" else None)
    assert answered.wait(60)
    by_page = workspace.session.outcome
    workspace.close()
    assert calibration_text(by_page, recording) == calibration_text(by_command, recording)


def test_a_preview_comes_first_and_the_answer_does_not_depend_on_it(recording, clicks, solved):
    camera, options = recording.camera(), CalibrationOptions()
    warned = replace(
        solved, warnings=(DataWarning.reported("weak-geometry", "the pose is uncertain", "add placements"),)
    )
    for previous in (None, warned):
        preview, answer = solve_in_steps(recording, clicks, camera, options, previous=previous)
        assert isinstance(preview, Calibration)
        assert (preview.checking, answer.checking) == (True, False)
        error = preview.camera_from_radar.error_from(answer.camera_from_radar)
        assert error @ np.linalg.solve(answer.covariance, error) < 0.1
        assert preview.warnings == (warned.warnings if previous else ())
        assert preview.next_placement is (warned.next_placement if previous else None)
        assert calibration_text(answer, recording) == calibration_text(solved, recording)
    *previews, _ = solve_in_steps(recording, clicks, camera, replace(options, method="paper"), previous=solved)
    assert previews == []


def test_the_text_says_what_went_in(sample, recording, solved):
    file = read_calibration(calibration_text(solved, recording))
    assert {row.name: row.sha256 for row in file.provenance.inputs} == {
        name: sha256((sample / name).read_bytes()).hexdigest() for name in ("camera.bag", "radar.bag")
    }
    made = file.provenance
    assert (made.radar_topic, made.image_topic, made.version) == (
        recording.radar_topic,
        recording.image_topic,
        version(),
    )
    assert (file.frames.radar, file.frames.camera) == (recording.radar_frame, recording.camera_frame)
    options = RecordingOptions(radar_axes="forward,right,up")
    with open_recording([sample / "camera.bag", sample / "radar.bag"], options) as turned:
        made = json.loads(calibration_text(solved, turned))["provenance"]
    assert (made["radar_axes"], made["video_start"]) == ("forward,right,up", None), "the frames are from no video"


@pytest.mark.parametrize(
    ("frames", "names"),
    [
        (("", ""), ("radar", "camera_optical")),
        (("r", ""), ("r", "camera_optical")),
        (("same", "same"), ("radar", "camera_optical")),
        (("$(evil)", "c"), ("radar", "camera_optical")),
    ],
)
def test_odd_frame_names_do_not_cost_the_calibration(recording, solved, frames, names, monkeypatch):
    for sensor, name in zip(("radar", "camera"), frames, strict=True):
        monkeypatch.setattr(recording, f"{sensor}_frame", name)
    written = json.loads(calibration_text(solved, recording))["frames"]
    assert (written["radar"], written["camera"]) == names


def test_the_recordings_own_camera_is_used_unless_a_file_that_fits_is_given(tmp_path, recording):
    assert camera_for(recording, None) is recording.camera()
    given, path = recording.camera(), tmp_path / "camera.yaml"
    other = Camera("pinhole", given.width_px, given.height_px, given.matrix_px * [[1.1], [1.1], [1.0]])
    path.write_text(camera_info_text(other), encoding="utf-8")
    assert camera_for(recording, CameraFile.read(path)).matrix_px == pytest.approx(other.matrix_px)
    path.write_text(camera_info_text(replace(CAMERA, width_px=123, height_px=45)), encoding="utf-8")
    with pytest.raises(InputError, match=r"camera\.yaml: calibrated for 123 x 45 px, but the frames have"):
        camera_for(recording, CameraFile.read(path))


def test_a_camera_file_is_named_by_its_content_whether_it_came_by_its_path_or_was_dropped_on_the_page(
    tmp_path, recording, solved
):
    given = recording.camera()
    assert given is not None
    data = camera_info_text(given).encode()
    (tmp_path / "camera.yaml").write_bytes(data)
    by_path, dropped = CameraFile.read(tmp_path / "camera.yaml"), CameraFile("camera.yaml", data)
    text = calibration_text(solved, recording, camera_file=dropped)
    assert calibration_text(solved, recording, camera_file=by_path) == text
    inputs = json.loads(text)["provenance"]["inputs"]
    assert inputs[-1] == {"name": "camera.yaml", "size_bytes": len(data), "sha256": sha256(data).hexdigest()}
    assert inputs[:-1] == json.loads(calibration_text(solved, recording))["provenance"]["inputs"]


def test_a_file_of_pairs_is_solved_and_named_in_the_text(solved):
    pairs = [(pair.id, pair.point_radar_m, pair.pixel_px) for pair in solved.pairs]
    text = pairs_text(solved.camera, pairs)
    given = GivenPairs.read(text, "pairs.json")
    outcome = solve_pairs(given, CalibrationOptions())
    inputs = json.loads(calibration_text_of_pairs(outcome, given))["provenance"]["inputs"]
    assert [(row["name"], row["sha256"]) for row in inputs] == [("pairs.json", sha256(text.encode()).hexdigest())]
    few = GivenPairs.read(pairs_text(solved.camera, pairs[:3]), "pairs.json")
    assert isinstance(solve_pairs(few, CalibrationOptions()), Unsolvable)
    with pytest.raises(InputError, match=r"pairs\.json"):
        solve_pairs(GivenPairs.read("{}", "pairs.json"), CalibrationOptions())


@pytest.mark.parametrize("method", ["default", "paper"])
def test_clicks_outside_the_radar_recording_are_named_in_the_answer(recording, clicks, method):
    away = [replace(click, image_time=TimeNs(click.image_time + 10**12)) for click in clicks[:5]]
    options = CalibrationOptions(method=method)
    outcome = solve_clicks(recording, away, recording.camera(), options)
    assert [row.id for row in outcome.unpaired] == [click.id for click in away]
