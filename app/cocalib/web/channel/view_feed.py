"""The newest View, as text for each page: whole for a page that has none, else what differs from the one it has."""

from dataclasses import dataclass

from cocalib.view import View
from cocalib.web.messages import ViewChange, change_between, encode


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
        """Return the text to send to a page, and what the page has afterwards.

        Args:
            shown: what it has now; None if it has nothing, or does not know.
        """
        if shown is None:
            return encode(self._newest), Shown(self._newest)
        if self._change is None or shown.view is not self._before:  # pages usually have the same View
            self._before, self._change = shown.view, change_between(shown.view, self._newest, number=0)
        number = shown.changes + 1
        change = ViewChange(number, self._change.fields, self._change.clicks)
        return encode(change), Shown(self._newest, number)
