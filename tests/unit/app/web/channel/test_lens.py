"""The desk of the tab Lens: what pages ask for and are told, and what the session becomes."""

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import read_camera
from calib_core.intrinsics import Board, BoardSearch, CalibratedLens, SearchProgress
from cocalib.session import RecordingFacts
from cocalib.session.file import open_session_file
from cocalib.web.channel.lens import LensDesk
from cocalib.web.channel.outbox import Outbox
from cocalib.web.messages import LensCalibrate, LensCancel, LensResult, LensState, LensUse, Outgoing, encode, parse
from cocalib.workspace import GivenIntrinsics, Workspace

FACTS = RecordingFacts("a.bag", np.arange(1, 5) * 10**9, 640, 480)
GIVEN = Camera("pinhole", 640, 480, np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]))
FOUND = Camera(
    "plumb_bob", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), np.array([0.1, 0, 0, 0, 0])
)
WANTED = LensCalibrate("checkerboard", "9x6", 25.0)


class Frames:
    """A recording with four frames that nobody looks at."""

    image_times = FACTS.image_times


class NoSolver:
    """Solves nothing; keeps the camera that it was to solve with."""

    def request(self, *_: object) -> None: ...
    def close(self) -> None: ...


@pytest.fixture
def workspace(tmp_path: Path) -> Any:
    file = open_session_file(tmp_path / "s", FACTS)
    made = Workspace(FACTS, file.restored, file, NoSolver(), None, GivenIntrinsics(GIVEN, None, "/camera_info"))
    yield made
    made.close()


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> None:
    def calibrate(pictures: object, board: Board, options: object, *, progress: Any, **_: object) -> Any:
        progress(SearchProgress(4, 4))
        return BoardSearch(board, (640, 480), (), (), 4), CalibratedLens(
            FOUND, board, board.corners_m, (), (), 0.1, 0.12
        )

    monkeypatch.setattr("cocalib.intrinsics.job.calibrate_from", calibrate)


def at_desk(workspace: Workspace, visit: Callable[[LensDesk, list[Outgoing]], Any]) -> list[Outgoing]:
    """Run a visit at a desk; return what the pages were told."""
    told: list[Outgoing] = []

    async def run() -> None:
        desk = LensDesk(workspace, Frames(), lambda message, _kind: told.append(message))  # type: ignore[arg-type]
        desk.start()
        try:
            await visit(desk, told)
        finally:
            await desk.close()

    asyncio.run(run())
    return told


async def until_done(told: list[Outgoing]) -> LensState:
    async with asyncio.timeout(20):
        while not any(isinstance(one, LensState) and one.stage in ("done", "failed") for one in told):
            await asyncio.sleep(0.005)
    return next(one for one in reversed(told) if isinstance(one, LensState))


@pytest.mark.usefixtures("found")
def test_a_lens_is_calibrated_shown_used_and_saved(workspace: Workspace) -> None:
    async def visit(desk: LensDesk, told: list[Outgoing]) -> None:
        with pytest.raises(InputError, match="no calibrated lens"):
            await desk.obey(LensUse())
        with pytest.raises(InputError, match="calibrate the lens first"):
            desk.camera_yaml(calibrated=True)
        assert "600" in desk.camera_yaml(calibrated=False)
        await desk.obey(WANTED)
        state = await until_done(told)
        assert (state.result, state.in_use, state.chosen) == (1, False, False)
        assert state.intrinsics is not None
        assert state.intrinsics.about == "/camera_info", "nothing is used before the person says so"
        await desk.obey(LensUse())
        desk.follow()
        now = told[-1]
        assert isinstance(now, LensState)
        assert (now.in_use, now.chosen) == (True, True)
        np.testing.assert_allclose(read_camera(desk.camera_yaml(calibrated=True)).parameters, FOUND.parameters)
        late = Outbox()
        desk.greet(late)
        assert len(late) == 2, "a page that opens later is told the state and the result"

    told = at_desk(workspace, visit)
    assert [type(one) for one in told].index(LensResult) < len(told) - 1
    assert workspace.camera is not None
    np.testing.assert_array_equal(workspace.camera.parameters, FOUND.parameters)
    assert workspace.camera_file is not None
    np.testing.assert_allclose(workspace.camera_file.camera().parameters, FOUND.parameters)
    workspace.undo()
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
def test_a_board_that_cannot_be_is_refused_in_words(workspace: Workspace, wanted: LensCalibrate, said: str) -> None:
    async def visit(desk: LensDesk, told: list[Outgoing]) -> None:
        with pytest.raises(InputError, match=said):
            await desk.obey(wanted)
        await desk.obey(LensCancel())
        assert told == []

    at_desk(workspace, visit)


def test_what_a_page_sends_becomes_a_request_and_what_it_is_told_is_json(workspace: Workspace) -> None:
    command = parse('{"type":"lens_calibrate","kind":"checkerboard","size":"9x6","square_mm":25,"request":4}').command
    assert command == WANTED
    with pytest.raises(InputError, match="lens_calibrate"):
        parse('{"type":"lens_calibrate","kind":"circles","size":"9x6","square_mm":25}')

    async def visit(desk: LensDesk, told: list[Outgoing]) -> None:
        outbox = Outbox()
        desk.greet(outbox)
        assert len(outbox) == 1

    at_desk(workspace, visit)
    state = json.loads(encode(LensState(None, False, 4, "idle", 0, 0, 0, 0, "", "", "", False, None, 0, False)))
    assert state["type"] == "lens"
