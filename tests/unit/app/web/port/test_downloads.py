"""Downloads of a calibration: what the port returns and what it refuses."""

import asyncio
import base64
import dataclasses
import json
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from calib_core.interchange.calibration_file import choose_check_point
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
from calib_core.results import Calibration
from cocalib.session.applying import History
from cocalib.session.file.session_file import Restored
from cocalib.session.state import Session
from cocalib.web.port.routes import Reply, Routes
from tests.image_recording import ImageRecording, grey_images

CLICKS = tuple(ReflectorClick(TimeNs(index), f"c{index}", 10.0, 10.0) for index in range(5))


def workspace_of(session: Session, folder: Path) -> Any:
    return SimpleNamespace(
        session=session,
        facts=SimpleNamespace(name="drive 7.mcap"),
        camera_file=None,
        restored=Restored(folder, History()),
        subscribe=lambda _: lambda: None,
    )


@pytest.fixture
def ask(project_root: Path, tmp_path: Path) -> Callable[..., Reply]:
    def answer(session: Session, address: str, recording: ImageRecording | None = None) -> Reply:
        routes, hub = Routes(project_root / "static"), SimpleNamespace(survey=None)
        routes.admit(workspace_of(session, tmp_path), recording or ImageRecording(grey_images(1)), hub)
        reply = asyncio.run(routes.answer(address))
        routes.withdraw()
        return reply

    return answer


def test_the_documentation_is_served_with_its_search_and_says_where_it_comes_from(project_root, tmp_path):
    (tmp_path / "_static").mkdir()
    (tmp_path / "index.html").write_text("<title>docs</title>")
    (tmp_path / "_static" / "search.js").write_text("1;")
    (tmp_path / "objects.inv").write_text("not for browsers")

    def answer(address: str, site: Path | None = tmp_path) -> Reply:
        return asyncio.run(Routes(project_root / "static", site).answer(address))

    page = answer("/docs/")
    assert page.body == b"<title>docs</title>"
    assert "form-action 'self'" in dict(page.headers)["Content-Security-Policy"]
    assert b"<title>cocalib" in answer("/").body
    assert answer("/docs/_static/search.js").status == 200
    for outside in ("/docs/objects.inv", "/docs/../index.html", "/docs/%2e%2e/secret"):
        assert answer(outside).status == 404
    missing = answer("/docs/", None)
    assert (missing.status, b"make docs" in missing.body) == (404, True)


def test_a_calibration_of_an_older_revision_cannot_be_downloaded(file, ask):
    solved = Session(CLICKS, revision=7, outcome=file.calibration, outcome_revision=7)
    changed = dataclasses.replace(solved, revision=8)
    for path in ("/api/calibration.json", "/api/export/tf2"):
        assert ask(solved, path).status == 200
        assert ask(changed, path).status == 409
        assert b"still being solved" in ask(changed, path).body
    assert "still being solved" in json.loads(ask(changed, "/api/preview/tf2").body)["reason"]


def test_a_missing_calibration_is_explained(ask):
    refused = Unsolvable.reported("mirrored", "the axes are mirrored", "swap left and right")
    solved = Session(CLICKS, revision=3, outcome=refused, outcome_revision=3)
    assert ask(solved, "/api/export/urdf").body == b"The axes are mirrored. Swap left and right.\n"
    for path in ("/api/calibration.json", "/api/export/urdf"):
        assert ask(Session(), path).status == 409
        assert b"four placements" in ask(Session(), path).body


def test_rerun_is_offered_as_a_command_where_it_is_installed_and_has_a_window(file, ask, monkeypatch):
    solved = Session(CLICKS, outcome=file.calibration, outcome_revision=0)
    for installed, display in ((True, ":1"), (True, ""), (False, "")):
        monkeypatch.setattr(
            "cocalib.rerun.viewer.find_spec", lambda _name, found=installed: object() if found else None
        )
        monkeypatch.setenv("DISPLAY", display)
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        offer = json.loads(ask(solved, "/api/rerun.json").body)
        assert (offer["is_installed"], offer["opens_window"]) == (installed, bool(display))
        assert offer["command"].startswith("cocalib show ")
    assert ask(Session(), "/api/rerun.json").status == 409
    assert ask(Session(), "/api/view.rrd").status == 409


def test_the_file_for_rerun_is_written_in_the_background_and_asked_for_until_it_is_there(
    file, project_root, monkeypatch, tmp_path
):
    goes_on, halfway = threading.Event(), threading.Event()

    def write(_view: object, path: Path, *, progress: Callable[[int, int], None]) -> None:
        progress(3, 7)
        halfway.set()
        assert goes_on.wait(30)
        path.write_bytes(b"RRF2")

    monkeypatch.setattr("cocalib.rerun.write_view", write)
    monkeypatch.setattr("cocalib.recorded_view.recorded_view", lambda *_given: None)
    session = Session(CLICKS, outcome=file.calibration, outcome_revision=0)
    routes = Routes(project_root / "static")
    hub: Any = SimpleNamespace(survey=None)
    routes.admit(workspace_of(session, tmp_path), ImageRecording(grey_images(1)), hub)

    def ask_for_it() -> Reply:
        return asyncio.run(routes.answer("/api/view.rrd"))

    assert ask_for_it().status == 202
    assert halfway.wait(30)
    assert b"3 of 7" in ask_for_it().body
    goes_on.set()
    while (reply := ask_for_it()).status == 202:
        pass
    assert reply.body == b"RRF2"
    routes.withdraw()


