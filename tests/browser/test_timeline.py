"""The timeline: gaps are folded, and pointer and drawing agree on where each moment is."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import open_workspace
from tests.browser.driving import Driver
from tests.image_recording import START, ImageRecording, grey_images
from tests.serving import OWN_PORT

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

STARTS_S = (0, 258, 700, 1500, 1720, 2600, 2700, 2958, 3400, 4130)
LENGTHS_S = (6, 6, 2, 15, 8, 12, 7, 5, 4, 15)
ALL_S = tuple(
    (float(start_s), float(start_s + length_s)) for start_s, length_s in zip(STARTS_S, LENGTHS_S, strict=True)
)
"""80 s of frames in 69 minutes."""


@pytest.fixture
def islands_page(open_page: Callable[..., Driver], tmp_path: Path) -> Iterator[Driver]:
    """Serve frames at 5 Hz in islands, and say where a reflector stood in each."""
    times_s = np.concatenate([np.arange(start_s, end_s, 0.2) for start_s, end_s in ALL_S])
    recording = ImageRecording(grey_images(len(times_s), 64, 48))
    recording.image_times = START + (times_s * NS_PER_S).astype(np.int64)
    workspace = open_workspace(recording, camera=recording.camera(), session_folder=tmp_path / "s", name="islands")
    server: RunningServer = start(workspace, recording, ServerOptions(port=OWN_PORT, token="test"))
    page = open_page(server.url)
    page.until("__cocalib.state.placementsKnown")
    rows = [
        {
            "start_s": start_s + 0.2,
            "end_s": end_s - 0.4,
            "frame": 0,
            "range_m": 10.0,
            "note": "",
            "position_radar_m": [10, 0, 0],
        }
        for start_s, end_s in ALL_S
    ]
    page.page.evaluate(
        """async (rows) => {
            const { emit, state } = await import("/base/state.js");
            state.placements = rows;
            emit("placements");
        }""",
        rows,
    )
    yield page
    server.close()
    workspace.close()


def test_placements_in_a_recording_with_long_gaps_are_wide_enough_to_be_hit(islands_page: Driver) -> None:
    page = islands_page
    placed = page.page.evaluate(
        "async () => { const { toX, toSeconds } = await import('/time/timeline.js');"
        "return __cocalib.state.placements.map(({ start_s, end_s }) => "
        "[toX(start_s), toX(end_s), toSeconds(toX((start_s + end_s) / 2)) - (start_s + end_s) / 2]); }"
    )
    widths = [right - left for left, right, _ in placed]
    lengths_s = [end_s - start_s - 0.6 for start_s, end_s in ALL_S]
    assert min(widths) > 10
    assert np.allclose(np.divide(widths, lengths_s), widths[0] / lengths_s[0])  # one scale in all of them
    assert max(abs(error_s) for _, _, error_s in placed) < 1e-6
    box = page.page.locator("#timeline").bounding_box()
    assert box is not None
    left, right, _ = placed[4]
    page.page.mouse.click(box["x"] + (left + right) / 2, box["y"] + 30)
    page.until(
        "__cocalib.state.seconds[__cocalib.state.cursor] > 1720 && __cocalib.state.seconds[__cocalib.state.cursor] < 1728"
    )
    gap = (placed[0][1] + placed[1][0]) / 2
    page.page.mouse.move(box["x"] + gap, box["y"] + 50)
    page.until("!document.getElementById('tip').hidden")
    assert page.text("#tip") == "No frames for 4 min, from 0:05.8 to 4:18.0"
    known = page.page.evaluate(
        "async () => { const { changes } = await import('/time/lanes.js'); const end = performance.now() + 30000;"
        "while (!changes.seconds.length && performance.now() < end) await new Promise((done) => setTimeout(done, 50));"
        "return changes; }"
    )
    assert len(known["grey_levels"]) == len(known["seconds"]) > 0


def test_the_folded_axis_is_monotone_and_has_an_exact_way_back(islands_page: Driver) -> None:
    rng = np.random.default_rng(3)
    cases = []
    for _ in range(60):
        intervals_s = rng.choice([0.033, 0.1, 0.2, 1.0]) * rng.uniform(0.5, 1.5, rng.integers(1, 120))
        far = rng.random(len(intervals_s)) < rng.choice([0.0, 0.05, 0.3])
        intervals_s[far] += rng.exponential(rng.choice([3.0, 60.0, 4000.0]), far.sum())
        times_s = np.concatenate([[0.0], np.cumsum(intervals_s)])
        asked_s = np.sort(np.concatenate([times_s, rng.uniform(-5.0, times_s[-1] + 5.0, 60)]))
        cases.append({"times": times_s.tolist(), "asked": np.unique(asked_s).tolist()})
    cases.append({"times": [0.0], "asked": [-1.0, 0.0, 2.0]})
    answers = islands_page.page.evaluate(
        "async (text) => { const { foldingOf, gapsOf, toFolded, toSeconds } = await import('/time/ruler.js');"
        "return JSON.parse(text).map(({ times, asked }) => { const folding = foldingOf(times);"
        "const drawn = asked.map((seconds) => toFolded(folding, seconds));"
        "return { drawn, back: drawn.map((at) => toSeconds(folding, at)), gaps: gapsOf(folding) }; }); }",
        json.dumps(cases),
    )
    assert sum(len(answer["gaps"]) for answer in answers) > 100
    for case, answer in zip(cases, answers, strict=True):
        asked_s, drawn = np.array(case["asked"]), np.array(answer["drawn"])
        assert (np.diff(drawn) > 0).all()
        assert np.allclose(answer["back"], asked_s, rtol=0, atol=1e-6 * max(1.0, asked_s[-1]))
        for gap in answer["gaps"]:
            assert gap["end"] - gap["start"] < (gap["to"] - gap["from"]) / 2
            inside = (np.array(case["times"]) > gap["from"]) & (np.array(case["times"]) < gap["to"])
            assert not inside.any()  # no frame is in a folded gap
        if not answer["gaps"]:
            assert np.allclose(drawn - drawn[0], asked_s - asked_s[0])  # nothing to fold: the axis is time itself


def test_zoomed_in_a_strip_shows_all_placements_below_the_part_in_sight(page: Driver) -> None:
    page.until("__cocalib.state.placementsKnown")
    box = page.page.locator("#timeline").bounding_box()
    assert box is not None
    assert placements_in_strip(page) == 0, "all of the recording is in sight"
    page.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 30)
    page.page.mouse.wheel(0, -900)
    page.drawn()
    assert placements_in_strip(page) == len(page.value("__cocalib.state.placements"))
    for share in (0.9, 0.2):
        page.page.mouse.click(box["x"] + 76 + share * (box["width"] - 76), box["y"] + box["height"] - 2)
        page.until(f"Math.abs(__cocalib.state.cursor / __cocalib.state.seconds.length - {share}) < 0.03")
        page.drawn()
        assert placements_in_strip(page) == len(page.value("__cocalib.state.placements")), "a part is still shown"


def placements_in_strip(page: Driver) -> int:
    """Count the blue stretches in the lowest rows of the timeline, right of the names of the lanes."""
    strip = page.pixels("#timeline")[-3:, 76:].astype(int)
    is_blue = (strip[:, :, 0] > strip[:, :, 2] + 60).any(axis=0)
    return int(np.count_nonzero(np.diff(is_blue.astype(int)) == 1))


@pytest.mark.slow
def test_times_of_a_long_recording_are_minutes_and_hours(page: Driver) -> None:
    texts = page.page.evaluate(
        """async () => {
          const { minutesText } = await import("/base/state.js");
          return [[59.999, 0], [600, 0], [3002.446, 3], [3852.3, 2]].map(([seconds, digits]) => minutesText(seconds, digits));
        }"""
    )
    assert texts == ["0:59", "10:00", "50:02.446", "1:04:12.30"]
    assert page.text("#clock-time").endswith(" s")
