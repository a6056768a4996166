"""Tables that can be sorted: heads with a button, cells with the value that they are sorted by."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite

from calib_core.fleet import Transition
from cocalib.fleet.records import SessionRecord
from cocalib.report.markup import Child, Markup, scrolled, tag
from cocalib.report.sections.answer import LEVEL_SIGNS
from cocalib.view.wording import plain, with_sigma

_DASH = "–"
_LONG = 20
"""Longer names may be broken into lines."""
_BAD = ("weak", "contradictory", "nothing", "refused", "failed")
_ORDER = ("good", "usable", "weak", "contradictory", "nothing", "refused", "failed")
_OTHER_SIGNS = {"refused": "□", "failed": "✕"}
_OUTCOMES = {"remounted": "remounted", "unchanged": "unchanged", "cannot-tell": "cannot tell"}


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    Attributes:
        head: its name.
        is_number: sorted as a number.
        class_: how it is laid out, if not as what it is sorted as.
        about: what it means, shown on hover; "" if the name says it.
        sortable: whether a button sorts by it.
    """

    head: str
    is_number: bool = False
    class_: str = ""
    about: str = ""
    sortable: bool = True


def sortable(name: str, columns: Sequence[Column], rows: Iterable[Markup], *, sorted_by: int = 0) -> Markup:
    """Return a table in a frame of its own that scrolls on a narrow screen.

    Args:
        name: for a screen reader.
        columns: from left to right.
        rows: its body.
        sorted_by: the column that the rows are in order of.
    """
    heads = (_head(column, is_sorted=index == sorted_by) for index, column in enumerate(columns))
    return scrolled(name, tag("thead", tag("tr", *heads)), tag("tbody", *rows), class_="sortable")


def _head(column: Column, *, is_sorted: bool) -> Markup:
    if not column.sortable:
        return tag("th", column.head, scope="col")
    return tag(
        "th",
        tag("button", column.head, type="button", title=column.about or None),
        scope="col",
        class_=column.class_ or ("number" if column.is_number else None),
        data_kind="number" if column.is_number else None,
        aria_sort="ascending" if is_sorted else "none",
    )


def words_cell(words: str | None, *, class_: str = "") -> Markup:
    """Return a cell of text; a dash where nothing is known."""
    class_ = class_ or ("words" if words and len(words) > _LONG else "state")
    return tag("td", words or _DASH, class_=class_, data_key=words or "")


def number_cell(value: float | None, shown: str | None = None) -> Markup:
    """Return a cell with a number, or with what is shown for it; a dash where nothing is known."""
    if value is None or not isfinite(value):
        return tag("td", _DASH, class_="number", data_key="")
    return tag("td", shown or plain(value, 2), class_="number", data_key=repr(float(value)))


def sigma_cells(record: SessionRecord) -> list[Markup]:
    """Return the standard deviations of the answer [deg], [cm]."""
    return [number_cell(record.outcome.sigma_deg), number_cell(record.outcome.sigma_cm)]


def verdict_cell(record: SessionRecord) -> Markup:
    """Return the verdict, or why there is none, as a shape and a word."""
    outcome = record.outcome
    level = outcome.verdict if outcome.verdict in LEVEL_SIGNS else outcome.status
    sign = LEVEL_SIGNS.get(level) or _OTHER_SIGNS.get(level, "●")
    key = _ORDER.index(level) if level in _ORDER else len(_ORDER)
    parts: list[Child] = [tag("span", sign, class_="sign", aria_hidden="true"), level]
    return tag("td", *parts, class_=f"state{' bad' if level in _BAD else ''}", data_key=str(key))


def change_cells(change: Transition | None) -> list[Markup]:
    """Return the change in deg, cm and px, and what it means."""
    if change is None:
        return [number_cell(None), number_cell(None), number_cell(None), words_cell(None)]
    return [
        number_cell(change.rotation_deg, with_sigma(change.rotation_deg, change.rotation_sigma_deg)),
        number_cell(change.position_cm, with_sigma(change.position_cm, change.position_sigma_cm)),
        number_cell(change.picture_px, with_sigma(change.picture_px, change.picture_sigma_px)),
        words_cell(_OUTCOMES[change.outcome], class_="state bad" if change.is_remount else "state"),
    ]


def report_cell(record: SessionRecord) -> Markup:
    """Return the link to a session's report, relative to the page."""
    if record.report is None:
        return tag("td", _DASH)
    name = f"Report on {record.outcome.vehicle}, {record.name}"
    return tag("td", tag("a", "report", href=record.report, aria_label=name))
