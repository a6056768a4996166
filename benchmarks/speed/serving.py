"""The server without a browser: how soon `cocalib demo` prints its link, and the memory it takes while 1080p is played.

Alone: `python -m benchmarks.speed.serving`.
"""

import http.client
import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil
from websockets.sync.client import ClientConnection, connect

from benchmarks.speed.recordings import write_bag
from benchmarks.speed.rows import Row, Table, section
from benchmarks.speed.starting import as_installed

__all__ = ["measure_serving"]

_STARTS = 5
_FRAMES = 1200
_AIM_MB = 150
_CAMERA = """\
image_width: 1920
image_height: 1080
camera_name: camera
camera_matrix: {rows: 3, cols: 3, data: [1200.0, 0.0, 960.0, 0.0, 1200.0, 540.0, 0.0, 0.0, 1.0]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.0, 0.0, 0.0, 0.0, 0.0]}
"""


@dataclass(frozen=True, slots=True)
class _Serving:
    """A server whose link has been printed.

    Attributes:
        process: the server.
        url: its link.
        link_s: wall-clock time from its start to the link.
        link_cpu_s: processor time until then.
    """

    process: psutil.Process
    url: str
    link_s: float
    link_cpu_s: float


def measure_serving(scratch: Path) -> Table:
    """Measure the demo's start and the memory while frames are sent as fast as they are taken.

    Args:
        scratch: folder for a recording of 0.4 GB and for sessions.
    """
    starts = []
    for number in range(_STARTS + 1):
        with _served(["demo"], scratch / f"demo-{number}") as serving:
            starts.append(serving)
    link_s = min(start.link_s for start in starts[1:])  # the first one wrote the bytecode
    link_cpu_s = min(start.link_cpu_s for start in starts[1:])
    numpy_s = min(_import_s("numpy") for _ in range(_STARTS))
    camera = scratch / "camera.yaml"
    camera.write_text(_CAMERA, encoding="utf-8")
    figure = f"{link_s * 1000:.0f} ms, {link_cpu_s * 1000:.0f} ms of the processor"
    rows = [Row("`cocalib demo` to its link", figure, f"{link_s / numpy_s:.1f} x NumPy's import")]
    for name, compression in (("uncompressed", ""), ("lz4", "lz4")):
        bag = write_bag(scratch / f"{name}.bag", _FRAMES, compression=compression)
        with _served(["open", str(bag), "--camera", str(camera)], scratch / f"{name}-session") as serving:
            before_mb, after_mb = _played(serving)
        bag.unlink()
        rows.append(
            Row(
                f"server memory, {name} bag: opened, played",
                f"{before_mb:.0f} and {after_mb:.0f} MB",
                f"{after_mb / before_mb:.2f} x",
                f"under {_AIM_MB} MB",
                after_mb < _AIM_MB,
            )
        )
    return Table(
        "The server alone",
        f"The link: the least of {_STARTS} starts. Memory: resident, of the server's process, before and after {_FRAMES} frames "
        "of 1920 x 1080 with their overlays, each sent once the one before has arrived; without the 3D view and without clicks. "
        "Alone: `python -m benchmarks.speed.serving`.",
        tuple(rows),
    )


@contextmanager
def _served(arguments: list[str], session: Path) -> Iterator[_Serving]:
    environment = as_installed(session.with_name("bytecode")) | {"PYTHONUNBUFFERED": "1"}
    started = time.perf_counter()
    server = subprocess.Popen(
        [sys.executable, "-m", "cocalib", *arguments, "--session", str(session), "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=environment,
    )
    try:
        assert server.stdout is not None
        url = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+", line)))
        process = psutil.Process(server.pid)
        used = process.cpu_times()
        yield _Serving(process, url, time.perf_counter() - started, used.user + used.system)
    finally:
        server.terminate()
        server.wait()


def _import_s(module: str) -> float:
    started = time.perf_counter()
    subprocess.run([sys.executable, "-c", f"import {module}"], check=True)
    return time.perf_counter() - started


def _played(serving: _Serving) -> tuple[float, float]:
    """Request every frame as the page does while playing; return the memory before and after [MB]."""
    host, path = serving.url.removeprefix("http://").split("/", 1)
    entrance = http.client.HTTPConnection(host)
    entrance.request("GET", f"/{path}")
    cookie = (entrance.getresponse().getheader("Set-Cookie") or "").partition(";")[0]
    with connect(
        f"ws://{host}/ws/bench", origin=f"http://{host}", additional_headers={"Cookie": cookie}, max_size=None
    ) as socket:
        socket.send('{"type": "hello"}')
        _wait_for_placements(socket)
        before_mb = serving.process.memory_info().rss / 2**20
        for index in range(_FRAMES):
            wanted = {"type": "frame", "index": index, "request": index + 1, "playing": True, "size": "half"}
            socket.send(json.dumps(wanted))
            socket.send(json.dumps({"type": "cursor", "index": index, "playing": True}))
            while not isinstance(socket.recv(), bytes):
                pass
        return before_mb, serving.process.memory_info().rss / 2**20


def _wait_for_placements(socket: ClientConnection) -> None:
    """Read until the radar has been searched; the recording is then open, and nothing else is being done."""
    while isinstance(message := socket.recv(), bytes) or json.loads(message)["type"] != "placements":
        pass


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        print("\n".join(section(measure_serving(Path(folder)))))
