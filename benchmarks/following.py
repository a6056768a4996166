"""How far behind its writer the page of a followed recording is, and what following costs: python -m benchmarks.following

A second process writes the sample recording as MCAP at recorded rate and prints when it has flushed each chunk; a page in
Chromium notes when it shows each frame. Then the writer is killed, and the processor time of following a quiet file is measured.
"""

import argparse
import resource
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from calib_core.recordings import AwaitedRecording, FollowedRecording
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import open_workspace

_FLAGS = ["--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
_NOTE = """() => {
    window.__noted = [];
    const look = () => {
        const shown = __cocalib.state.shown?.index ?? -1;
        const last = window.__noted.at(-1)?.[0] ?? -1;
        if (shown > last) window.__noted.push([shown, Date.now()]);
        requestAnimationFrame(look);
    };
    look();
}"""


class _Writer:
    """The writer's process, and when it has flushed how many frames."""

    def __init__(self, path: Path, rate: float, chunk_s: float) -> None:
        command = [sys.executable, "-m", "tests.growing_recording", str(path), str(rate), str(chunk_s)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.flushed: list[tuple[int, float]] = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            frames, at_s = line.split()
            self.flushed.append((int(frames), float(at_s)))

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()


@contextmanager
def _served(path: Path, folder: Path) -> Iterator[tuple[RunningServer, FollowedRecording]]:
    awaited = AwaitedRecording([path])
    while (recording := awaited.look()) is None:
        time.sleep(0.1)
    with recording:
        workspace = open_workspace(recording, camera=recording.camera(), session_folder=folder, name="drive.mcap")
        server = start(workspace, recording, ServerOptions(port=0, token="benchmark"))
        yield server, recording
        server.close()
        workspace.close()


class _Availability:
    """Notes when the recording has how many frames."""

    def __init__(self, recording: FollowedRecording) -> None:
        self.noted: list[tuple[int, float]] = []
        self._recording = recording
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def _look(self) -> None:
        while not self._ended.wait(0.01):
            index = len(self._recording.image_times) - 1
            if not self.noted or index > self.noted[-1][0]:
                self.noted.append((index, 1e3 * time.time()))

    def end(self) -> None:
        self._ended.set()
        self._thread.join()


def _processor_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _report(name: str, values_s: np.ndarray) -> None:
    median, most = 1e3 * float(np.median(values_s)), 1e3 * float(values_s.max())
    print(f"{name}: median {median:.0f} ms, 95 % {1e3 * float(np.quantile(values_s, 0.95)):.0f} ms, most {most:.0f} ms")


def _delays_s(flushed: list[tuple[int, float]], noted: list[tuple[int, float]]) -> np.ndarray:
    """Return, for each chunk with new frames, the time from its flush to the page showing its last frame or a later one."""
    delays = []
    for (before, _), (frames, at_s) in pairwise(flushed):
        shown = next((ms / 1e3 for index, ms in noted if index >= frames - 1), None)
        if frames > before and shown is not None and at_s > noted[0][1] / 1e3:
            delays.append(shown - at_s)
    return np.array(delays)


def main() -> None:
    """Measure and print."""
    from playwright.sync_api import sync_playwright

    from tests.find_browser import find_browser

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=1.0, help="times the recorded rate")
    parser.add_argument("--chunk-s", type=float, default=0.2, help="length of a chunk [s of the recording]")
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to follow")
    given = parser.parse_args()
    with TemporaryDirectory() as name, sync_playwright() as driver:
        path = Path(name) / "drive.mcap"
        writer = _Writer(path, given.rate, given.chunk_s)
        with _served(path, Path(name) / "session") as (server, recording):
            page = driver.chromium.launch(executable_path=str(find_browser()), args=_FLAGS).new_page()
            page.goto(server.url)
            page.wait_for_function("() => __cocalib.state.live && Boolean(__cocalib.state.shown)", polling=100)
            page.evaluate(_NOTE)
            available = _Availability(recording)
            used_s, began = _processor_s(), time.monotonic()
            page.wait_for_timeout(1e3 * given.seconds)
            growing = (_processor_s() - used_s) / (time.monotonic() - began)
            writer.kill()
            page.wait_for_timeout(3e3)
            available.end()
            delays_s = _delays_s(writer.flushed, page.evaluate("() => window.__noted"))
            print(f"{len(delays_s)} chunks with new frames, {len(recording.image_times)} frames in all")
            _report("from flush to the frame in the recording", _delays_s(writer.flushed, available.noted))
            _report("from flush to the frame on the page", delays_s)
            page.close()
            used_s, began = _processor_s(), time.monotonic()
            time.sleep(20)
            quiet = (_processor_s() - used_s) / (time.monotonic() - began)
            print(f"processor time of the server: {100 * growing:.1f} % while growing, {100 * quiet:.2f} % while quiet")


if __name__ == "__main__":
    main()
