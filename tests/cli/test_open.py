"""`cocalib open` on recordings that lack a sensor: what is served, what is refused, and what is said."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from calib_core.recordings import Recording
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
from cocalib.cli import run
from cocalib.workspace import Workspace
from tests.image_recording import grey_frames


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Workspace]:
    """Serve nothing; collect what would have been served."""
    workspaces: list[Workspace] = []

    def serve(_service: object, workspace: Workspace, _recording: Recording) -> None:
        workspaces.append(workspace)

    monkeypatch.setattr("cocalib.web.port.serving.Service.serve", serve)
    monkeypatch.setattr("cocalib.opening.serving._SOON_S", 3600.0)  # on a busy machine the page would appear before
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return workspaces


@pytest.fixture
def copied(project_root: Path, tmp_path: Path) -> Callable[[str], Path]:
    def copy(name: str) -> Path:
        path = tmp_path / name
        path.write_bytes((project_root / "sample_data" / "rooftop" / name).read_bytes())
        return path

    return copy


def test_a_radar_alone_is_opened_without_intrinsics_and_stores_nothing(served, copied, capsys):
    radar = copied("radar.bag")
    assert run(["open", str(radar), "--no-browser"]) == 0
    assert capsys.readouterr().out.startswith("radar.bag: no images: ")
    assert not served[0].facts.has_images
    assert [path.name for path in radar.parent.iterdir() if path.name != "state"] == ["radar.bag"]


@pytest.mark.parametrize("flag", ["--camera", "--calibration", "--clicks", None])
def test_files_that_need_a_camera_are_refused_without_one_and_a_camera_without_a_radar(flag, served, copied, cocalib):
    recording, clicks = copied("radar.bag" if flag else "camera.bag"), copied("clicks.json")
    answer = cocalib("open", recording, "--no-browser", *((flag, clicks) if flag else ()))
    assert answer.code == 2
    words = "clicks.json cannot be used; give the camera's recording as well" if flag else "no readable radar"
    assert words in answer.err
    assert served == []


def test_intrinsics_next_to_the_recording_are_named(tmp_path, capsys):
    options = SimulationOptions(placements=2, dwell_s=4.0, width_px=128, height_px=80, camera_rate_hz=2.0)
    with grey_frames():
        write_recording(simulate(options), tmp_path, ("csv",))
    clicks = tmp_path / "clicks.json"
    assert run(["solve", str(tmp_path / "recording_csv"), "--clicks", str(clicks), "--confirm-assumptions"]) == 2
    assert f"such as --camera {tmp_path / 'recording_csv' / 'camera.yaml'}" in capsys.readouterr().err


@pytest.mark.slow
def test_each_of_two_cameras_in_one_recording_is_opened_by_its_topic(served, tmp_path, cocalib):
    size = {"placements": 4, "dwell_s": 4.0, "width_px": 128, "height_px": 80, "camera_rate_hz": 1.0}
    with grey_frames():
        write_recording(simulate(SimulationOptions(**size, other_camera=True)), tmp_path)
    for camera, name in (("camera", "clicks.json"), ("camera_2", "clicks_2.json")):
        given = ("--image-topic", f"/{camera}/image_raw/compressed", "--clicks", tmp_path / name, "--no-browser")
        session = ("--session", tmp_path / camera)
        assert cocalib("open", tmp_path / "radar.bag", tmp_path / "camera.bag", *given, *session).code == 0
        expected = json.loads((tmp_path / name).read_text())["clicks"]
        assert len(served.pop().session.clicks) == len(expected) == 4


def test_clicks_that_nobody_confirmed_are_opened_with_a_note(served, made, clicks_file, capsys):
    document = json.loads(clicks_file.read_text())
    clicks_file.write_text(json.dumps({**document, "unconfirmed": {"clicks": ["c1", "c4"], "confidence": 0.97}}))
    assert run(["open", str(made()), "--clicks", str(clicks_file), "--no-browser"]) == 0
    assert f"note: {clicks_file}: 2 of these clicks" in capsys.readouterr().err
    assert len(served[0].session.clicks) == len(document["clicks"])
