"""Work of which only the newest item matters: a frame while scrubbing, an overlay, a 3D view."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

from cocalib.platform.error_boundary import error_boundary

Item = TypeVar("Item")
_log = logging.getLogger(__name__)


class NewestWins(Generic[Item]):
    """Processes one item at a time; of those that arrive meanwhile, only the newest is kept. Runs on one event loop."""

    def __init__(self, work: Callable[[Item], Awaitable[None]], tell: Callable[[str], None] = _log.error) -> None:
        """Set up the work.

        Args:
            work: processes one item.
            tell: takes the line about an internal error in it.
        """
        self._work = work
        self._tell = tell
        self._next: list[Item] = []
        self._task: asyncio.Task[None] | None = None

    def give(self, item: Item) -> None:
        """Process this as soon as the current item is done."""
        self._next = [item]
        if self._task is None or self._task.done():  # done, but its callback has not run yet: it takes no more items
            self._task = asyncio.get_running_loop().create_task(self._run())
            self._task.add_done_callback(self._ended)

    def close(self) -> None:
        """Drop the waiting item and cancel the current one."""
        self._next = []
        if self._task is not None:
            self._task.cancel()

    async def _run(self) -> None:
        while self._next:
            with error_boundary("a picture or drawing for a page", self._tell):
                await self._work(self._next.pop())

    def _ended(self, task: "asyncio.Task[None]") -> None:
        if self._task is task:
            self._task = None
