"""Work of which only the newest item matters: a frame while scrubbing, an overlay, a 3D view."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

__all__ = ["NewestWins"]

Item = TypeVar("Item")
_log = logging.getLogger(__name__)


class NewestWins(Generic[Item]):
    """Processes one item at a time; of those that arrive meanwhile, only the newest is kept. Runs on one event loop."""

    def __init__(self, work: Callable[[Item], Awaitable[None]]) -> None:
        self._work = work
        self._next: list[Item] = []
        self._task: asyncio.Task[None] | None = None

    def give(self, item: Item) -> None:
        """Process this as soon as the current item is done."""
        self._next = [item]
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._run())
            self._task.add_done_callback(self._ended)

    def close(self) -> None:
        """Drop the waiting item and cancel the current one."""
        self._next = []
        if self._task is not None:
            self._task.cancel()

    async def _run(self) -> None:
        while self._next:
            await self._work(self._next.pop())

    def _ended(self, task: "asyncio.Task[None]") -> None:
        self._task = None
        if not task.cancelled() and (error := task.exception()) is not None:
            _log.error("work for a page failed", exc_info=error)
