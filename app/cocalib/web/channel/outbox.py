"""What waits for one page, of which only the newest matters, and what tells all pages of changes."""

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Hashable
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

from cocalib.platform.error_boundary import error_boundary
from cocalib.view.model import View
from cocalib.web.messages.outgoing import ViewChange, change_between, encode

Message: TypeAlias = str | bytes | Callable[[], str]
"""What is sent, or a function that writes it when it is sent; "" if there is nothing to send."""

_MOST = 2000
"""A page that leaves more messages than this unread is considered gone."""
_NOTICE_EVERY_S = 0.2
"""Pages are told of changes no more often [s]."""
Item = TypeVar("Item")
_log = logging.getLogger(__name__)


class Outbox:
    """Messages to one page, in order. Runs on one event loop."""

    def __init__(self) -> None:
        self._waiting: OrderedDict[Hashable, Message] = OrderedDict()
        self._something = asyncio.Event()
        self._number = 0

    def put(self, message: Message, *, kind: str | None = None) -> None:
        """Queue a message. One with a kind replaces a waiting one of the same kind; all others are sent.

        A function keeps the place of the one it replaces: what was queued behind it may rely on it.
        """
        self._number += 1
        key: Hashable = kind if kind is not None else self._number
        if not callable(message):
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
                if text := message() if callable(message) else message:
                    await send(text)
            self._something.clear()


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
            with error_boundary("an image or drawing for a page", self._tell):
                await self._work(self._next.pop())

    def _ended(self, task: "asyncio.Task[None]") -> None:
        if self._task is task:
            self._task = None


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """The View that a page has.

    Attributes:
        view: as of the last message.
        changes: how many changes were sent since the last whole View.
    """

    view: View
    changes: int = 0


class ViewFeed:
    """Writes messages from the View that a page has to the newest one. Runs on one event loop.

    A page is told where it stands when it can take the next message, so a slow page gets one change instead of many.
    """

    def __init__(self, view: View) -> None:
        self._newest = view
        self._before: View | None = None
        self._change: ViewChange | None = None

    @property
    def newest(self) -> View:
        """The newest View."""
        return self._newest

    def take(self, view: View) -> None:
        """Make this the newest View."""
        self._newest = view
        self._before = self._change = None

    def message(self, shown: Shown | None) -> tuple[str, Shown]:
        """Return the text to send to a page, "" if it has the newest View, and what the page has afterwards.

        Args:
            shown: what it has now; None if it has nothing, or does not know.
        """
        if shown is None:
            return encode(self._newest), Shown(self._newest)
        if self._change is None or shown.view is not self._before:  # pages usually have the same View
            self._before, self._change = shown.view, change_between(shown.view, self._newest, number=0)
        if not self._change.fields and self._change.clicks is None:
            return "", Shown(self._newest, shown.changes)
        number = shown.changes + 1
        change = ViewChange(number, self._change.fields, self._change.clicks)
        return encode(change), Shown(self._newest, number)


class Notice:
    """Tells all pages of changes that any thread makes, soon after them: on the event loop, from start to stop."""

    def __init__(self, tell: Callable[[], object]) -> None:
        """Set up the notice; tell is called on the event loop."""
        self._tell = tell
        self._loop: asyncio.AbstractEventLoop | None = None
        self._is_due = False

    def start(self) -> None:
        """Begin to tell the pages, on the running loop."""
        self._loop = asyncio.get_running_loop()

    def stop(self) -> None:
        """Tell the pages nothing more."""
        self._loop = None

    @property
    def is_on(self) -> bool:
        """Whether the pages are still told."""
        return self._loop is not None

    def give(self) -> None:
        """Take note of a change, in any thread; the pages are told shortly afterwards."""
        loop = self._loop
        if loop is None or self._is_due:
            return
        self._is_due = True
        try:
            loop.call_soon_threadsafe(loop.call_later, _NOTICE_EVERY_S, self._show)
        except RuntimeError:
            _log.debug("a change came after the server had stopped")

    def _show(self) -> None:
        self._is_due = False
        if self.is_on:
            self._tell()
