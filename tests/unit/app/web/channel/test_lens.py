"""The desk of the sheet Lens: what pages ask for and are told, and what the session becomes."""

import asyncio
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.camera import Camera, CameraCovariance
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.files import read_camera
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import BoardCorners, LeftOutImage
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView, ModelTrial
from calib_core.intrinsics.coverage import BoardSearch, SearchProgress
from calib_core.results import DataWarning
from cocalib.session.events import Undo
from cocalib.session.state import RecordingFacts
from cocalib.web.channel.lens import LensService, camera_table, lens_result, view_corners
from cocalib.web.channel.outbox import Outbox
from cocalib.web.messages.incoming import parse
from cocalib.web.messages.lens_messages import LensCalibrate, LensCancel, LensResult, LensState, LensUse
from cocalib.web.messages.outgoing import Outgoing, encode
from cocalib.workspace import Workspace
from tests.unit.app.web.channel.desk import session_without_solver, visited

FACTS = RecordingFacts("a.bag", np.arange(1, 5) * 10**9, 640, 480)
GIVEN = Camera("pinhole", 640, 480, np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]))
FOUND = Camera(
    "plumb_bob", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), np.array([0.1, 0, 0, 0, 0])
)
WANTED = LensCalibrate("checkerboard", "9x6", 25.0)


class Frames:
    """A recording with four frames that nobody looks at."""

    image_times = FACTS.image_times


@pytest.fixture
def workspace(tmp_path: Path) -> Iterator[Workspace]:
    with session_without_solver(tmp_path, FACTS, GIVEN) as opened:
        yield opened


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> None:
    def calibrate(images: object, board: Board, options: object, *, progress: Any, **_: object) -> Any:
        progress(SearchProgress(4, 4))
        lens = CalibratedLens(FOUND, board, board.corners_m, (), (), 0.1, 0.12)
        return BoardSearch(board, (640, 480), (), (), 4), lens

    monkeypatch.setattr("cocalib.intrinsics.job.calibrate_from", calibrate)


def at_desk(workspace: Workspace, visit: Callable[[LensService, list[Outgoing]], Any]) -> list[Outgoing]:
    """Run a visit at a desk; return what the pages were told."""
    return visited(lambda tell: LensService(workspace, Frames(), tell), visit)


async def until_done(told: list[Outgoing]) -> LensState:
    async with asyncio.timeout(20):
        while not any(isinstance(one, LensState) and one.stage in ("done", "failed") for one in told):
            await asyncio.sleep(0.005)
    return next(one for one in reversed(told) if isinstance(one, LensState))


@pytest.mark.usefixtures("found")
def test_a_lens_is_calibrated_shown_used_and_saved(workspace):
    async def visit(desk: LensService, told: list[Outgoing]) -> None:
        with pytest.raises(InputError, match="no calibrated lens"):
            await desk.use(LensUse())
        with pytest.raises(InputError, match="calibrate the lens first"):
            desk.camera_yaml(calibrated=True)
        assert "600" in desk.camera_yaml(calibrated=False)
        desk.calibrate(WANTED)
        state = await until_done(told)
        assert (state.result, state.in_use, state.chosen) == (1, False, False)
        assert state.intrinsics.about == "/camera_info", "nothing is used before the person says so"
        await desk.use(LensUse())
        desk.follow()
        now = told[-1]
        assert (now.in_use, now.chosen) == (True, True)
        np.testing.assert_allclose(read_camera(desk.camera_yaml(calibrated=True)).parameters, FOUND.parameters)
        late = Outbox()
        desk.greet(late)
        assert len(late) == 2, "a page that opens later is told the state and the result"

    told = at_desk(workspace, visit)
    assert [type(one) for one in told].index(LensResult) < len(told) - 1
    np.testing.assert_array_equal(workspace.camera.parameters, FOUND.parameters)
    np.testing.assert_allclose(workspace.camera_file.camera().parameters, FOUND.parameters)
    workspace.dispatch(Undo())
    assert workspace.camera is GIVEN


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (LensCalibrate("checkerboard", "nine", 25.0), "inner corners"),
        (LensCalibrate("checkerboard", "9x6", 0.0), "squares of 0 mm"),
        (LensCalibrate("charuco", "8x6", 30.0, 40.0), "a marker is smaller than its square"),
        (LensCalibrate("charuco", "8x6", 30.0, 20.0, "DICT_9"), "dictionary 'DICT_9'"),
        (LensCalibrate("aprilgrid", "6x6", 0.0, 10.0), "squares of 0 mm"),
        (LensCalibrate("aprilgrid", "6x6", 20.0, 0.0), "tag spacing 0: give the gap"),
    ],
)
def test_a_board_that_cannot_be_is_refused_in_words(workspace, wanted, said):
    async def visit(desk: LensService, told: list[Outgoing]) -> None:
        with pytest.raises(InputError, match=said):
            desk.calibrate(wanted)
        desk.cancel(LensCancel())
        assert told == []

    at_desk(workspace, visit)


