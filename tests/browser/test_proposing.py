"""Confirming instead of clicking: proposals appear while images are looked at, and each is decided with a key or a click."""

import re
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.proposing import DwellView, FrameSource, ImageCandidate, ViewProgress
from calib_core.recordings import Recording
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import Workspace
from tests.browser.accessibility import violations
from tests.browser.driving import Driver
from tests.serving import OWN_PORT, serving

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

UNCERTAIN = 4.0
"""Standard deviation of a place whose apex is not seen [px]."""
READY = "__cocalib.state.proposals?.progress.stage === 'ready'"
_LOOKING_S = 120.0  # until all images are looked at, beside other tests
ON_SCREEN = "__cocalib.shownOffer() && __cocalib.state.shown.index === __cocalib.state.cursor && !__cocalib.justMoved()"


class Images:
    """What replaces looking at the images: true places among others, found placement by placement as the test allows."""

    def __init__(self, truth: Any, held_from: int) -> None:
        self.held_from = held_from
        self.allowed = threading.Event()
        self.pixels = {
            one["best_image_time"]["sec"] * NS_PER_S + one["best_image_time"]["nanosec"]: np.array(one["pixel_px"])
            for one in truth["placements"]
        }

    def __call__(
        self, placements: Sequence[Placement], frames: FrameSource, camera: Camera, *, progress: Any, **_: Any
    ) -> tuple[DwellView, ...]:
        views: list[DwellView] = []
        for number, placement in enumerate(placements):
            if number == self.held_from:
                assert self.allowed.wait(60)
            views.append(self._view(number, placement, camera))
            progress(ViewProgress(len(views), len(placements), tuple(views)))
        return tuple(views)

    def at(self, stamp: dict[str, int]) -> tuple[float, float]:
        """Return where the reflector is in the dwell of a frame."""
        time = stamp["sec"] * NS_PER_S + stamp["nanosec"]
        u_px, v_px = self.pixels[min(self.pixels, key=lambda other: abs(other - time))]
        return float(u_px), float(v_px)

    def _view(self, number: int, placement: Placement, camera: Camera) -> DwellView:
        time = next(time for time in self.pixels if placement.start <= time <= placement.end)
        rng = np.random.default_rng(number)
        others = rng.uniform([0, 0], [camera.width_px - 1, camera.height_px - 1], (3, 2))
        places = [ImageCandidate(at, UNCERTAIN, 5.0) for at in others]
        at_px, strength = self.pixels[time] + rng.normal(0.0, 0.3, 2), 3.0 if number % 7 == 6 else 12.0
        found = ImageCandidate(at_px, 0.4, strength, has_apex=True)
        candidates = tuple(sorted([found, *places], key=lambda one: -one.strength))
        frame = np.array([number])
        image = np.zeros((0, 0, 3), np.uint8)
        return DwellView(placement, frame, TimeNs(time), image, 1.0, candidates, width_px=20.0)


@pytest.fixture
def held_from() -> int:
    """Looking at the images waits before this placement until the test goes on."""
    return 8


@pytest.fixture
def images(monkeypatch: pytest.MonkeyPatch, truth: Any, held_from: int) -> Iterator[Images]:
    fake = Images(truth, held_from)
    monkeypatch.setattr("cocalib.proposing.dwell_views", fake)
    monkeypatch.setattr("cocalib.proposing.appearances_of", lambda clicks, *_: [object()] if clicks else [])
    monkeypatch.setattr(
        "cocalib.proposing.with_appearance",
        lambda views, *_: tuple(
            replace(view, candidates=tuple(replace(one, likeness=0.5) for one in view.candidates)) for view in views
        ),
    )
    yield fake
    fake.allowed.set()


@pytest.fixture
def proposing(images: Images, workspace: Workspace, sample: Recording) -> Iterator[RunningServer]:
    running = start(workspace, sample, ServerOptions(port=OWN_PORT, token="test", proposes=True))
    yield running
    images.allowed.set()
    running.close()


def guide(page: Driver) -> str:
    page.until(ON_SCREEN)
    page.drawn()
    return page.text("#guide")


def left(page: Driver) -> int:
    """Return how many placements wait, as the line on the frame says."""
    found = re.search(r"(\d+) left", guide(page))
    assert found is not None
    return int(found[1])


