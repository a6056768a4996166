"""The order of a vehicle's sessions: by the recording's time, else by the manifest."""

from collections.abc import Collection, Iterable

from cocalib.batch.outcome import Outcome

_Place = tuple[Outcome, int | None]


def current_and_superseded(rows: Iterable[_Place], wanted: Collection[str] = ()) -> tuple[list[_Place], list[_Place]]:
    """Return the result of each session of one vehicle that counts, in no order, and the others.

    That is the one that the latest batch wanted; of a session that no batch names, or whose job is not done, the latest one.

    Args:
        rows: each result with the session's place in the manifest.
        wanted: digests of the jobs that the latest batches wanted.
    """
    latest: dict[str, _Place] = {}
    others = []
    for row in sorted(rows, key=lambda row: (row[0].digest in wanted, *_run(row))):
        before = latest.get(row[0].session)
        if before is not None:
            others.append(before)
        latest[row[0].session] = row
    return list(latest.values()), others


def in_order(rows: Iterable[_Place]) -> list[_Place]:
    """Return the sessions of one vehicle in order of the recordings' first stamps.

    A session whose recording was never opened has no stamp. It comes right after the one before it in the manifest; one that
    the manifest does not name comes by its name, first.

    Args:
        rows: each result with the session's place in the manifest.
    """
    given = sorted(rows, key=lambda row: (row[1] is not None, row[1] or 0, row[0].session))
    before = min((row[0].recorded_ns for row in given if row[0].recorded_ns is not None), default=0) - 1
    keyed = []
    for count, row in enumerate(given):
        if row[0].recorded_ns is not None:
            before = row[0].recorded_ns
        keyed.append((before, row[0].recorded_ns is None, count, row))
    return [row for *_, row in sorted(keyed, key=lambda one: one[:3])]


def _run(row: _Place) -> tuple[str, str]:
    outcome = row[0]
    return outcome.run.started if outcome.run is not None else "", outcome.digest
