"""The words of a few representative views, in one file: `python -m tests.unit.app.view.test_words` writes them again."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from calib_core.diagnostics.next_placement import Coverage, Place
from calib_core.measurements import Unsolvable
from calib_core.results import DataWarning, NextPlacement
from cocalib.session import ClickExcluded, History
from cocalib.view import Pace, View, advice_words, pace_words, view
from tests.unit.app.view.test_view import ASKING, EVERY_STATE, FACTS, FIVE, UNSEEN, calibration, clicked, pair, shown

KEPT = Path(__file__).with_name("words.txt")


def _views() -> Iterator[tuple[str, View]]:
    yield "nothing clicked", view(History(), FACTS)
    for count in (1, 3, 4):
        yield f"clicks: {count}", view(clicked(count), FACTS)
    yield "four clicks, one excluded", view(clicked(4, ClickExcluded("c2", True)), FACTS)
    yield "five clicks agree", shown(5, calibration(*FIVE))
    yield "four of five agree", shown(5, calibration(*FIVE[:4], pair("c5", inlier=False)))
    yield "one excluded", shown(5, calibration(*FIVE[:4], pair("c5", excluded=True)))
    yield "being checked", shown(5, calibration(*FIVE, checking=True))
    yield "no pose", shown(5, Unsolvable("no-pose", "only 3 of 5 pairs agree on any pose", "spread the placements"))
    yield "no intrinsics", shown(1, Unsolvable("no-camera", "the intrinsics are missing", "give --camera"))
    yield "clicks that the radar did not see", shown(5, UNSEEN)
    yield "a click in every state", shown(5, EVERY_STATE, ClickExcluded("c3", True))
    yield "a click that two returns fit", shown(5, calibration(*FIVE[:4], ASKING))
    yield "a warning", shown(5, calibration(*FIVE, warnings=(DataWarning("few-pairs", "only 5 pairs", "add some"),)))


def _best(x_m: float, y_m: float, *, may_stop: bool) -> NextPlacement:
    return NextPlacement(np.array([x_m, y_m, 0.0]), np.array([1.0, 2.0]), 1.2, may_stop)


def _while_following() -> Iterator[str]:
    yield "# a recording that is still being written: how fresh it is, and where to go next"
    yield pace_words(Pace("live"))
    yield pace_words(Pace("live", age_s=0.42))
    yield pace_words(Pace("live", every_s=2.13, age_s=2.5))
    yield pace_words(Pace("live", every_s=0.2))
    yield pace_words(Pace("quiet", quiet_s=12.4))
    yield pace_words(Pace("complete"))
    yield pace_words(Pace("ended", problem="Drive.mcap: was truncated."))
    yield advice_words(Coverage(11, Place("left", 10.0, 15.0), one_height=False), None)
    yield advice_words(Coverage(22, Place("right", 2.0, 5.0), one_height=True), None)
    yield advice_words(Coverage(21, None, one_height=False), None)
    yield advice_words(Coverage(6, Place("left", 2.0, 5.0), one_height=False), _best(8.0, -3.0, may_stop=False))
    yield advice_words(Coverage(1, None, one_height=False), _best(8.0, 0.1, may_stop=True))


def _lines(name: str, seen: View) -> Iterator[str]:
    yield f"# {name}"
    yield f"status: {seen.status or 'none'}"
    yield f"verdict: {seen.verdict.line}"
    yield f"action: {seen.verdict.action}"
    yield from (f"{one.key}: {one.label}. {one.hint}" for one in seen.metrics)
    yield from (f"{row.id}: {row.note}" for row in seen.clicks if row.note)


def words() -> str:
    pages = [*(_lines(name, seen) for name, seen in _views()), _while_following()]
    return "\n\n".join("\n".join(lines) for lines in pages) + "\n"


def test_the_words_of_the_views_are_those_that_were_kept():
    assert words() == KEPT.read_text(encoding="utf-8"), "run: python -m tests.unit.app.view.test_words"


if __name__ == "__main__":
    KEPT.write_text(words(), encoding="utf-8")
