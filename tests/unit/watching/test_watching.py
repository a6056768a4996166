"""A watch says when something turned, keeps little, and carries a calibration forward by what it saw."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calib_core.errors import NoAnswerError
from calib_core.geometry import rotation_log
from calib_core.interchange.own.calibration_json import read_calibration, write_calibration
from calib_core.measurements import RadarScans, TimeNs
from calib_core.radar import RadarErrors
from calib_core.watching.carrying import carried_forward
from calib_core.watching.sentences import baseline_lines, json_line, verdict_lines
from calib_core.watching.traffic import TrafficRows, Watched
from calib_core.watching.watching import Stretch, Watch, baseline_of, stretches
from calib_core.watching.witnesses import SeenTurn, Verdict
from tests.street import CAMERA, TRUE_POSE, street
from tests.unit.watching.test_still_image import CAMERA as SMALL
from tests.unit.watching.test_still_image import scene, turned
from tests.unit.watching.test_still_returns import scans as still_scans
from tests.unit.watching.test_traffic import NS, crossing, traffic

WATCHED = Watched(TRUE_POSE, SMALL, RadarErrors())


def stretch(number: int, *, camera_deg=(0.0, 0.0, 0.0), radar_deg=(0.0, 0.0, 0.0), against_deg=None) -> Stretch:
    """Return half a minute of a fixed rig; with traffic if it is said how the camera turned against the radar."""
    rng = np.random.default_rng(number)
    start = 30 * number
    rows = None
    if against_deg is not None:
        rows = traffic(rng, passages=15, start_s=start, turn_deg=against_deg, body_deg=0.2, first=100 * number)
    image = turned(scene(), camera_deg)
    scans = still_scans(rng, radar_deg)
    scans = replace(scans, times_ns=scans.times_ns + start * NS)
    return Stretch(TimeNs(start * NS), TimeNs((start + 30) * NS), image, scans, rows, True)


def watch_of(*, with_traffic: bool = False) -> Watch:
    against = (0.0, 0.0, 0.0) if with_traffic else None
    found = [stretch(number, against_deg=against) for number in range(4)]
    return Watch(baseline_of(found, calibration_sha256="a" * 64, recording="r", camera=SMALL), WATCHED)


@pytest.mark.slow
def test_a_camera_that_turns_against_the_radar_is_seen_and_when():
    watch = watch_of()
    before = [watch.add(stretch(number)) for number in range(10, 12)]
    after = [watch.add(stretch(number, camera_deg=(0.0, 0.6, 0.0))) for number in range(12, 15)]

    assert {one.finding for one in before} == {"nothing"}
    last = after[-1]
    assert last.finding == "turned"
    assert last.change is not None
    assert last.change.since == 360 * NS
    assert np.rad2deg(last.change.rotation_rad[1]) == pytest.approx(0.6, abs=0.15)
    assert any("left 0.6" in line for line in verdict_lines(last))


def test_a_mast_that_turns_is_no_slip():
    watch = watch_of()
    turn = np.deg2rad([0.0, 0.6, 0.0])
    of_radar = np.rad2deg(TRUE_POSE.rotation.T @ turn)

    verdict = [watch.add(stretch(n, camera_deg=(0.0, 0.6, 0.0), radar_deg=tuple(of_radar))) for n in (10, 11, 12)][-1]

    assert verdict.finding == "mast_turned"


def test_traffic_sees_a_turn_and_since_when():
    watch = watch_of(with_traffic=True)
    still = (0.0, 0.0, 0.0)
    first = [watch.add(replace(stretch(n, against_deg=still), image=None)) for n in (10, 11)][-1]
    last = [watch.add(replace(stretch(n, against_deg=(0.0, 2.0, 0.0)), image=None)) for n in (12, 13)][-1]

    assert first.finding == "nothing"
    assert last.finding == "turned"
    assert last.change is last.traffic
    assert last.change is not None
    assert last.change.since == pytest.approx(360 * NS, abs=25 * NS)
    assert last.change.passages >= 3


def test_words_and_json_always_state_the_power(project_root):
    verdict = watch_of().add(stretch(10))

    assert "would have been noticed" in "\n".join(verdict_lines(verdict))
    written = json.loads(json_line(verdict, at=TimeNs(5), exit_code=0))
    assert written["would_have_been_noticed_deg"]["pitch"] >= 0.0
    page = (project_root / "docs" / "watch.md").read_text(encoding="utf-8")
    seen = next(value for value in (written["image"], written["returns"]) if value is not None)
    assert [key for key in (*written, *seen) if f"`{key}`" not in page and key != "turned"] == []
    short = baseline_of(
        [stretch(0, against_deg=(0.0, 0.0, 0.0))], calibration_sha256="a" * 64, recording="r", camera=SMALL
    )
    first, *notes = baseline_lines(short)
    assert first.startswith("baseline: r, 10 s: ")  # of half a minute, the scans end after ten seconds
    assert sum(line.startswith("note: ") for line in notes) == 1


def test_a_change_of_the_clocks_offset_is_stated_where_it_is_known():
    seen = SeenTurn(np.zeros(3), 1e-8 * np.eye(3), np.full(3, 1e-3), np.zeros(3), passages=9, late_s=(-0.05, 0.005))
    verdict = Verdict("nothing", None, np.full(3, 1e-3), traffic=seen)
    unknown = replace(verdict, traffic=replace(seen, late_s=(-0.02, 0.005)))

    stated = [line for line in verdict_lines(verdict) if "50 ms earlier (95 %: 40 to 60)" in line]
    assert len(stated) == 1
    assert len([*verdict_lines(unknown)]) == len([*verdict_lines(verdict)]) - 1
    assert json.loads(json_line(verdict, at=None))["traffic"]["images_late_s"] == {"change": -0.05, "sigma": 0.005}


def test_a_change_of_the_clocks_offset_is_unknown_without_fast_traffic_both_ways():
    rng = np.random.default_rng(12)
    for rate, known in ((0.5, True), (0.06, False)):
        before = crossing(rng, passages=60, late_s=0.0, rate=rate)
        watch = Watch(
            baseline_of([traffic_only(0, before)], calibration_sha256="a" * 64, recording="r", camera=SMALL), WATCHED
        )
        rows = crossing(rng, passages=12, late_s=0.03, rate=rate, start_s=600.0, first=100)
        seen = watch.add(traffic_only(600, rows)).traffic
        assert seen is not None
        assert (seen.late_s is not None) == known


def traffic_only(start_s: int, rows: TrafficRows) -> Stretch:
    """Return a stretch with nothing but rows."""
    return Stretch(TimeNs(start_s * NS), TimeNs((start_s + 30) * NS), None, RadarScans(), rows, False)


def test_a_recording_without_anything_gives_no_baseline():
    nothing = Stretch(TimeNs(0), TimeNs(30 * NS), None, RadarScans(), None, True)
    with pytest.raises(NoAnswerError):
        baseline_of([nothing], calibration_sha256="a" * 64, recording="r", camera=SMALL)


def test_a_camera_that_turns_within_it_gives_no_baseline():
    found = [stretch(number, camera_deg=(0.0, 0.3 * (number > 1), 0.0)) for number in range(4)]
    with pytest.raises(NoAnswerError, match=r"0\.30"):
        baseline_of(found, calibration_sha256="a" * 64, recording="r", camera=SMALL)


class _Street:
    """A street's radar and boxes, with grey images, as a recording."""

    def __init__(self) -> None:
        self.street = street(people=3, seconds=70.0)
        self.name = "street"
        self.image_times = self.street.boxes.times_ns
        self.radar_times = self.street.scans.times_ns

    def image(self, index: int) -> np.ndarray:
        return np.full((72, 128, 3), 90 + index % 2, dtype=np.uint8)

    def radar_scans(self, start=None, end=None) -> RadarScans:
        return self.street.scans.between(start, end)


