"""The page in a real Chromium against an earlier version of it, in turn: `python -m benchmarks.speed.paging`; playing, memory."""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
from playwright.sync_api import Page, sync_playwright

from benchmarks.speed.rows import Row, Table, earlier_version, median_ms, section
from benchmarks.speed.starting import as_installed
from calib_core.measurements import time_from_parts
from calib_core.recordings import open_recording
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
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
_HERE = Path(__file__).resolve().parents[2]
_EARLIER = "c35a642"
"""The commit to compare with: the last one before answers came in two steps, and before there were proposals."""
_EARLIER_SHEET = "ac111f5b"
"""The same for the contact sheet: the last one that got its cut-outs one by one."""
_ROUNDS = 4
_CLICKS = 20
_STEPS = 40
_MARKS_EACH = 10
_AT_REST_MS = 5_000
"""How long the page rests before Check is opened: without a graphics card a drawing of the 3D view takes up to a second."""
_PLAY_S = 20.0
_SAMPLE = [str(sample_folder() / "rooftop" / name) for name in ("radar.bag", "camera.bag")]
_MEASURES = Path(__file__).with_name("measures.js")


@dataclass(frozen=True, slots=True)
class _Opened:
    """A page on a server.

    Attributes:
        page: loaded in Chromium, with its first frame shown and its 3D view drawn.
        server: the `cocalib` process.
        started_s: when the process was started, by `time.perf_counter`.
        ready_s: time from then to the first frame on the screen.
    """

    page: Page
    server: psutil.Process
    started_s: float
    ready_s: float


def measure_page(scratch: Path) -> tuple[Table, ...]:
    """Measure on the sample, in turn with an earlier version, and on a simulated 1080p recording.

    Args:
        scratch: folder for the earlier version, recordings and sessions.
    """
    large = write_recording(
        simulate(SimulationOptions(placements=2, dwell_s=4.0, width_px=1920, height_px=1080, camera_rate_hz=30.0)),
        scratch / "large",
    )
    compared, sheet, beginning = _compared(scratch), measure_sheet(scratch), _beginning(scratch)
    with _opened(_HERE, ["open", *map(str, large)], scratch, "playing") as opened:
        return compared, sheet, beginning, _playing(opened)


