"""What axe-core finds wrong with a page for people who use a screen reader, a keyboard or little contrast."""

from axe_core_python.base import AXE_SCRIPT
from playwright.sync_api import Page

from tests.browser.driving import Driver

__all__ = ["page_violations", "violations"]


def violations(driver: Driver) -> list[str]:
    """Return each violation as "rule: element, what is wrong". The 3D view is viser's own page and is left out."""
    return page_violations(driver.page)


def page_violations(page: Page) -> list[str]:
    """Return the same of any page."""
    if not page.evaluate("() => Boolean(window.axe)"):
        page.evaluate("() => {" + AXE_SCRIPT + "}")  # the page's policy forbids eval, so it goes in as a function
    found = page.evaluate("() => axe.run({exclude: [['iframe']]}, {resultTypes: ['violations'], iframes: false})")
    return [
        f"{rule['id']}: {' '.join(node['target'])}, {node['failureSummary']}"
        for rule in found["violations"]
        for node in rule["nodes"]
    ]