@pytest.mark.slow
def test_stretches_hold_traffic_image_and_scans_of_half_a_minute():
    recording = _Street()
    found = list(stretches(recording, Watched(TRUE_POSE, CAMERA, RadarErrors()), recording.street.boxes))

    assert [one.end - one.start for one in found] == [30 * NS] * 3
    assert found[0].image is not None
    assert found[0].image.shape == (72, 128)
    assert found[0].rows is not None
    assert len(found[0].rows) > 20
    assert np.abs(np.rad2deg(np.median(found[0].rows.residuals_rad[found[0].rows.directions == 0]))) < 0.5
    assert (found[1].rows.times_ns >= found[1].start).all()


@pytest.mark.slow
def test_a_recording_that_grows_is_waited_for():
    recording = _Street()
    times = recording.radar_times
    recording.radar_times = times[:100]
    waits = []

    def grow() -> bool:
        waits.append(len(recording.radar_times))
        recording.radar_times = times[: len(recording.radar_times) + 250]
        return len(recording.radar_times) < len(times)

    found = list(stretches(recording, Watched(TRUE_POSE, CAMERA, RadarErrors()), grow=grow))

    assert len(found) == 3
    assert len(waits) == 3


def carried_by(turn_deg: tuple[float, float, float], sigma_deg: float = 0.05, finding: str = "turned") -> Verdict:
    change = SeenTurn(
        np.deg2rad(turn_deg), np.deg2rad(sigma_deg) ** 2 * np.eye(3), np.full(3, 1e-3), np.array([False, True, False])
    )
    return Verdict(finding, change, change.noticed_rad)


def test_a_calibration_is_carried_forward_and_read_back(project_root):
    old = read_calibration((project_root / "tests" / "golden" / "calibration-1.json").read_text(encoding="utf-8"))
    new = carried_forward(old, carried_by((0.2, 1.0, 0.0)), "c" * 64)
    again = read_calibration(write_calibration(new))

    turn = again.calibration.camera_from_radar.rotation @ old.calibration.camera_from_radar.rotation.T
    assert np.rad2deg(rotation_log(turn)) == pytest.approx([0.2, 1.0, 0.0], abs=1e-6)
    assert again.evidence == "carried"
    assert again.carried_from is not None
    assert again.carried_from.sha256 == "c" * 64
    assert [warning.code for warning in again.calibration.warnings][-1] == "carried-forward"
    assert again.calibration.metrics.n == old.calibration.metrics.n
    before, after = (np.trace(one.calibration.covariance[3:, 3:]) for one in (old, again))
    assert after == pytest.approx(before + 3 * np.deg2rad(0.05) ** 2)
    assert again.check_point is not None
    projected = again.calibration.camera.project(again.calibration.camera_from_radar @ again.check_point.radar_m[None])
    assert projected[0] == pytest.approx(again.check_point.pixel_px, abs=1e-6)


@pytest.mark.parametrize("verdict", [carried_by((0.0, 3.5, 0.0)), carried_by((0.0, 0.0, 0.0), finding="nothing")])
def test_what_was_not_seen_or_is_too_large_is_not_carried(verdict, project_root):
    old = read_calibration((project_root / "tests" / "golden" / "calibration-1.json").read_text(encoding="utf-8"))
    with pytest.raises(NoAnswerError):
        carried_forward(old, verdict, "c" * 64)
