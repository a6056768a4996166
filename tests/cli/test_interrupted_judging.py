"""Ctrl+C while a recording is judged, reported or drawn: exit code 130, one line at most, and no half file."""

from typing import NoReturn

import pytest


def interrupted(*_: object, **__: object) -> NoReturn:
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    "command",
    [
        "evaluate",
        "report",
        "video",
        "auto",
        *(pytest.param(one, marks=pytest.mark.slow) for one in ("compared", "rrd", "propose")),
    ],
)
def test_an_interrupt_leaves_no_file_and_no_traceback(cocalib, solved, clicks_file, tmp_path, monkeypatch, command):
    recording, clicks = solved.with_name("made.mcap"), ("--clicks", clicks_file)
    other = tmp_path / "other.json"
    other.write_bytes(solved.read_bytes())
    before = sorted(tmp_path.rglob("*"))
    for place in ("cocalib.evaluation.evaluating.pair_clicks", "cocalib.proposing.dwell_views"):
        monkeypatch.setattr(place, interrupted)
    arguments: dict[str, tuple[object, ...]] = {
        "evaluate": ("evaluate", solved, recording, *clicks),
        "compared": ("check", solved, "--against", other, "--recording", recording, *clicks),
        "report": ("evaluate", solved, recording, "--report", tmp_path / "made.html", *clicks),
        "rrd": ("show", recording, "--calibration", solved, "--out", tmp_path / "made.rrd", *clicks),
        "video": ("show", recording, "--calibration", solved, "--out", tmp_path / "made.mp4", *clicks),
        "propose": ("solve", "--propose", recording, "--out", tmp_path / "made.json"),
        "auto": ("solve", "--auto", recording, "--out", tmp_path / "made.json"),
    }
    answer = cocalib(*arguments[command])

    assert answer.code == 130
    assert "Traceback" not in answer.out + answer.err
    assert sorted(tmp_path.rglob("*")) == before
