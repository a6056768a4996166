"""`video --overlay`, `record-rrd` and `rerun` on good and on bad input."""

import json
from pathlib import Path

import pytest

from calib_core.measurements import NS_PER_S, TimeNs, time_parts
from tests.cli.conftest import START


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


def test_an_overlay_video_names_its_codec(cocalib, solved, tmp_path):
    pytest.importorskip("av", reason="the extra 'video' is not installed")
    out = tmp_path / "out.mp4"
    answer = cocalib("show", solved.with_name("made.mcap"), "--calibration", solved, "--against", solved, "--out", out)
    assert answer.code == 0, answer.err
    assert answer.out.startswith(f"{out}: 65 frames, 32.000")


def test_a_file_for_rerun_has_clicks_and_boxes(cocalib, solved, clicks_file, boxes_file, tmp_path):
    pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
    out = tmp_path / "view.rrd"
    more = ("--clicks", clicks_file, "--boxes", boxes_file)
    answer = cocalib("show", solved.with_name("made.mcap"), "--calibration", solved, "--out", out, *more)
    assert answer.code == 0, answer.err
    assert answer.out.startswith(f"{out}: 65 frames, 320")
    assert out.stat().st_size > 10_000


def test_rerun_without_a_display_names_other_ways(cocalib, solved, monkeypatch):
    pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    answer = cocalib("show", solved.with_name("made.mcap"), "--calibration", solved)
    assert answer.code == 2
    assert "there is no display" in answer.err
    assert "--out FILE.rrd" in answer.err
