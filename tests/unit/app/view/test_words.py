"""The words of a few representative views, in one file: `python -m tests.unit.app.view.test_words` writes them again."""

from collections.abc import Iterator
from pathlib import Path

from calib_core.measurements import Unsolvable
from cocalib.session import ClickExcluded, History
from cocalib.view import View, view
from tests.unit.app.view.test_view import FACTS, FIVE, calibration, clicked, pair, shown

KEPT = Path(__file__).with_name("words.txt")


def _views() -> Iterator[tuple[str, View]]:
    yield "nothing clicked", view(History(), FACTS)
    yield "three clicks", view(clicked(3), FACTS)
    yield "four clicks, one excluded", view(clicked(4, ClickExcluded("c2", True)), FACTS)
    yield "five clicks agree", shown(5, calibration(*FIVE))
    yield "four of five agree", shown(5, calibration(*FIVE[:4], pair("c5", inlier=False)))
    yield "one excluded", shown(5, calibration(*FIVE[:4], pair("c5", excluded=True)))
    yield "being checked", shown(5, calibration(*FIVE, checking=True))
    yield "no pose", shown(5, Unsolvable("no-pose", "only 3 of 5 pairs agree on any pose", "spread the placements"))


def _lines(name: str, seen: View) -> Iterator[str]:
    yield f"# {name}"
    yield f"status: {seen.status}"
    yield f"hint: {seen.hint or 'none'}"
    yield f"verdict: {seen.verdict.line}"
    yield f"action: {seen.verdict.action}"
    yield from (f"{one.key}: {one.label}. {one.hint}" for one in seen.metrics)
    yield from (f"{row.id}: {row.note}" for row in seen.clicks if row.note)


def words() -> str:
    return "\n\n".join("\n".join(_lines(name, seen)) for name, seen in _views()) + "\n"


def test_the_words_of_the_views_are_those_that_were_kept():
    assert words() == KEPT.read_text(encoding="utf-8"), "run: python -m tests.unit.app.view.test_words"


if __name__ == "__main__":
    KEPT.write_text(words(), encoding="utf-8")
