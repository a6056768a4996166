"""Search for the board while the terminal shows how far it is; what was found survives Ctrl+C."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from calib_core.input_files import read_text
from calib_core.interchange.own.board_views_json import read_board_views, write_board_views
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.coverage import BoardSearch, SearchProgress
from calib_core.measurements import Unsolvable
from cocalib.intrinsics.image_sources import OpenImages
from cocalib.intrinsics.resumed_search import ResumedSearch
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import terminal_stream

_DEFAULT_VIEWS = Path("board-views.json")
_LINE_EVERY_S = 5.0


def search_for(images: OpenImages, board: Board, name: str, views: Path | None) -> ResumedSearch:
    """Set up the search; go on from the views in a file, if it is there.

    Raises:
        InputError: the file is for another board or other images.
    """
    search = ResumedSearch(images, board, name)
    if views is not None and views.exists():
        search.resume(read_board_views(read_text(views, is_what="a file of board views"), str(views)), file=str(views))
        print(f"{views}: {search.looked_at} of {len(images)} images have been searched", file=sys.stderr)
    return search


def searched(search: ResumedSearch, views: Path | None) -> BoardSearch | Unsolvable:
    """Search, and write the views to a file if one is given."""
    with _shown_progress() as show:
        found = search.run(show)
    if views is not None:
        write_whole(views, write_board_views(search.views))
    return found


@contextmanager
def kept_on_interruption(search: ResumedSearch, views: Path | None) -> Iterator[None]:
    """Keep what was found in a file when the user stops the command, and say how to go on."""
    try:
        yield
    except KeyboardInterrupt:
        found, path = search.views, views or _DEFAULT_VIEWS
        if not found.views:
            print("\ncocalib: stopped; no view of the board was found so far, nothing is kept", file=sys.stderr)
            raise
        write_whole(path, write_board_views(found))
        print(
            f"\ncocalib: stopped after {search.looked_at} of {search.source.images} images, with {len(found.views)} views of "
            f"the board; they are kept in {path}: give the same command with --views {path} to go on",
            file=sys.stderr,
        )
        raise


@contextmanager
def _shown_progress() -> Iterator[Callable[[SearchProgress], None]]:
    """Show how far a search is: one line that changes on a terminal, else a line every few seconds."""
    from rich.console import Console
    from rich.live import Live

    console = Console(file=terminal_stream(sys.stderr))
    if not console.is_terminal:
        yield _EveryFewSeconds()
        return
    with Live(console=console, transient=True, refresh_per_second=4) as live:
        yield lambda progress: live.update(_line(progress))


class _EveryFewSeconds:
    """Prints how far a search is, but not often."""

    def __init__(self) -> None:
        self._next = time.monotonic() + _LINE_EVERY_S

    def __call__(self, progress: SearchProgress) -> None:
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + _LINE_EVERY_S
            print(_line(progress), file=sys.stderr, flush=True)


def _line(progress: SearchProgress) -> str:
    """Say how far a search is, and what is missing."""
    said = f"{progress.searched} of {progress.total} images searched, {len(progress.views)} views of the board"
    if progress.left_out:
        said += f", {len(progress.left_out)} left out"
    coverage = progress.coverage
    if coverage is not None and progress.views:
        said += f", {100.0 * coverage.share:.0f} % of the image covered"
        if coverage.missing:
            said += f"; missing: {coverage.missing[0]}"
    return said
