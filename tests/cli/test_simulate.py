"""`cocalib simulate`: presets fill the options that are not typed."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Cocalib = Callable[..., Any]
TINY = (
    *("--placements", 3, "--dwell-s", 3.5, "--radar-rate-hz", 5, "--camera-rate-hz", 3, "--person", False),
    *("--width-px", 64, "--height-px", 64, "--clutter", "none"),
)


def _spans(folder: Path) -> list[tuple[float, float]]:
    placements = json.loads((folder / "truth.json").read_text())["placements"]
    return [(p["start"]["sec"], p["end"]["sec"]) for p in placements]


def test_a_preset_fills_what_is_not_typed_and_what_is_typed_wins(cocalib: Cocalib, tmp_path: Path) -> None:
    both, one = tmp_path / "both", tmp_path / "one"
    assert cocalib("simulate", "--out", both, "--preset", "two-reflectors", *TINY).code == 0
    assert cocalib("simulate", "--out", one, *TINY, "--preset", "two-reflectors", "--reflectors", 1).code == 0
    assert _spans(both)[1][0] < _spans(both)[0][1]
    assert _spans(one)[1][0] >= _spans(one)[0][1]
    assert {path.name for path in both.iterdir()} == {"radar.bag", "camera.bag", "truth.json", "clicks.json"}


def test_groups_of_options_have_flags_of_their_own(cocalib: Cocalib, tmp_path: Path) -> None:
    out = tmp_path / "low"
    typed = ("--clicking.low-px", 9, "--defects.azimuth-scale", 1.03, "--surroundings.companion", True)
    assert cocalib("simulate", "--out", out, *TINY, *typed).code == 0
    truth, clicks = (json.loads((out / name).read_text()) for name in ("truth.json", "clicks.json"))
    pixels = np.array([p["pixel_px"] for p in truth["placements"]])
    off_px = np.array([c["pixel_px"] for c in clicks["clicks"]]) - pixels
    assert np.abs(off_px[:, 1] - 9.0).max() < 4.0
    assert [entry["faults"] for entry in truth["clicks"]] == [["low"]] * 3
