"""What `propose` and `solve --auto` share: the size of the reflector, and the progress of the search."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from calib_core.errors import InputError
from calib_core.proposing import ViewProgress
from cocalib.platform.terminal import terminal_stream

_LEAST_M, _MOST_M = 0.02, 2.0


def checked_reflector_m(reflector_m: float) -> float:
    """Return the width of the reflector.

    Raises:
        InputError: no corner reflector has it.
    """
    if not _LEAST_M <= reflector_m <= _MOST_M:
        raise InputError(
            f"--reflector-m {reflector_m:g}: give the width of the reflector as the camera sees it, "
            f"from {_LEAST_M:g} to {_MOST_M:g} m"
        )
    return reflector_m


@contextmanager
def shown_progress() -> Iterator[Callable[[ViewProgress | str], None]]:
    """Show on stderr how far the search for proposals is: a bar on a terminal, else a line for each step."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(file=terminal_stream(sys.stderr))
    if not console.is_terminal:
        yield _tell_step
        return
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("searching for proposals", total=None)

        def show(progress: ViewProgress | str) -> None:
            if isinstance(progress, str):
                bar.update(task, description=progress)
            else:
                bar.update(task, description="looking at the pictures", completed=progress.done, total=progress.count)

        yield show


def _tell_step(progress: ViewProgress | str) -> None:
    """Print the beginning of each step; of the pictures only the first and the last dwell."""
    if isinstance(progress, str):
        print(f"{progress} ...", file=sys.stderr, flush=True)
    elif progress.done in (1, progress.count):
        print(f"looking at the pictures: {progress.done} of {progress.count} placements", file=sys.stderr, flush=True)
