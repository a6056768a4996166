"""A search for a board that can be interrupted and resumed: what was looked at is not looked at again."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from calib_core.interchange.own.board_views_json import BoardViews, runs_of
from calib_core.interchange.own.lens_documents import ImageSource
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_search import search_boards
from calib_core.intrinsics.coverage import BoardSearch, SearchProgress
from calib_core.measurements import Unsolvable
from cocalib.intrinsics.image_sources import OpenImages


class ResumedSearch:
    """Searches images in a thread of its own, so that Ctrl+C in the main thread stops it between two images."""

    def __init__(self, images: OpenImages, board: Board, source_name: str) -> None:
        """Set up the search.

        Args:
            images: where to look.
            board: what to look for.
            source_name: what messages call the images.
        """
        self._board = board
        self._images = images
        self._progress = SearchProgress(0, len(images))
        self._complete = False
        self.source = ImageSource(source_name, len(images), images.digest())

    def resume(self, earlier: BoardViews, *, file: str) -> None:
        """Go on from what an earlier search has found.

        Args:
            earlier: that search.
            file: where it was kept, for messages.

        Raises:
            InputError: it was for another board or in other images.
        """
        earlier.require_same(self._board, self.source, file=file)
        indices = earlier.searched_indices()
        self._progress = SearchProgress(len(indices), len(self._images), earlier.views, indices=indices)

    def run(self, progress: Callable[[SearchProgress], None]) -> BoardSearch | Unsolvable:
        """Search what was not searched earlier.

        Args:
            progress: called from another thread.

        Raises:
            KeyboardInterrupt: the user does not want to wait; `views` are what was found.
        """
        stop = threading.Event()

        def take(now: SearchProgress) -> None:
            self._progress = now
            progress(now)

        earlier = self._progress
        with ThreadPoolExecutor(1, "board search") as thread:
            future = thread.submit(
                search_boards,
                self._images,
                self._board,
                known=earlier.views,
                searched=earlier.indices,
                progress=take,
                stopped=stop.is_set,
            )
            try:
                found = future.result()
            except BaseException:
                stop.set()
                raise
        self._complete = not isinstance(found, BoardSearch) or found.complete
        return found

    @property
    def views(self) -> BoardViews:
        """What was found so far, to be kept in a file; images that could not be read are tried again."""
        now = self._progress
        searched = set(now.indices) - {one.index for one in now.left_out}
        return BoardViews(self._board, self.source, now.views, runs_of(searched), complete=self._complete)

    @property
    def looked_at(self) -> int:
        """How many images have been looked at, in earlier searches too."""
        return self._progress.searched
