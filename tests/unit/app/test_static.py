"""The page's files fit together, and depend only on each other."""

import re
from pathlib import Path

import pytest


@pytest.fixture
def static(project_root: Path) -> Path:
    return project_root / "static"


def scripts(static: Path) -> list[Path]:
    return sorted(static.rglob("*.js"))


def test_every_element_that_a_script_asks_for_is_on_the_page(static):
    page = (static / "index.html").read_text()
    ids = set(re.findall(r'\bid="([\w-]+)"', page))
    for script in scripts(static):
        for name in re.findall(r'(?:getElementById|(?<![.\w])(?:get|press|divider))\("([\w-]+)"', script.read_text()):
            assert name in ids, f"{script.name}: #{name}"


def test_every_control_of_the_page_has_a_name(static):
    page = (static / "index.html").read_text()
    for tag, content in re.findall(r"<button ([^>]*)>(.*?)</button>", page, re.S):
        named = "aria-label=" in tag or re.sub(r"<[^>]+>", "", content).strip()
        assert named or re.search(r"\bhidden$", tag), tag  # hidden until a script names it


def test_nothing_is_fetched_from_elsewhere_and_no_script_is_inline(static):
    for file in (path for path in static.rglob("*") if path.is_file()):
        text = file.read_text().replace("http://www.w3.org/", "")
        assert not re.search(r"https?://|//cdn|@import", text), file.name
    page = (static / "index.html").read_text()
    assert re.findall(r"<script(?![^>]*\bsrc=)", page) == []
    assert re.findall(r"\son\w+=|style=", page) == []


def test_text_of_a_recording_is_never_read_as_html(static):
    for script in scripts(static):
        assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(", script.read_text()), (
            script.name
        )
