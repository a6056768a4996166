"""A desk of the channel in a session that solves nothing."""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from calib_core.camera import Camera
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts
from cocalib.web.messages.outgoing import Outgoing
from cocalib.workspace import GivenIntrinsics, Workspace


class NoSolver:
    """Solves nothing."""

    def request(self, *_: object) -> None: ...
    def close(self) -> None: ...


@contextmanager
def session_without_solver(folder: Path, facts: RecordingFacts, camera: Camera) -> Iterator[Workspace]:
    """Open a session in a folder; it is closed with the `with` block."""
    file = open_session_file(folder / "s", facts)
    made = Workspace(facts, file.restored, file, NoSolver(), None, GivenIntrinsics(camera, None, "/camera_info"))
    yield made
    made.close()


def visited(make: Callable[[Callable[..., None]], Any], visit: Callable[[Any, list[Any]], Any]) -> list[Outgoing]:
    """Run a visit at the desk that is made with the function that tells its pages; return what they were told."""
    told: list[Outgoing] = []

    async def run() -> None:
        desk = make(lambda message, _kind: told.append(message))
        desk.start()
        try:
            await visit(desk, told)
        finally:
            await desk.close()

    asyncio.run(run())
    return told
