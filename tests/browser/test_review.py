"""The review on the page Check: linked plots, contours of the uncertainty, two solutions compared."""

from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import expect

from calib_core.measurements import ReflectorClick, time_from_parts
from cocalib.cli import run
from cocalib.session.events import ClickExcluded, ClicksImported
from cocalib.web.port.server import RunningServer
from cocalib.workspace import Workspace
from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def clicks_of(truth: Any) -> list[ReflectorClick]:
    """Return a click where each reflector was rendered; that of the seventh is far off."""
    clicks = [
        ReflectorClick(time_from_parts(**placement["best_image_time"]), f"c{number + 1}", *placement["pixel_px"])
        for number, placement in enumerate(truth["placements"])
    ]
    clicks[6] = replace(clicks[6], u_px=clicks[6].u_px + 120)
    return clicks


@pytest.fixture
def reviewing(open_page: Callable[..., Driver], server: RunningServer, workspace: Workspace, truth: Any) -> Driver:
    """Open the review of twenty clicks."""
    page = open_page(server.url)
    workspace.dispatch(ClicksImported.of(tuple(clicks_of(truth))))
    page.until("__cocalib.state.view.has_calibration")
    page.settle()
    page.page.click("#tab-check")
    page.until("document.querySelector('.review-words').textContent.includes('matters most')")
    page.drawn()
    return page


def on_plot(page: Driver, plot: str, name: str) -> tuple[float, float]:
    """Return where a pair is drawn in a plot [CSS px of the page]."""
    page.page.locator(f"[data-plot={plot}]").scroll_into_view_if_needed()
    page.drawn()
    x, y = page.value(
        f"""(() => {{
            const plot = __cocalib.plots.get('{plot}');
            const mark = plot.content.marks.find((one) => one.ids.includes('{name}'));
            const box = plot.canvas.getBoundingClientRect();
            const [x, y] = plot.place(mark.x, mark.y);
            return [box.left + x, box.top + y];
        }})()"""
    )
    return float(x), float(y)


def image_of(page: Driver, selector: str) -> str:
    page.drawn()
    return str(page.value(f"document.querySelector('{selector}').toDataURL()"))


def download(page: Driver) -> str:
    return str(page.page.evaluate("async () => (await fetch('api/calibration.json')).text()"))


def figures(page: Driver) -> list[str]:
    """Return the figures of the comparison on the page, a line each."""
    rows = page.value(
        "[...document.querySelectorAll('.compare tr')].map((row) => [...row.cells].map((cell) => cell.textContent))"
    )
    return [": ".join(row) for row in rows]


def printed(calibration: Path, against: Path) -> list[str]:
    """Return the figures that `cocalib check` prints."""
    with redirect_stdout(StringIO()) as out:
        run(["check", str(calibration), "--against", str(against)])
    told = [line.strip().removeprefix("compared with the other: ") for line in out.getvalue().splitlines()]
    return [line for line in told if line.startswith(("rotation:", "camera position:", "at ", "overall:", "change:"))]


def test_all_marks_are_on_one_sheet_the_worst_first_and_a_line_selects_those_to_review(reviewing: Driver) -> None:
    page = reviewing
    cells = page.page.locator(".sheet .crop")
    expect(cells).to_have_count(20)
    assert cells.first.get_attribute("data-id") == "c7"
    page.until("document.querySelector('.sheet img').naturalWidth === 96")
    lengths = page.value(
        "[...document.querySelectorAll('.sheet .crop')].map((cell) => parseFloat(cell.innerText.split(' ')[1]))"
    )
    assert lengths == sorted(lengths, reverse=True)
    before = page.view["clicks"]

    page.page.focus("[data-plot=residuals]")
    for _ in range(45):
        page.page.keyboard.press("ArrowDown")
    page.until("document.querySelectorAll('.sheet .marked').length > 3")
    assert page.view["clicks"] == before, "the line excludes nothing"
    page.page.click(".to-review button")
    expect(cells.first).to_be_focused()
    page.press("r")
    page.until("__cocalib.state.view.reviewed.length === 1")
    assert page.view["reviewed"] == ["c7"]
    page.page.click(".to-review button")
    second = page.value("document.activeElement.dataset.id")
    assert second != "c7"
    page.press("x")
    page.until(f"__cocalib.state.view.clicks.find((click) => click.id === '{second}').state === 'excluded'")
    page.press("Control+z", "Control+z")
    page.until("__cocalib.state.view.reviewed.length === 0")
    page.page.focus(".sheet .crop[data-id=c7]")
    page.press("Enter")
    page.until("__cocalib.state.selected === 'c7' && __cocalib.state.shown.index === __cocalib.state.cursor")