def measure_sheet(scratch: Path) -> Table:
    """Open the contact sheet of 200 marks in both versions, one after the other; cut-outs are kept from the opening before."""
    file = sample_folder() / "rooftop" / "clicks.json"
    document = json.loads(file.read_text())
    with open_recording([Path(path) for path in _SAMPLE]) as recording:
        times = recording.image_times
    marks = []
    for click in document["clicks"]:
        at = int(np.searchsorted(times, time_from_parts(**click["image_time"])))
        for index in range(at - _MARKS_EACH // 2, at + _MARKS_EACH // 2):
            sec, nanosec = divmod(int(times[index]), 10**9)
            marks.append({**click, "id": f"c{len(marks)}", "image_time": {"sec": sec, "nanosec": nanosec}})
    many = scratch / "many.json"
    many.write_text(json.dumps({**document, "clicks": marks}))
    times_ms: dict[Path, dict[str, list[float]]] = {earlier_version(_EARLIER_SHEET, scratch): {}, _HERE: {}}
    for number in range(_ROUNDS):
        for version, measured in times_ms.items():
            command = ["open", *_SAMPLE, "--clicks", str(many)] if number == 0 else ["open", *_SAMPLE]
            with _opened(version, command, scratch, f"sheet-{version.name}") as opened:
                if number == 0:  # here the cut-outs are made
                    opened.page.wait_for_timeout(10_000)
                    continue
                opened.page.wait_for_timeout(_AT_REST_MS)
                for what, value_ms in opened.page.evaluate("() => window.__measures.sheet()").items():
                    measured.setdefault(what, []).append(value_ms)
    return Table(
        "The contact sheet",
        f"{len(marks)} marks of the sample and their cut-outs of the session before, with the 3D view next to the image, drawn "
        f"and at rest; the page Check is opened once in each of {_ROUNDS - 1} sessions of this version and of "
        f"{_EARLIER_SHEET}, in turn. Alone: `python -m benchmarks.speed.paging --sheet`.",
        (
            _against("opening Check to its grid with numbers", *(times["grid"] for times in times_ms.values())),
            _against("opening Check to the cut-outs in sight", *(times["cutOuts"] for times in times_ms.values())),
        ),
    )


def _against(what: str, before_ms: list[float], now_ms: list[float]) -> Row:
    median = float(np.median(now_ms))
    return Row(what, median_ms(now_ms), f"{median / np.median(before_ms):.2f} x", "under 300 ms", median < 300)


def _compared(scratch: Path) -> Table:
    """Drag the same marks and step through the same frames in both versions, one after the other."""
    earlier = earlier_version(_EARLIER, scratch)
    command = ["open", *_SAMPLE, "--clicks", str(sample_folder() / "rooftop" / "clicks.json")]
    times_ms: dict[Path, dict[str, list[float]]] = {earlier: {}, _HERE: {}}
    for number in range(_ROUNDS):
        for version, measured in times_ms.items():
            with _opened(version, command, scratch, f"clicking-{version.name}-{number}") as opened:
                for click in range(_CLICKS):
                    for what, value_ms in opened.page.evaluate("k => window.__measures.click(k)", click).items():
                        measured.setdefault(what, []).append(value_ms)
                steps_ms = [opened.page.evaluate("() => window.__measures.step()") for _ in range(_STEPS)]
                measured.setdefault("step", []).extend(steps_ms)
                measured.setdefault("ready", []).append(opened.ready_s * 1000)
    before, now = times_ms.values()
    for what, earlier_ms in before.items():  # for developers; the page has the times
        print(f"{what}: {np.median(now[what]) / np.median(earlier_ms):.2f} x {_EARLIER}", file=sys.stderr)
    return Table(
        "The page",
        f"The sample with its 20 pairs and the 3D view next to the image, in Chromium; {_ROUNDS} rounds, in each {_CLICKS} marks "
        f"dragged by 6 px as soon as the page is there, while it looks for proposals, and {_STEPS} frames stepped. From the "
        "pointer's release to the painted image. Alone: `python -m benchmarks.speed.paging`.",
        (
            _timed("click to mark", now["mark"], 80),
            _timed("click to the preview's overlay", now["preview"], 200),
            _timed("click to the answer's overlay", now["answer"], None),
            _timed("frame step to shown image", now["step"], 300),
            _timed("start of `cocalib open` to the first frame, browser included", now["ready"], None),
        ),
    )


def _beginning(scratch: Path) -> Table:
    """Accept the first proposal as soon as it is seen."""
    ready_s, accepted_s = [], []
    for number in range(_ROUNDS):
        with _opened(_HERE, ["demo"], scratch, f"beginning-{number}") as opened:
            opened.page.wait_for_function("() => window.__cocalib.shownOffer() && !window.__cocalib.justMoved()")
            opened.page.keyboard.press("Enter")
            opened.page.wait_for_function("() => window.__cocalib.state.view.clicks.length === 1")
            ready_s.append(opened.ready_s)
            accepted_s.append(time.perf_counter() - opened.started_s - opened.ready_s)
    return Table(
        "The first minute",
        f"`cocalib demo`, {_ROUNDS} times with a fresh process and browser; the last row is from the first frame to the first "
        "proposal that Enter accepted. Aims of 2 s and 3 s are withdrawn: two cores that also draw WebGL in software miss them.",
        (
            _timed("start to the first frame, browser included", [1000 * value for value in ready_s], None),
            _timed("first frame to the first accepted proposal", [1000 * value for value in accepted_s], None),
        ),
    )


def _timed(what: str, times_ms: list[float], aim_ms: float | None) -> Row:
    high_ms = float(np.percentile(times_ms, 95))
    aim = f"95 % under {aim_ms:g} ms" if aim_ms else ""
    return Row(what, median_ms(times_ms), "", aim, aim_ms is None or high_ms < aim_ms)


def _playing(opened: _Opened) -> Table:
    page = opened.page
    steps_ms = [page.evaluate("() => window.__measures.step()") for _ in range(_STEPS)]
    server_before, tab_before = _megabytes(opened.server), _tab_megabytes()
    played = page.evaluate("seconds => window.__measures.play(seconds)", _PLAY_S)
    server_after, tab_after = _megabytes(opened.server), _tab_megabytes()
    pushed = page.evaluate("() => window.__measures.push(120)")
    shown = played["shown"] / played["seconds"]
    settled = f"settled on the last one in {pushed['settled_ms']:.0f} ms, {pushed['shown']} shown on the way"
    return Table(
        "Playing 1080p",
        "A simulated recording of 1920 x 1080 at 30 frames a second, with the 3D view next to it; "
        f"{_STEPS} steps, {_PLAY_S:.0f} s of playback.",
        (
            _timed("frame step to shown image", steps_ms, 300),
            Row("frames shown while playing", f"{shown:.1f} a second", "", "10 or more", shown >= 10),
            Row("longest gap between two frames while playing", f"{played['longest_gap_ms']:.0f} ms"),
            Row("120 frames requested at once", settled, "", "never freezes", pushed["settled"]),
            Row("server memory, before and after playing", f"{server_before:.0f} and {server_after:.0f} MB"),
            Row("page's renderer memory, before and after playing", f"{tab_before:.0f} and {tab_after:.0f} MB"),
        ),
    )


@contextmanager
def _opened(version: Path, command: list[str], scratch: Path, name: str) -> Iterator[_Opened]:
    package = "cocalib" if (version / "app" / "cocalib").is_dir() else "app"
    environment = as_installed(scratch / "bytecode")
    environment |= {"PYTHONUNBUFFERED": "1", "PYTHONPATH": f"{version / 'app'}{os.pathsep}{version}"}
    with sync_playwright() as playwright:
        started = time.perf_counter()
        server = subprocess.Popen(
            [sys.executable, "-m", package, *command, "--session", str(scratch / name), "--port", "0", "--no-browser"],
            stdout=subprocess.PIPE,
            text=True,
            cwd=version,
            env=environment,
        )
        try:
            assert server.stdout is not None
            url = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+", line)))
            browser = playwright.chromium.launch(executable_path=find_browser(), args=_FLAGS)
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.goto(url)
            page.wait_for_function("() => window.__cocalib && window.__cocalib.state.shown")
            ready_s = time.perf_counter() - started
            page.evaluate(_MEASURES.read_text(encoding="utf-8"))
            page.evaluate("() => window.__measures.settled()")
            yield _Opened(page, psutil.Process(server.pid), started, ready_s)
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


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        tables = (measure_sheet(Path(folder)),) if "--sheet" in sys.argv else measure_page(Path(folder))
        for table in tables:
            print("\n".join(section(table)))
