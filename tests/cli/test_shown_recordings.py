"""`video --overlay`, `record-rrd` and `rerun` on good and on bad input."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from calib_core.measurements import NS_PER_S, TimeNs, time_parts
from tests.cli.conftest import START, Made

Cocalib = Callable[..., Any]


@pytest.fixture
def recording(made: Callable[..., Path]) -> Path:
    return made()


@pytest.fixture
def calibration(cocalib: Cocalib, recording: Path, clicks_file: Path, tmp_path: Path) -> Path:
    """Return a calibration solved from the recording."""
    out = tmp_path / "calibration.json"
    answer = cocalib("solve", recording, "--clicks", clicks_file, "--out", out)
    assert answer.code == 0, answer.err
    return out


@pytest.fixture
def boxes_file(tmp_path: Path) -> Path:
    """Return boxes in two frames of the recordings of `made`."""
    frames = []
    for number in (3, 4):
        sec, nanosec = time_parts(TimeNs(START + number * NS_PER_S // 2))
        boxes = [{"label": "person", "box_px": [40, 50, 120, 150], "track": "person-1"}]
        frames.append({"image_time": {"sec": sec, "nanosec": nanosec}, "boxes": boxes})
    path = tmp_path / "boxes.json"
    path.write_text(json.dumps({"schema": "cocalib/boxes-1", "image_size_px": [320, 240], "frames": frames}))
    return path


def test_an_overlay_video_names_its_codec(cocalib, recording, calibration, tmp_path):
    pytest.importorskip("av", reason="the extra 'video' is not installed")
    out = tmp_path / "out.mp4"
    answer = cocalib("show", recording, "--calibration", calibration, "--against", calibration, "--out", out)
    assert answer.code == 0, answer.err
    assert answer.out == f"{out}: 65 frames, 32.000 s, 640 x 270 px, encoded as H.264\n"


def test_a_file_for_rerun_has_clicks_and_boxes(cocalib, recording, calibration, clicks_file, boxes_file, tmp_path):
    pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
    out = tmp_path / "view.rrd"
    more = ("--clicks", clicks_file, "--boxes", boxes_file)
    answer = cocalib("show", recording, "--calibration", calibration, "--out", out, *more)
    assert answer.code == 0, answer.err
    assert answer.out.splitlines()[0] == f"{out}: 65 frames, 320 scans, 8 clicks"
    assert out.stat().st_size > 10_000


def test_rerun_without_a_display_names_other_ways(cocalib, recording, calibration, monkeypatch):
    pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    answer = cocalib("show", recording, "--calibration", calibration)
    assert answer.code == 2
    assert "there is no display" in answer.err
    assert "--web" in answer.err
    assert "--out FILE.rrd" in answer.err


def test_what_does_not_fit_is_named(cocalib, recording, made, calibration, tmp_path):
    pytest.importorskip("av", reason="the extra 'video' is not installed")
    pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
    video, rrd = ("show", recording, "--out", tmp_path / "o.mp4"), ("show", recording)
    other = Made().camera.scaled(0.5)
    smaller = made("smaller", camera=other)
    for command, words in (
        ((*video, "--trail", "3"), "--calibration FILE is missing"),
        ((*video, "--calibration", calibration, "--trail", "-1"), "--trail -1: give a number of scans"),
        ((*rrd, "--calibration", calibration, "--out", tmp_path / "o.mcap"), "o.mcap"),
        ((*rrd, "--out", tmp_path / "o.rrd"), "--calibration FILE is missing"),
        ((*rrd, "--calibration", tmp_path / "absent.json", "--out", tmp_path / "o.rrd"), "absent.json"),
        (
            ("show", smaller, "--calibration", calibration, "--out", tmp_path / "o.rrd"),
            "its pictures have 160 x 120 px, but the calibration's camera has 320 x 240 px",
        ),
    ):
        answer = cocalib(*command)
        assert answer.code == 2, command
        assert words in answer.err, answer.err
        assert len(answer.err.splitlines()) == 1
    assert list(tmp_path.glob("*.part*")) == []


def test_speeds_that_no_radar_reports_are_refused(cocalib, calibration, made, tmp_path):
    pytest.importorskip("av", reason="the extra 'video' is not installed")
    options = ("--calibration", calibration, "--colour", "speed", "--out", tmp_path / "o.mp4")
    answer = cocalib("show", made("still", with_speeds=False), *options)
    assert answer.code == 2
    assert "the radar reports no speeds (/radar/points); use --colour range" in answer.err