def test_what_a_page_sends_becomes_a_request_and_what_it_is_told_is_json(workspace):
    command = parse('{"type":"lens_calibrate","kind":"checkerboard","size":"9x6","square_mm":25,"request":4}').command
    assert command == WANTED
    with pytest.raises(InputError, match="lens_calibrate"):
        parse('{"type":"lens_calibrate","kind":"circles","size":"9x6","square_mm":25}')
    outbox = Outbox()
    at_desk(workspace, lambda desk, _: asyncio.sleep(0, desk.greet(outbox)))
    assert len(outbox) == 1
    state = json.loads(encode(LensState(None, False, 4, "idle", 0, 0, 0, 0, "", "", "", False, None, 0, False)))
    assert state["type"] == "lens"


MATRIX = np.array([[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]])
NAMES = ("fx_px", "fy_px", "cx_px", "cy_px")
CAMERA = Camera("pinhole", 640, 480, MATRIX, covariance=CameraCovariance(NAMES, np.diag([0.25, 0.25, 0.01, 0.01])))
BOARD = Board("checkerboard", 4, 3, 0.1)


def lens_view(index: int, rms_px: float) -> LensView:
    pose = RigidTransform(np.eye(3), np.array([-0.15, -0.1, 1.0 + 0.2 * index]))
    pixels = CAMERA.project(pose @ BOARD.corners_m)
    found = BoardCorners(index, f"frame {index + 1}", None, (640, 480), np.arange(12), pixels)
    used = np.arange(12) != 5
    return LensView(found, pose, np.full((12, 2), 0.1), used, rms_px, rms_px + 0.01)


LENS = CalibratedLens(
    CAMERA,
    BOARD,
    BOARD.corners_m,
    tuple(lens_view(index, rms_px) for index, rms_px in ((3, 0.1), (7, 0.4), (9, 0.2))),
    (LeftOutImage(5, "frame 6", "blurred"),),
    0.25,
    float("nan"),
    (ModelTrial("pinhole", 0.25, 0.26), ModelTrial("plumb_bob", 0.25, 0.27, 0.01, 0.002)),
    "pinhole: the others predict no better",
    (DataWarning.reported("board-bent", "the board is bent", "fix it to glass"),),
)


def test_intrinsics_are_shown_with_what_is_known_of_them():
    table = camera_table(CAMERA, "camera.yaml")
    first = [(row.label, row.value, row.unit) for row in table.parameters[:2]]
    assert first == [("fx", "500.0 ± 0.5", "px"), ("fy", "500.0 ± 0.5", "px")]
    assert (table.known, table.field) == (True, "65.2° × 51.3°")
    unknown = camera_table(Camera("pinhole", 640, 480, MATRIX), "camera.yaml")
    assert (unknown.known, unknown.parameters[0].value) == (False, "500.000")


def test_a_lens_is_shown_with_its_views_what_was_left_out_and_why():
    shown = lens_result(4, LENS, "the board")
    assert [view.frame for view in shown.views] == [7, 9, 3], "the worst first"
    assert [(one.index, one.reason) for one in shown.left_out] == [(5, "blurred")]
    trials = [(trial.trial.model, trial.chosen, trial.note.split(" ±")[0]) for trial in shown.trials]
    assert trials == [("pinhole", True, ""), ("plumb_bob", False, "0.0100")]
    assert shown.choice.startswith("pinhole: ")
    assert str(shown.warnings[0].message) == "The board is bent."
    assert len(shown.residuals) == 33, "of corners that were used"
    assert shown.uncertainty.sigma_px.shape == (16, 24)
    assert '"sigma_px":[[' in encode(shown)
    assert '"held_out_rms_px":null' in encode(shown), "what is not known is no number"


@pytest.mark.parametrize(("frame", "count"), [(7, 12), (5, 0)])
def test_the_corners_of_a_frame_are_those_of_its_view(frame, count):
    corners = view_corners(LENS, frame)
    assert len(corners) == count
    assert [one[4] for one in corners] == [number != 5 for number in range(count)]
