"""Sessions are in order of their recordings; those without a time stay where the manifest has them."""

import random

from hypothesis import given
from hypothesis import strategies as st

from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeRun
from cocalib.fleet.session_order import current_and_superseded, in_order

_TIMES = st.none() | st.integers(0, 20)
_ROWS = st.lists(st.tuples(_TIMES, st.none() | st.integers(0, 20)), min_size=1, max_size=8)


def _outcome(session: str, recorded_ns: int | None, *, digest: str = "d", started: str = "") -> Outcome:
    run = OutcomeRun("host", started, 1.0) if started else None
    return Outcome(OUTCOME_SCHEMA, digest, "V", session, "solved", recorded_ns=recorded_ns, run=run)


@given(_ROWS, st.randoms())
def test_times_grow_and_the_order_of_arrival_does_not_matter(
    given: list[tuple[int | None, int | None]], shuffle: random.Random
) -> None:
    rows = [(_outcome(f"s{index}", time), place) for index, (time, place) in enumerate(given)]
    ordered = in_order(rows)
    times = [outcome.recorded_ns for outcome, _ in ordered if outcome.recorded_ns is not None]
    assert times == sorted(times)
    shuffle.shuffle(rows)
    assert in_order(rows) == ordered


@given(st.lists(st.integers(0, 20), min_size=1, max_size=8, unique=True))
def test_without_any_time_the_manifest_decides(places: list[int]) -> None:
    rows = [(_outcome(f"s{place}", None), place) for place in places]
    assert [place for _, place in in_order(rows)] == sorted(places)


def test_the_latest_run_of_a_session_counts() -> None:
    runs = [
        (_outcome("s0", 5, digest="b", started="2026-11-02T00:00:00+00:00"), 0),
        (_outcome("s0", 5, digest="a", started="2026-11-03T00:00:00+00:00"), 0),
        (_outcome("s1", 6, digest="c", started="2026-11-01T00:00:00+00:00"), 1),
    ]
    current, superseded = current_and_superseded(runs)
    assert {outcome.digest for outcome, _ in current} == {"a", "c"}
    assert [outcome.digest for outcome, _ in superseded] == ["b"]
