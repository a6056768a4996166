"""The sample recording, opened once for each file of tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from calib_core.interchange.own.clicks_json import read_clicks
from calib_core.measurements import ReflectorClick
from calib_core.recordings import Recording, open_recording


@pytest.fixture(scope="module")
def recording(project_root: Path) -> Iterator[Recording]:
    sample = project_root / "sample_data" / "rooftop"
    with open_recording([sample / "camera.bag", sample / "radar.bag"]) as opened:
        yield opened


@pytest.fixture(scope="module")
def clicks(project_root: Path) -> tuple[ReflectorClick, ...]:
    return read_clicks((project_root / "sample_data" / "rooftop" / "clicks.json").read_text(encoding="utf-8"))


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the program a folder of its own for its state; return it."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "cocalib"