def off_px(page: Driver, images: Images) -> float:
    """Return how far the proposal on screen is from the reflector."""
    offer = page.value("__cocalib.shownOffer()")
    u_px, v_px = images.at(offer["row"]["image_time"])
    return float(np.hypot(offer["place"]["pixel_px"][0] - u_px, offer["place"]["pixel_px"][1] - v_px))


@pytest.mark.slow
def test_under_fingers_a_proposal_is_three_times_as_large_beside_the_whole_image(
    images: Images, proposing: RunningServer, open_page: Callable[..., Driver]
) -> None:
    page = open_page(proposing.url, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page.until("__cocalib.state.proposals?.rows.length >= 5 && __cocalib.state.proposals.progress.done === 8")
    page.page.tap("#next-placement")
    guide(page)
    assert page.value("__cocalib.zoom()") == pytest.approx(3.0, rel=1e-3)
    x, y = page.place_of(*page.value("__cocalib.shownOffer().place.pixel_px"))
    inset, line = page.page.locator("#inset").bounding_box(), page.page.locator("#guide").bounding_box()
    assert inset is not None
    assert line is not None
    assert not (inset["x"] <= x <= inset["x"] + inset["width"] and inset["y"] <= y <= inset["y"] + inset["height"])
    assert inset["y"] + inset["height"] <= line["y"], "the line is below it"
    assert page.page.locator("#guide .primary").bounding_box()["height"] >= 40  # type: ignore[index]
    least = page.value("document.querySelector('#guide > span').clientHeight")
    page.page.evaluate(
        """async () => {
            const news = structuredClone(__cocalib.state.proposals);
            for (const row of news.rows) row.reason = "more words ".repeat(30);
            (await import("/proposals/proposals.js")).takeProposals(news);
        }"""
    )
    page.until("document.querySelector('#guide').textContent.includes('more words')")
    assert page.value("document.querySelector('#guide > span').clientHeight") == 2 * least
    page.page.tap("#guide > span")
    assert page.value("document.querySelector('#guide > span').clientHeight") > 4 * least


@pytest.mark.slow
def test_twenty_placements_take_at_most_25_keys_and_clicks(
    images: Images, proposing: RunningServer, open_page: Callable[..., Driver]
) -> None:
    page = open_page(proposing.url)
    page.until("__cocalib.state.proposals?.rows.length >= 5 && __cocalib.state.proposals.progress.done === 8")
    assert page.text("#status-text") == "Searching, 8 of 20"
    page.press("n")
    assert guide(page).startswith("Placement ")
    assert page.value("__cocalib.zoom()") > 1.5 * page.value("document.getElementById('marks').clientWidth / 960")
    page.press("Enter")
    page.until("__cocalib.state.view.clicks.length === 1")
    images.allowed.set()
    page.until(READY, _LOOKING_S)
    first = page.view["clicks"][0]
    assert (first["mark"], first["sigma_px"]) == ("snapped", pytest.approx(0.4))
    assert violations(page) == []

    count, accepted, order = 2, 1, []
    while (done := page.value("__cocalib.state.view.clicks.length")) < 20:
        page.until(f"{READY} && (({ON_SCREEN}) || !__cocalib.state.proposals.rows.length)", _LOOKING_S)
        if page.value("__cocalib.shownOffer() === null"):
            page.press("n")
            page.until("__cocalib.state.shown.index === __cocalib.state.cursor")
            assert "Nothing found here: " in page.text("#guide")
            page.click(*images.at(page.value("__cocalib.stampOf(__cocalib.state.cursor)")))
            count += 2
        elif off_px(page, images) < 3.0:
            assert left(page) <= 20 - done
            offer = page.value("__cocalib.shownOffer().row")
            order += [offer["placement"]] if offer["confidence"] > 0.9 else []
            page.page.keyboard.press("Enter")
            count, accepted = count + 1, accepted + 1
        else:
            page.page.keyboard.press("c")
            count += 1
        page.until("__cocalib.unconfirmed() === 0")
    assert count <= 25
    assert accepted >= 18
    assert order == [*sorted(order[:-1]), 0]  # that which N left undecided comes last
    page.settle()
    assert page.view["has_calibration"]
    assert page.value("__cocalib.shownOffer()") is None
    enter_does_nothing_else(page)


def enter_does_nothing_else(page: Driver) -> None:
    """After the last proposal it sets no mark, until another frame is looked at."""
    page.press("Enter")
    page.press("Enter")
    assert page.text("#toasts") == ""
    page.until("document.querySelector('#guide').textContent.startsWith('Done.')")
    assert page.value("__cocalib.state.cross") is None
    assert len(page.view["clicks"]) == 20
    page.press("ArrowRight")
    page.until("__cocalib.state.shown.index === __cocalib.state.cursor")
    page.press("Enter")
    assert page.value("__cocalib.state.cross") is None
    page.until("__cocalib.state.shown.index === __cocalib.state.cursor")
    page.press("g")
    page.until("__cocalib.state.cross")


@pytest.mark.slow
def test_a_correcting_click_goes_to_the_apex_that_its_frames_show_in_one_step(
    images: Images, proposing: RunningServer, open_page: Callable[..., Driver]
) -> None:
    images.allowed.set()
    page = open_page(proposing.url)
    page.until(READY, _LOOKING_S)
    page.press("n")
    while (
        guide(page) and page.value("__cocalib.shownOffer().row.placement") != 4
    ):  # near enough for one frame to show the apex
        page.press("n")
    before = left(page)
    u, v = images.at(page.value("__cocalib.shownOffer().row.image_time"))
    page.click(u + 2, v - 1)
    page.until("__cocalib.state.view.clicks.length === 1")
    assert left(page) == before - 1
    corrected = page.view["clicks"][0]
    assert corrected["mark"] == "snapped"
    assert np.hypot(corrected["u_px"] - u, corrected["v_px"] - v) < 0.8
    assert 0.05 < corrected["sigma_px"] < 0.8
    page.press("Control+z")
    page.until("__cocalib.state.view.clicks.length === 0 && __cocalib.shownOffer()")
    assert left(page) == before


@pytest.mark.slow
def test_a_proposal_is_rejected_corrected_and_undone_and_all_of_them_are_switched_off(
    images: Images, proposing: RunningServer, open_page: Callable[..., Driver]
) -> None:
    images.allowed.set()
    page = open_page(proposing.url)
    page.until(READY, _LOOKING_S)
    page.press("n")
    first, before = guide(page), left(page)
    placement = page.value("__cocalib.shownOffer().row.placement")
    page.press("c")
    assert "spot 2 of 4" in guide(page)

    page.press("x")
    page.until("__cocalib.state.view.dismissed.length === 1")
    assert left(page) == before - 1
    page.press("p")  # what was rejected is not come back to
    assert page.value("__cocalib.shownOffer()?.row.placement") != placement
    page.press("Control+z")
    page.until(f"__cocalib.state.view.dismissed.length === 0 && __cocalib.shownOffer()?.row.placement === {placement}")
    assert guide(page).split(" · ")[0] == first.split(" · ")[0]

    u, v = page.value("__cocalib.shownOffer().place.pixel_px")
    page.click(u + 25, v + 25)
    page.until("__cocalib.state.view.clicks.length === 1")
    corrected = page.view["clicks"][0]
    assert corrected["mark"] == "clicked"
    assert np.hypot(corrected["u_px"] - u - 25, corrected["v_px"] - v - 25) < 1
    assert left(page) == before - 1
    page.press("Control+z")
    page.until("__cocalib.state.view.clicks.length === 0")

    page.press("o")
    page.until("!__cocalib.state.proposals.on")
    page.until("!document.getElementById('guide').textContent.includes('sure')")
    page.press("Enter")
    assert page.value("__cocalib.state.cross") is None
    page.until("__cocalib.state.shown.index === __cocalib.state.cursor")
    page.press("g")
    page.until("__cocalib.state.cross")
    assert page.view["clicks"] == []


@pytest.mark.slow
def test_only_what_is_seen_is_decided_and_the_line_says_how_far_the_search_is(
    images: Images, proposing: RunningServer, open_page: Callable[..., Driver]
) -> None:
    page = open_page(proposing.url)
    user = page.page
    page.until("__cocalib.state.proposals?.rows.length >= 5 && __cocalib.state.proposals.progress.done === 8")
    page.go_to(page.value("__cocalib.state.placements[15].frame"))
    assert page.text("#status-text") == "Searching, 8 of 20"
    page.press("Enter")  # leads to one of those that are ready
    assert " left" not in guide(page), "how many there are is not known yet"
    assert page.view["clicks"] == []
    assert page.value("__cocalib.state.cross") is None
    page.value("dispatchEvent(new KeyboardEvent('keydown', {key: 'x', bubbles: true}))")
    page.value("dispatchEvent(new KeyboardEvent('keydown', {key: 'x', bubbles: true}))")  # unseen
    page.until("document.getElementById('guide').textContent.startsWith('Just shown: press again.')")
    page.settle()
    assert len(page.view["dismissed"]) == 1
    guide(page)
    user.keyboard.down("x")
    page.until("__cocalib.state.view.dismissed.length === 2")
    guide(page)
    user.keyboard.down("x")  # held
    user.keyboard.up("x")
    page.settle()
    assert len(page.view["dismissed"]) == 2

    guide(page)
    frame = page.value("__cocalib.shownOffer().row.frame")
    page.press("ArrowRight")
    page.until(f"__cocalib.state.shown.index === {frame + 1}")
    page.press("Enter")
    page.until(f"__cocalib.state.shown.index === {frame}")
    assert guide(page).startswith("Back at the proposal")
    width, height = page.value("[__cocalib.viewport.width, __cocalib.viewport.height]")
    left, top = page.value("(({left, top}) => [left, top])(document.getElementById('marks').getBoundingClientRect())")
    user.mouse.move(left + 20, top + height / 2)
    user.mouse.down()
    user.mouse.move(left + width - 10, top + height / 2, steps=3)
    user.mouse.up()
    page.press("Enter")
    assert page.view["clicks"] == []
    guide(page)

    user.locator(".over-image summary").click()
    page.press("Enter")
    assert len(page.view["clicks"]) == 1
    guide(page)
    user.keyboard.press("Tab")
    before = page.value("document.activeElement.getAttribute('aria-pressed')")
    page.press("Enter")
    assert page.value("document.activeElement.getAttribute('aria-pressed')") != before
    assert len(page.view["clicks"]) == 1


@pytest.mark.parametrize("held_from", [0])
def test_enter_before_any_proposal_goes_on_and_marks_nothing(
    proposing: RunningServer, open_page: Callable[..., Driver]
) -> None:
    page = open_page(proposing.url)
    page.until("__cocalib.state.placements.length > 0 && __cocalib.state.proposals")
    page.go_to(page.value("__cocalib.state.placements[0].frame"))
    page.press("Enter")
    assert page.value("__cocalib.state.cross") is None
    assert page.view["clicks"] == []


@pytest.mark.slow
def test_what_is_accepted_while_the_server_is_gone_is_drawn_and_sent_when_it_is_back(
    images: Images,
    proposing: RunningServer,
    workspace: Workspace,
    sample: Recording,
    open_page: Callable[..., Driver],
) -> None:
    images.allowed.set()
    page = open_page(proposing.url)
    page.until(READY, _LOOKING_S)
    page.press("n")
    guide(page)
    frame = page.value("__cocalib.state.cursor")
    port = int(page.page.url.split(":")[2].split("/")[0])
    proposing.close()
    page.until("!__cocalib.state.connected")
    page.page.keyboard.press("Enter")
    page.drawn()
    assert page.text("#guide").startswith("Accepted; ")
    assert page.value(f"__cocalib.clicksIn({frame}).map((click) => click.state)") == ["pending"]
    again = start(workspace, sample, ServerOptions(port=port, token="test", proposes=True))
    try:
        page.until("__cocalib.unconfirmed() === 0 && __cocalib.state.view.clicks.length === 1")
        assert len(workspace.session.clicks) == 1
    finally:
        again.close()
    page.forget_lost_connections()


def test_without_intrinsics_the_line_says_why_nothing_is_proposed(
    sample: Recording, tmp_path: Path, open_page: Callable[..., Driver]
) -> None:
    with serving(sample, tmp_path / "session", name="sample", port=OWN_PORT, token="test", proposes=True) as (
        running,
        _,
    ):
        page = open_page(running.url)
        page.until("__cocalib.state.proposals?.progress.problem")
        page.press("n")
        page.until("document.getElementById('guide').textContent.includes('No proposals. ')")
        page.until("__cocalib.state.shown.index === __cocalib.state.cursor")
        assert "intrinsics" in page.text("#guide")
        assert ".." not in page.text("#guide")
