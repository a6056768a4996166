"""What `cocalib batch` prints: progress while it runs, and a table of what came of it."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cocalib.platform.terminal import terminal_stream

if TYPE_CHECKING:
    from cocalib.batch.driving import BatchProgress
    from cocalib.batch.outcome import Outcome

_KEYS_OF = {
    "--map": "map under [session.topics]",
    "--confirm-assumptions": "confirm_assumptions = true under [session.topics]",
    "--radar-topic": "radar_topic under [session.topics]",
    "--image-topic": "image_topic under [session.topics]",
    "--camera ": "camera",
    "--rescale-camera": "rescale_camera = true",
    "--camera-position-m": "camera_position_m",
}
"""The keys for flags that advice of the commands names."""


def batch_lines(outcomes: "Sequence[Outcome]") -> list[str]:
    """Say what came of a batch: how many of each kind, then why there is no calibration, or a weak one, a line for each."""
    counts = {
        status: sum(one.status == status for one in outcomes) for status in ("solved", "weak", "refused", "failed")
    }
    kinds = ", ".join(f"{count} {status}" for status, count in counts.items() if count)
    head = f"{len(outcomes)} session{'' if len(outcomes) == 1 else 's'}: {kinds}"
    rows = [(one.vehicle, one.session, one.status, _why(one)) for one in outcomes if one.status != "solved"]
    if not rows:
        return [head]
    titles = ("vehicle", "session", "status", "why")
    widths = [max(len(row[column]) for row in (titles, *rows)) for column in range(3)]
    lines = [
        "  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[3]])
        for row in (titles, *rows)
    ]
    named = [flag for flag in _KEYS_OF if any(flag in row[3] for row in rows)]
    keys = [f"in a manifest, {flag} is {_KEYS_OF[flag]}" for flag in named]
    return [head, "", *lines, *([""] if keys else []), *keys]


def _why(outcome: "Outcome") -> str:
    return f"{outcome.reason}; {outcome.hint}" if outcome.hint else outcome.reason


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
