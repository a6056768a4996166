"""Ctrl+C while a recording is judged, reported or drawn: exit code 130, one line at most, and no half file."""

from typing import NoReturn

import pytest


def interrupted(*_: object, **__: object) -> NoReturn:
    raise KeyboardInterrupt


@pytest.mark.parametrize("command", ["evaluate", "compared", "report", "rrd", "video"])
def test_an_interrupt_leaves_no_file_and_no_traceback(cocalib, made, clicks_file, tmp_path, monkeypatch, command):
    recording, pose = made(), tmp_path / "calibration.json"
    assert cocalib("solve", recording, "--clicks", clicks_file, "--out", pose).code == 0
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr("cocalib.evaluation.evaluating.pair_clicks", interrupted)
    clicks = ("--clicks", clicks_file)
    arguments: dict[str, tuple[object, ...]] = {
        "evaluate": ("evaluate", pose, recording),
        "compared": ("check", pose, "--against", pose, "--recording", recording),
        "report": ("evaluate", pose, recording, "--report", tmp_path / "made.html"),
        "rrd": ("show", recording, "--calibration", pose, "--out", tmp_path / "made.rrd"),
        "video": ("show", recording, "--calibration", pose, "--out", tmp_path / "made.mp4"),
    }
    answer = cocalib(*arguments[command], *clicks)

    assert answer.code == 130
    assert "Traceback" not in answer.out + answer.err
    assert sorted(tmp_path.rglob("*")) == before
