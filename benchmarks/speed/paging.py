"""The page in a real Chromium: click to mark, click to solved overlay, stepping, playing, memory."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil
from playwright.sync_api import Page, sync_playwright

from benchmarks.speed.rows import Row, Table, spread
from calib_core.synthetic import SimulationOptions, simulate, write_recording
from cocalib.platform.resources import sample_folder
from tests.find_browser import find_browser

__all__ = ["measure_page"]

_FLAGS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
_COMMAND = str(Path(sys.executable).with_name("cocalib"))
_CLICKS = 40
_STEPS = 60
_PLAY_S = 20.0
_MEASURES = Path(__file__).with_name("measures.js")


@dataclass(frozen=True, slots=True)
class _Opened:
    """A page on a server.

    Attributes:
        page: loaded in Chromium, with its first frame shown and its 3D view drawn.
        server: the `cocalib` process.
        ready_s: time from starting the process to the first frame on the screen.
    """

    page: Page
    server: psutil.Process
    ready_s: float


def measure_page(scratch: Path) -> tuple[Table, ...]:
    """Measure on the sample and on a simulated 1080p recording.

    Args:
        scratch: folder for recordings and sessions.
    """
    sample = sample_folder() / "rooftop"
    bags = [str(sample / "radar.bag"), str(sample / "camera.bag")]
    with _opened([*bags, "--clicks", str(sample / "clicks.json")], scratch / "clicking") as opened:
        clicking = _clicking(opened)
    large = write_recording(
        simulate(SimulationOptions(placements=2, dwell_s=4.0, width_px=1920, height_px=1080, camera_rate_hz=30.0)),
        scratch / "large",
    )
    with _opened([str(path) for path in large], scratch / "playing") as opened:
        return clicking, _playing(opened)


def _clicking(opened: _Opened) -> Table:
    marks_ms, solved_ms = [], []
    for number in range(_CLICKS):
        times = opened.page.evaluate("number => window.__measures.click(number)", number)
        marks_ms.append(times["mark"])
        solved_ms.append(times["solved"])
    return Table(
        "Clicking",
        f"The sample with its 20 pairs and the 3D view next to the picture; {_CLICKS} marks dragged by 6 px, one after another. "
        "Times are from the pointer's release to the painted picture.",
        (
            _timed("click to mark", marks_ms, 80),
            _timed("click to solved overlay", solved_ms, 200),
            Row("start of `cocalib open` to the first frame, browser included", f"{opened.ready_s:.1f} s"),
        ),
    )


def _playing(opened: _Opened) -> Table:
    page = opened.page
    steps_ms = [page.evaluate("() => window.__measures.step()") for _ in range(_STEPS)]
    server_before, tab_before = _megabytes(opened.server), _tab_megabytes()
    played = page.evaluate("seconds => window.__measures.play(seconds)", _PLAY_S)
    server_after, tab_after = _megabytes(opened.server), _tab_megabytes()
    pushed = page.evaluate("() => window.__measures.push(120)")
    frames_per_s = played["shown"] / played["seconds"]
    return Table(
        "Stepping and playing 1080p",
        "A simulated recording of 1920 x 1080 at 30 frames a second, with the 3D view next to it; "
        f"{_STEPS} steps, {_PLAY_S:.0f} s of playback.",
        (
            _timed("frame step to shown picture", steps_ms, 300),
            Row("frames shown while playing", f"{frames_per_s:.1f} a second", "", "10 or more", frames_per_s >= 10),
            Row("longest gap between two frames while playing", f"{played['longest_gap_ms']:.0f} ms"),
            Row(
                "120 frames requested at once",
                f"settled on the last one in {pushed['settled_ms']:.0f} ms, {pushed['shown']} shown on the way",
                "",
                "never freezes",
                pushed["settled"],
            ),
            Row("server memory, before and after playing", f"{server_before:.0f} and {server_after:.0f} MB"),
            Row("page's renderer memory, before and after playing", f"{tab_before:.0f} and {tab_after:.0f} MB"),
        ),
    )


def _timed(what: str, values_ms: list[float], aim_ms: float) -> Row:
    met = sorted(values_ms)[int(0.95 * (len(values_ms) - 1))] < aim_ms
    return Row(what, spread(values_ms), "", f"p95 under {aim_ms:.0f} ms", met)


@contextmanager
def _opened(arguments: list[str], session: Path) -> Iterator[_Opened]:
    started = time.perf_counter()
    server = subprocess.Popen(
        [_COMMAND, "open", *arguments, "--session", str(session), "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        assert server.stdout is not None
        url = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+", line)))
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_browser(), args=_FLAGS)
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.goto(url)
            page.wait_for_function("() => window.__cocalib && window.__cocalib.state.shown")
            ready_s = time.perf_counter() - started
            page.evaluate(_MEASURES.read_text(encoding="utf-8"))
            page.evaluate("() => window.__measures.settled()")
            yield _Opened(page, psutil.Process(server.pid), ready_s)
            browser.close()
    finally:
        server.terminate()
        server.wait()


def _megabytes(process: psutil.Process) -> float:
    return float(process.memory_info().rss) / 2**20


def _tab_megabytes() -> float:
    """Return the memory of the largest renderer process, the page with its 3D view [MB]."""
    renderers = [
        process.memory_info().rss
        for process in psutil.Process().children(recursive=True)
        if "--type=renderer" in process.cmdline()
    ]
    return max(renderers, default=0) / 2**20
