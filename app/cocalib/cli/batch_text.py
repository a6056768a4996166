"""What `cocalib batch` prints: progress while it runs, what came of it, and the table of results."""

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from calib_core.recordings import table_lines
from cocalib.platform.terminal import terminal_stream
from cocalib.view.wording import plain

if TYPE_CHECKING:
    from cocalib.batch.driving import BatchProgress
    from cocalib.batch.outcome import Outcome
    from cocalib.batch.results_table import BatchResults, SessionRow

_DASH = "–"
_LONGEST = 32
_STATUSES = {
    **{"solved": "solved", "weak": "in doubt", "refused": "refused"},
    **{"failed": "failed", "missing": "missing", "unreadable": "unreadable"},
}


def batch_lines(outcomes: "Sequence[Outcome]") -> list[str]:
    """Say what came of a batch: how many of each kind, then why there is no calibration, or one in doubt."""
    return [_counts(outcomes), *_why_lines(outcomes)]


def status_lines(table: "BatchResults") -> "Iterator[str]":
    """Return the table of results, and why there is no calibration, or one in doubt."""
    heads = ("vehicle", "session", "recorded", "verdict", "deg 95 %", "cm 95 %", "AED px")
    yield from table_lines([heads, *map(_cells, table.sessions)])
    yield ""
    yield _counts(table.sessions)
    yield from _why_lines(table.sessions)
    yield from table.unread


def _cells(row: "SessionRow") -> tuple[str, ...]:
    recorded = _DASH if row.recorded is None else row.recorded[:16].replace("T", " ")
    figures = (row.rotation_95_deg, row.position_95_cm, row.aed_px)
    numbers = (_DASH if figure is None else plain(figure, 2) for figure in figures)
    return _short(row.vehicle), _short(row.session), recorded, row.verdict or row.status, *numbers


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}…"


def _counts(rows: "Sequence[Outcome | SessionRow]") -> str:
    """Say how many sessions there are of each status."""
    counts = Counter[str](row.status for row in rows)
    kinds = ", ".join(f"{counts[status]} {name}" for status, name in _STATUSES.items() if counts[status])
    return f"{len(rows)} session{'' if len(rows) == 1 else 's'}: {kinds}"


def _why_lines(rows: "Sequence[Outcome | SessionRow]") -> "Iterator[str]":
    """Say of each session that is not solved why, and what to do."""
    for row in rows:
        if row.status != "solved":
            why = "; ".join(filter(None, (row.reason, row.hint)))
            yield f"  {row.vehicle}/{row.session}: {row.verdict or row.status}: {why}"


@contextmanager
def shown_batch(count: int) -> "Iterator[Callable[[BatchProgress], None]]":
    """Show on stderr how far a batch is: a bar with the time left on a terminal, else a line for each session.

    Args:
        count: of sessions.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    console = Console(file=terminal_stream(sys.stderr))
    if not console.is_terminal:
        yield _tell
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("sessions", total=count, left="")
        yield lambda now: bar.update(task, completed=now.done, left=_left_words(now.left_s))


def _left_words(left_s: float | None) -> str:
    """Say how long the rest takes; "" while that is unknown, and at the end."""
    if not left_s:
        return ""
    minutes, seconds = divmod(round(left_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min left" if hours else f"{minutes} min left" if minutes else f"{seconds} s left"


def _tell(now: "BatchProgress") -> None:
    if now.latest is None:
        words = f"{now.count} session{'' if now.count == 1 else 's'}"
        words = f"{now.done} of {words} done already" if now.done else words
    else:
        words = f"{now.done} of {now.count}: {now.latest.vehicle} / {now.latest.session}: {now.latest.status}"
        words += f" ({left})" if (left := _left_words(now.left_s)) else ""
    print(words, file=sys.stderr, flush=True)
