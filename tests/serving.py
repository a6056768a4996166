"""Serve a session of a recording in this process."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from calib_core.camera import Camera
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import Reference, Workspace, open_workspace

OWN_PORT = 21_000 + 100 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
"""The first port to try for a page that opens sooner at an address whose files the browser has."""


@contextmanager
def serving(
    recording: Any,
    folder: Path,
    *,
    camera: Camera | None = None,
    name: str = "recording",
    reference: Reference | None = None,
    **options: Any,
) -> Iterator[tuple[RunningServer, Workspace]]:
    """Open the session and serve it on any port; both end with the `with` block.

    Args:
        recording: an open one, or what looks like it.
        folder: of the session.
        camera: the intrinsics.
        name: of the recording.
        reference: a calibration to show.
        options: of the server.
    """
    workspace = open_workspace(recording, camera=camera, session_folder=folder, name=name, reference=reference)
    running = start(workspace, recording, ServerOptions(**{"port": 0, "no_browser": True, **options}))
    try:
        yield running, workspace
    finally:
        running.close()
        workspace.close()