@pytest.mark.parametrize("name", [form.name for form in FORMATS])
def test_a_preview_reads_its_own_text_back(file, ask, name):
    solved = Session(CLICKS, outcome=file.calibration, outcome_revision=0)
    query = "?rectified=1" if format_named(name).is_for_rectified else ""
    preview = json.loads(ask(solved, f"/api/preview/{name}{query}").body)
    assert preview["check_is_good"]
    assert preview["file_name"].startswith("drive_7_")
    assert preview["numbers"]
    assert preview["size_bytes"] > 0


def test_a_format_without_a_pose_is_previewed_without_reading_it_back(file, ask):
    solved = Session(CLICKS, outcome=file.calibration, outcome_revision=0)
    preview = json.loads(ask(solved, "/api/preview/camera-info").body)
    assert preview["check"].startswith("Not read back: ")
    assert preview["file_name"] == "drive_7_camera_info.yaml"
    assert any("without the pose" in note for note in preview["notes"])
    assert b"camera_matrix:" in ask(solved, "/api/export/camera-info").body


def test_the_address_may_pose_the_radar_in_the_kit(file, ask):
    solved = Session(CLICKS, outcome=file.calibration, outcome_revision=0)
    assert b"x: 1.5" in ask(solved, "/api/export/autoware?parent_from_radar=1.5,0,0.25,0,0,0,1").body
    for query, words in (("0,0,0,0,0,0,9", b"length 9"), ("nan,0,0,0,0,0,1", b"finite"), ("1,2", b"seven")):
        refused = ask(solved, f"/api/export/autoware?parent_from_radar={query}")
        assert refused.status == 409
        assert words in refused.body
    assert ask(solved, "/api/export/tf2?parent_from_radar=0,0,0,0,0,0,1").status == 409


def test_a_refused_field_is_named_and_a_name_in_the_address_is_written(file, ask):
    solved = Session(CLICKS, outcome=file.calibration, outcome_revision=0)
    assert b"--frame-id front " in ask(solved, "/api/export/tf2?radar_frame=front").body
    assert ask(solved, "/api/export/tf2?radar_frame=").status == 409
    refused = json.loads(ask(solved, "/api/preview/tf2?radar_frame=").body)
    assert refused["field"] == "frames"
    assert "radar frame" in refused["reason"]
    assert json.loads(ask(Session(), "/api/preview/tf2").body)["field"] is None


def test_the_cut_out_of_a_mark_is_centred_on_it_and_small_however_long_the_residual(ask):
    image = np.full((400, 500, 3), 20, dtype=np.uint8)
    image[199:202, 299:302] = 255
    recording = ImageRecording([image])
    stamp = int(recording.image_times[0])
    for side in (96, 300):
        [cut_out] = json.loads(ask(Session(), f"/api/crops.json?{stamp},300.00,200.00,{side}", recording).body)
        made = cv2.imdecode(np.frombuffer(base64.b64decode(cut_out), dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
        assert made.shape == (96, 96)
        brightest = np.unravel_index(int(np.argmax(made)), made.shape)
        np.testing.assert_allclose(brightest, 47.5, atol=2)
    reply = ask(Session(), f"/api/crops.json?{stamp},-5.0,399.9,96;{stamp + 1},3,4,96", recording)
    assert [made is None for made in json.loads(reply.body)] == [False, True]
    for refused in (f"{stamp},3,4,9999", "", ";".join([f"{stamp},3,4,96"] * 13)):
        assert ask(Session(), f"/api/crops.json?{refused}", recording).status == 400


def test_the_image_of_the_check_point_is_the_frame_in_which_it_was_clicked(file, ask):
    recording = ImageRecording([np.full((60, 80, 3), shade, dtype=np.uint8) for shade in (10, 90, 200)])
    nearest = pair_of_check_point(file.calibration)

    def ask_at(stamp: int) -> Reply:
        pairs = tuple(
            dataclasses.replace(pair, image_time=TimeNs(stamp) if pair.id == nearest else None)
            for pair in file.calibration.pairs
        )
        session = Session(CLICKS, outcome=dataclasses.replace(file.calibration, pairs=pairs), outcome_revision=0)
        return ask(session, f"/api/check_point_image?{nearest}", recording)

    for index, stamp in enumerate(recording.image_times.tolist()):
        shown = ask_at(stamp)
        assert shown.status == 200
        assert dict(shown.headers)["Content-Type"] == "image/png"
        assert shown.body == recording.image_bytes(index).data
    assert ask_at(int(recording.image_times[-1]) + 1).status == 404
    assert ask_at(int(recording.image_times[0]) + 1).status == 404


def pair_of_check_point(calibration: Calibration) -> str:
    check = choose_check_point(calibration)
    assert check is not None
    positions = calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in calibration.pairs]))
    return calibration.pairs[int(np.linalg.norm(positions - check.radar_m, axis=1).argmin())].id
