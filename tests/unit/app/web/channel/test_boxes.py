"""The desk of the sheet Evaluate: boxes of a file or around what moves, and what pages are told of them."""

import asyncio
import json
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from calib_core.boxes import boxes_text
from calib_core.errors import InputError
from calib_core.measurements import Box, Boxes, FrameBoxes, TimeNs
from cocalib.view.acc_panel import AccPanel
from cocalib.web.channel.boxes import BoxService
from cocalib.web.messages.incoming import BoxesWanted, MovingBoxesWanted
from cocalib.web.messages.outgoing import Outgoing, Progress
from cocalib.workspace import Workspace, open_workspace
from tests.street_recording import StreetRecording, reference_calibration

PERSON = Box(10.0, 20.0, 60.0, 200.0, "person")


@pytest.fixture(scope="module")
def walk() -> StreetRecording:
    return StreetRecording()


@pytest.fixture
def workspace(walk: StreetRecording, tmp_path: Path) -> Iterator[Workspace]:
    opened = open_workspace(
        walk, camera=walk.camera(), session_folder=tmp_path / "s", name="street", reference=reference_calibration()
    )
    yield opened
    opened.close()


@pytest.fixture
def threads() -> Iterator[Executor]:
    with ThreadPoolExecutor(2) as made:
        yield made


def sent(boxes: Boxes, name: str = "boxes.json") -> BoxesWanted:
    return BoxesWanted(name, boxes_text(boxes).encode())


def at_desk(
    workspace: Workspace, walk: StreetRecording, threads: Executor, *commands: BoxesWanted | MovingBoxesWanted
) -> list[Outgoing]:
    """Send commands one after the other, each when the one before has been answered; return what pages were told."""
    told: list[Outgoing] = []

    async def run() -> None:
        desk = BoxService(workspace, walk, threads, lambda message, _kind: told.append(message))
        desk.follow()
        for command in commands:
            before = len(told)
            if isinstance(command, BoxesWanted):
                await desk.take(command)
            else:
                desk.find(command)
            async with asyncio.timeout(40):
                while not any(is_answer(message) for message in told[before:]):
                    await asyncio.sleep(0.005)
        desk.follow()
        await desk.close()

    asyncio.run(run())
    return told


def is_answer(message: Outgoing) -> bool:
    return isinstance(message, AccPanel) and not message.busy


def panels(told: Sequence[Outgoing]) -> list[AccPanel]:
    return [message for message in told if isinstance(message, AccPanel)]


def test_boxes_of_a_file_are_judged_once_and_named(workspace, walk, threads):
    told = panels(at_desk(workspace, walk, threads, sent(walk.street.boxes)))
    assert [panel.busy for panel in told] == [True, False]
    assert (told[-1].source, told[-1].boxes, told[-1].frames) == ("boxes.json", 40, 40)
    assert [figure.key for figure in told[-1].figures] == ["acc", "acc_frames", "acc_targets", "acc_chance"]
    assert told[-1].problem == ""


def test_other_boxes_replace_the_first_and_what_stands_meanwhile_is_marked(workspace, walk, threads):
    half = Boxes(walk.street.boxes.frames[:20], "half.json")
    told = panels(at_desk(workspace, walk, threads, sent(walk.street.boxes), sent(half, "half.json")))
    assert [(panel.source, panel.frames, panel.busy) for panel in told[1:]] == [
        ("boxes.json", 40, False),
        ("boxes.json", 40, True),
        ("half.json", 20, False),
    ]


@pytest.mark.slow
def test_what_moves_is_found_with_its_progress(workspace, walk, threads):
    told = at_desk(workspace, walk, threads, MovingBoxesWanted())
    progress = [message for message in told if isinstance(message, Progress)]
    assert progress
    assert progress[-1].done == progress[-1].total
    assert panels(told)[-1].boxes > 20
    assert panels(told)[-1].figures


@pytest.mark.slow
def test_why_nothing_moves_is_told(workspace, walk, threads, monkeypatch):
    still = walk.image(0)
    monkeypatch.setattr(walk, "image", lambda _index: still)
    [*_, last] = panels(at_desk(workspace, walk, threads, MovingBoxesWanted()))
    assert (bool(last.problem), last.figures, last.busy) == (True, (), False)


def test_without_a_calibration_there_are_boxes_and_no_figures(walk, tmp_path, threads):
    with_nothing = open_workspace(walk, camera=walk.camera(), session_folder=tmp_path / "s", name="street")
    [*_, last] = panels(at_desk(with_nothing, walk, threads, sent(walk.street.boxes)))
    with_nothing.close()
    assert (last.source, last.figures, bool(last.problem)) == ("boxes.json", (), True)


ELSEWHERE = Boxes((FrameBoxes(TimeNs(1_500_000_000_000_000_000), (PERSON,)),), "boxes.json")
OTHER_FILES = (
    boxes_text(ELSEWHERE).encode(),
    b"%PDF-1.4",
    b"",
    b"PK\x03\x04 cut off",
    json.dumps({"schema": "cocalib/clicks-1"}).encode(),
)


@pytest.mark.parametrize("data", OTHER_FILES)
def test_boxes_of_another_recording_and_other_files_are_refused_and_nothing_is_told(data, workspace, walk, threads):
    with pytest.raises(InputError):
        at_desk(workspace, walk, threads, BoxesWanted("../boxes.json", data))


def test_a_page_that_opens_later_gets_the_figures(workspace, walk, threads):
    told: list[Any] = []

    class Page:
        def put(self, text: str, *, kind: str) -> None:
            told.append((kind, json.loads(text)))

    BoxService(workspace, walk, threads, lambda *_: None).greet(Page())
    [(kind, panel)] = told
    assert (kind, panel["type"], panel["source"], panel["figures"]) == ("acc", "acc", "", [])