@pytest.mark.slow
def test_a_dot_is_the_same_pair_in_every_plot_and_leads_to_it_and_contours_are_labelled(
    reviewing: Driver, truth: Any
) -> None:
    page = reviewing
    page.page.click("#panel-large")
    at = on_plot(page, "azimuth", "c3")
    page.page.mouse.move(5, 5)
    quiet = {plot: image_of(page, f"[data-plot={plot}]") for plot in ("range", "residuals")}
    page.page.mouse.move(*at)
    page.until("document.getElementById('review-readout').textContent.startsWith('3: ')")
    assert all(image_of(page, f"[data-plot={plot}]") != quiet[plot] for plot in quiet)
    page.page.mouse.move(5, 5)
    page.until("document.getElementById('review-readout').textContent === ''")
    assert {plot: image_of(page, f"[data-plot={plot}]") == quiet[plot] for plot in quiet} == dict.fromkeys(quiet, True)

    page.page.mouse.click(*on_plot(page, "range", "c5"))
    page.until("__cocalib.state.selected === 'c5'")
    assert page.value("__cocalib.state.cursor") == page.frame_at(truth["placements"][4]["best_image_time"])
    page.page.click(".review-why summary")
    page.until("document.querySelector('.review-pair h2').textContent === 'Pair 5'")
    assert "6.41 m return" in page.text(".review-pair")

    page.page.focus("[data-plot=time]")
    page.press("ArrowRight", "ArrowRight")
    assert page.text("#review-readout").startswith("2: ")
    assert page.value("__cocalib.state.selected") == "c5"
    page.press("Enter")
    page.until("__cocalib.state.selected === 'c2'")
    assert len(page.view["clicks"]) == 20  # Enter went to the pair, and placed nothing

    page.page.click("[data-filter=agreeing]")
    page.until("__cocalib.plots.get('range').content.marks.every((mark) => mark.kind === 'outlier')")
    assert page.value("__cocalib.plots.get('range').content.marks.map((mark) => mark.ids[0])") == ["c7"]
    check_contours(page)


def check_contours(page: Driver) -> None:
    """Lines and their labels come with the key, follow the distance, and go with the key."""
    before = image_of(page, "#marks")
    page.press("5")
    page.until("document.getElementById('contour-chips').getAttribute('aria-label').endsWith(' px')")
    at_20 = page.value("document.getElementById('contour-chips').getAttribute('aria-label')")
    drawn = image_of(page, "#marks")
    assert drawn != before
    page.page.click("[data-contours='5 m']")
    assert image_of(page, "#marks") != drawn
    assert page.value("document.getElementById('contour-chips').getAttribute('aria-label')") != at_20
    assert "95 %" in page.page.get_attribute("[data-contours='60 m']", "data-hint")
    page.press("5")
    page.until("document.getElementById('contour-chips').getAttribute('aria-label') === 'Uncertainty in the image'")


@pytest.mark.slow
def test_two_solutions_have_the_figures_of_the_check_command_and_both_are_drawn(
    reviewing: Driver, workspace: Workspace, tmp_path: Path
) -> None:
    page = reviewing
    now, other = tmp_path / "now.json", tmp_path / "other.json"
    now.write_text(download(page))
    page.value("__cocalib.goTo(0)")
    page.page.select_option("[data-side=b]", "before")
    page.until("document.querySelector('.compare .verdict').textContent.startsWith('There is no earlier answer')")
    workspace.dispatch(ClickExcluded("c2", excluded=True))
    page.settle()
    page.until("document.querySelectorAll('.compare td').length > 8")
    other.write_text(download(page))
    assert figures(page) == printed(now, against=other)

    page.page.set_input_files(".compare input[type=file]", now)
    page.until("document.querySelector('.compare .verdict').textContent.includes('B: now.json')")
    assert figures(page) == printed(now, against=other)
    assert "95 %" in page.text(".compare .verdict")
    both = image_of(page, "#marks")
    page.value(
        "(() => { const blend = document.querySelector('.blend input'); blend.value = '1'; blend.oninput(); })()"
    )
    assert image_of(page, "#marks") != both

    wrong = tmp_path / "wrong.json"
    wrong.write_text("{}")
    page.page.set_input_files(".compare input[type=file]", wrong)
    page.until("document.querySelector('.compare .verdict').textContent.includes('wrong.json')")
    assert page.page.locator(".compare td").count() == 0
