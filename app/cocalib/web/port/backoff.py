"""A growing delay after wrong tokens, so that a token cannot be found by trying; admitted pages are not affected."""

import asyncio
import time
from collections.abc import Callable

_FREE_TRIES = 5
_FIRST_DELAY_S = 0.25
_LONGEST_DELAY_S = 8.0
_FORGOTTEN_AFTER_S = 300.0
_MOST_WAITING = 8


class Backoff:
    """Lets tokens be tried one after another, ever more slowly while they are wrong. Runs on one event loop."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._wrong = 0
        self._last_wrong = now()
        self._waiting = 0
        self._turn: asyncio.Lock | None = None

    @property
    def delay_s(self) -> float:
        """How long the next try has to wait [s]."""
        if self._now() - self._last_wrong > _FORGOTTEN_AFTER_S:
            self._wrong = 0
        late = self._wrong - _FREE_TRIES
        return 0.0 if late < 0 else min(_LONGEST_DELAY_S, _FIRST_DELAY_S * 2.0 ** min(late, 10))

    async def turn(self) -> bool:
        """Wait for the turn of a try; return False if too many are waiting already."""
        if self._waiting >= _MOST_WAITING:
            return False
        self._turn = self._turn or asyncio.Lock()
        self._waiting += 1
        try:
            async with self._turn:
                await asyncio.sleep(self.delay_s)
        finally:
            self._waiting -= 1
        return True

    def wrong(self) -> None:
        """Note a wrong token."""
        self._wrong += 1
        self._last_wrong = self._now()

    def right(self) -> None:
        """Note a right token: the delay ends."""
        self._wrong = 0
