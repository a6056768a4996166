"""The summary page: well-formed, escaped, without network, the same bytes for the same results."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from cocalib.fleet.reading import read_fleet
from cocalib.fleet.records import FleetRecord
from cocalib.fleet.summary_page import summary_html
from tests.unit.app.fleet.made_results import digest_of, make_fleet, make_result

_HTML = "{http://www.w3.org/1999/xhtml}"
_SVG = "{http://www.w3.org/2000/svg}"
_HOSTILE = "</script><img src=x onerror=alert(1)>\u202e&\"'"


def _parsed(fleet: FleetRecord) -> ElementTree.Element:
    return ElementTree.fromstring(summary_html(fleet).removeprefix("<!DOCTYPE html>\n"))


def _words(element: ElementTree.Element) -> str:
    return " ".join("".join(element.itertext()).split())


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> FleetRecord:
    folder = tmp_path_factory.mktemp("fleet")
    make_fleet(folder, 6, 3, moved={"V001": np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0])})
    make_result(folder, _HOSTILE, "<b>s0</b>", status="failed", reason="<i>no such file</i>", vehicle_type="<u>t</u>")
    make_result(folder, "V000", "s0", run=1)
    return read_fleet(folder)


def test_hostile_names_stay_text(fleet):
    page = _parsed(fleet)
    assert [page.findall(f".//{_HTML}{tag}") for tag in ("img", "i", "u")] == [[], [], []]
    assert len(page.findall(f".//{_HTML}script")) == 1
    words = _words(page)
    assert "</script><img src=x onerror=alert(1)>" in words
    assert "\u202e" not in words
    assert summary_html(fleet).count("</script") == 1


def test_only_its_own_script_may_run_and_nothing_is_fetched(fleet):
    text = summary_html(fleet)
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]+)"', text)
    assert policy[1].startswith("default-src &#x27;none&#x27;;")
    assert "script-src &#x27;sha256-" in policy[1]
    assert not re.search(r'(?:src|href)="(?:https?:)?//', text)
    assert "@import" not in text


def test_the_head_figures_count_what_is_in_the_tables_and_the_same_results_give_the_same_bytes(fleet):
    tiles = [_words(one) for one in _parsed(fleet).findall(f".//{_HTML}ul[@class='tiles']/{_HTML}li")]
    assert tiles[:5] == ["7vehicles", "19sessions", "18solved", "0weak", "0refused"]
    assert tiles[5:] == ["1failed", "1remounted", "1off their kind"]
    assert summary_html(fleet) == summary_html(fleet)
    assert "There are no results yet" in _words(_parsed(FleetRecord(())))


def test_reports_are_linked_relative_to_the_page_and_vehicles_to_their_rows(fleet):
    page = _parsed(fleet)
    links = [one.get("href", "") for one in page.iter(f"{_HTML}a")]
    assert f"results/{digest_of('V000', 's0', 1)}/report.html" in links
    assert f"results/{digest_of('V000', 's0')}/report.html" not in links
    ids = {one.get("id") for one in page.iter()}
    assert {link.removeprefix("#") for link in links if link.startswith("#")} <= ids


def test_rows_say_what_they_are_sorted_by(fleet):
    vehicles = _parsed(fleet).findall(f".//{_HTML}table[@class='sortable']")[0]
    heads = vehicles.findall(f"{_HTML}thead/{_HTML}tr/{_HTML}th")
    assert [one.get("aria-sort") for one in heads] == ["ascending", *["none"] * (len(heads) - 2), None]
    rows = vehicles.findall(f"{_HTML}tbody/{_HTML}tr")
    names = [_words(row[0]) for row in rows]
    assert names[:-1] == sorted(names[:-1]) or names == sorted(names)
    numbers = [index for index, head in enumerate(heads) if head.get("data-kind") == "number"]
    for row in rows:
        assert len(row) == len(heads)
        assert all(re.fullmatch(r"|-?[0-9.e+-]+", row[index].get("data-key", "missing")) for index in numbers)


def test_a_drift_is_drawn_with_the_remount_as_a_cross(fleet):
    rows = _parsed(fleet).findall(f".//{_HTML}table[@class='sortable']")[0].findall(f"{_HTML}tbody/{_HTML}tr")
    by_name = {_words(row[0]): row for row in rows}
    assert len(by_name["V000"].findall(f".//{_SVG}circle")) == 3
    assert len(by_name["V001"].findall(f".//{_SVG}circle")) == 2
    title = by_name["V001"].find(f".//{_SVG}title")
    assert "remounted 1 time" in (title.text or "")


@pytest.mark.parametrize("count", [1, 2])
def test_a_small_fleet_is_told(tmp_path, count):
    make_fleet(tmp_path, count, 2)
    words = _words(_parsed(read_fleet(tmp_path)))
    assert "Nothing: every vehicle's last session can be relied on." in words
    assert "required mountings: too few to tell how they scatter" in words
