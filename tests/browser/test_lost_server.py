"""With a server that is gone, the page says so, offers nothing that cannot work, and goes on when it is back."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.browser.driving import Driver

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]
DIALOG = "#page-deliver"
GONE = "The server is not responding. Your clicks are safe"


def _await_status(user: Page, address: str, status: int) -> None:
    """Wait until requests are answered with a status; 0 if not at all: the browser takes a new route a moment later."""
    answered = "([address, status]) => fetch(address).then((answer) => answer.status, () => 0).then((found) => found === status)"
    user.wait_for_function(answered, arg=[address, status])


def test_the_export_says_that_the_server_is_gone_or_fails_and_tries_again(page: Driver, truth: Any) -> None:
    page.load_sample(truth, 4)
    user = page.page
    save = user.locator(f"{DIALOG} .first")
    user.route(re.compile(r"/api/"), lambda route: route.abort("connectionrefused"))
    _await_status(user, "api/preview/none", 0)
    user.keyboard.press("e")
    expect(user.locator(f"{DIALOG} .text")).to_contain_text(GONE)
    for control in (save, user.get_by_role("button", name="Copy"), user.get_by_label("File name")):
        expect(control).to_be_disabled()
    user.unroute_all()
    _await_status(user, "api/preview/none", 404)
    user.get_by_role("button", name="Try again").click()
    expect(user.locator(f"{DIALOG} .text")).to_contain_text("camera_from_radar")
    expect(save).to_be_enabled()
    user.route(re.compile(r"/api/export/"), lambda route: route.abort("connectionreset"))
    _await_status(user, "api/export/none", 0)
    save.click()
    expect(user.locator(f"{DIALOG} .text")).to_contain_text(GONE)
    expect(save).to_be_disabled()
    user.unroute_all()
    _await_status(user, "api/export/none", 404)
    user.get_by_role("button", name="Try again").click()
    expect(save).to_be_enabled()
    with user.expect_download() as saving:
        save.click()
    assert saving.value.suggested_filename == "sample_calibration.json"
    user.route(re.compile(r"/api/preview/"), lambda route: route.fulfill(status=500, body=""))
    _await_status(user, "api/preview/none", 500)
    user.click(f'{DIALOG} [data-export="tf2"]')
    expect(user.locator(f"{DIALOG} .text")).to_contain_text("The server answered with error 500")
    expect(user.get_by_role("button", name="Try again")).to_be_visible()
    expect(save).to_be_disabled()
    page.drawn()
    page.forget_lost_connections()
    expected = ("ERR_CONNECTION_RESET", "status of 500", "status of 404")
    page.complaints[:] = [text for text in page.complaints if not any(words in text for words in expected)]


@pytest.mark.slow
def test_a_page_whose_formats_did_not_come_asks_for_them_again(
    open_page: Callable[..., Driver], server: Any, truth: Any
) -> None:
    page = open_page(server.url)
    user = page.page
    down = [True]
    user.route(
        re.compile(r"/api/formats"), lambda route: route.abort("connectionrefused") if down else route.continue_()
    )
    user.reload()
    page.until("__cocalib.state.shown")
    user.keyboard.press("e")
    expect(user.locator(f"{DIALOG} .formats [role=option]")).to_have_count(3)  # the clicks, the report and Rerun
    expect(user.locator(f"{DIALOG} .reason")).not_to_contain_text("Asking")
    down.clear()  # taking the route away could leave a request without an answer
    user.keyboard.press("Escape")
    user.keyboard.press("e")
    page.until(f"document.querySelectorAll('{DIALOG} .formats [role=option]').length > 10")
    page.drawn()
    page.forget_lost_connections()
