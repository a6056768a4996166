"""Presets: each can be simulated, differs from the default, and gives way to what is asked for."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from calib_core.synthetic import PRESETS, PresetName, SimulationOptions, simulate

SMALL = {"placements": 4, "dwell_s": 3.5, "radar_rate_hz": 2.0, "camera_rate_hz": 4.0}


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_is_a_recording_of_its_own(name: PresetName) -> None:
    options = PRESETS[name]
    assert (options == SimulationOptions()) == (name == "default")
    small = replace(options, **SMALL)  # type: ignore[arg-type]
    recording = simulate(small)
    assert len(recording.placements) == small.standing_places
    assert len(recording.clicks) >= 4
    assert len(next(recording.scans())) > 0


def test_the_page_describes_every_preset_and_no_other(project_root: Path) -> None:
    page = (project_root / "docs" / "simulation.md").read_text()
    assert re.findall(r"^\| `([a-z0-9-]+)` \|", page, flags=re.MULTILINE) == list(PRESETS)
