"""What differs between two Views: a click among thousands is sent as one row, and an answer as columns of new values."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any

from cocalib.view import ClickRow, View

_VIEW_FIELDS = tuple(field.name for field in fields(View) if field.name != "clicks")
_ROW_FIELDS = tuple(field.name for field in fields(ClickRow))
_row_values = attrgetter(*_ROW_FIELDS)


@dataclass(frozen=True, slots=True)
class RowValues:
    """New values of some fields in some rows.

    Attributes:
        rows: places in the new list, ascending; None for all of them.
        fields: for each field, one value per row.
    """

    rows: tuple[int, ...] | None
    fields: dict[str, tuple[Any, ...]]


@dataclass(frozen=True, slots=True)
class ClickChange:
    """How the list of clicks changes: rows are removed, then added, then given values.

    Attributes:
        removed: places in the old list, ascending.
        added: places in the new list, ascending; `values` has every field of these rows.
        values: what differs; fields that differ in the same rows stand together.
    """

    removed: tuple[int, ...]
    added: tuple[int, ...]
    values: tuple[RowValues, ...]


@dataclass(frozen=True, slots=True)
class ViewChange:
    """What a page changes in the View it has.

    Attributes:
        number: 1 for the first change after a whole View, and so on; a page that misses one asks for a whole View.
        fields: the new values of the View's fields that differ, except `clicks`.
        clicks: the rows that differ; None if none does.
    """

    number: int
    fields: dict[str, Any]
    clicks: ClickChange | None


def change_between(before: View, after: View, *, number: int) -> ViewChange:
    """Return what a page that shows `before` needs in order to show `after`.

    Args:
        before: the View that the page has.
        after: the View that it is to have.
        number: counts the changes since the last whole View.
    """
    different = {name: value for name in _VIEW_FIELDS if (value := getattr(after, name)) != getattr(before, name)}
    return ViewChange(number, different, _click_change(before.clicks, after.clicks))


def _click_change(before: Sequence[ClickRow], after: Sequence[ClickRow]) -> ClickChange | None:
    removed, added = _membership([row.id for row in before], [row.id for row in after])
    is_added = set(added)
    places = [place for place in range(len(after)) if place not in is_added]
    is_removed = set(removed)
    kept = [row for place, row in enumerate(before) if place not in is_removed]
    rows: dict[str, list[int]] = {name: list(added) for name in _ROW_FIELDS}
    for place, old in zip(places, kept, strict=True):
        if after[place] is not old:
            for name in _differing(old, after[place]):
                rows[name].append(place)
    values = tuple(_values(rows, after))
    return ClickChange(tuple(removed), tuple(added), values) if removed or added or values else None


def _membership(before: Sequence[str], after: Sequence[str]) -> tuple[list[int], list[int]]:
    """Return the places of the ids to remove and to add; the whole lists if those that stay are in another order."""
    if before == after:
        return [], []
    old, new = set(before), set(after)
    staying = [name for name in before if name in new] == [name for name in after if name in old]
    if not staying or len(old) < len(before) or len(new) < len(after):
        return list(range(len(before))), list(range(len(after)))
    return (
        [place for place, name in enumerate(before) if name not in new],
        [place for place, name in enumerate(after) if name not in old],
    )


def _differing(old: ClickRow, new: ClickRow) -> Iterator[str]:
    pairs = zip(_ROW_FIELDS, _row_values(old), _row_values(new), strict=True)
    return (name for name, before, after in pairs if before != after)


def _values(rows: dict[str, list[int]], after: Sequence[ClickRow]) -> Iterable[RowValues]:
    """Yield the new values, fields that differ in the same rows together."""
    together: dict[tuple[int, ...], list[str]] = {}
    for name, places in rows.items():
        if 2 * len(places) > len(after):
            places = list(range(len(after)))  # shorter to write than most of the places
        if places:
            together.setdefault(tuple(sorted(places)), []).append(name)
    for chosen, names in together.items():
        columns = {name: tuple(getattr(after[place], name) for place in chosen) for name in names}
        yield RowValues(None if len(chosen) == len(after) else chosen, columns)
