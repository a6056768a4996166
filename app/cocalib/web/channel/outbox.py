"""Messages waiting for one page: a newer one of a kind replaces the older one, so they do not pile up for a slow page."""

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Hashable
from typing import TypeAlias

Message: TypeAlias = str | bytes | Callable[[], str]
"""What is sent, or a function that writes it when it is sent."""

_MOST = 2000
"""A page that leaves more messages than this unread is considered gone."""


class Outbox:
    """Messages to one page, in order. Runs on one event loop."""

    def __init__(self) -> None:
        self._waiting: OrderedDict[Hashable, Message] = OrderedDict()
        self._something = asyncio.Event()
        self._number = 0

    def put(self, message: Message, *, kind: str | None = None) -> None:
        """Queue a message. One with a kind replaces a waiting one of the same kind; all others are sent."""
        self._number += 1
        key: Hashable = kind if kind is not None else self._number
        self._waiting.pop(key, None)
        self._waiting[key] = message
        self._something.set()

    def __len__(self) -> int:
        return len(self._waiting)

    async def deliver(self, send: Callable[[str | bytes], Awaitable[None]]) -> None:
        """Send the messages one by one, forever.

        Raises:
            BufferError: the page has left too many unread.
        """
        while True:
            await self._something.wait()
            while self._waiting:
                if len(self._waiting) > _MOST:
                    raise BufferError(f"the page has left {len(self._waiting)} messages unread")
                _, message = self._waiting.popitem(last=False)
                await send(message() if callable(message) else message)
            self._something.clear()
