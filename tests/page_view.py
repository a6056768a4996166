"""The View as a page has it, from the messages it gets: the same steps as static/base/state.js, on decoded JSON."""

import json
from typing import Any

from websockets.sync.client import ClientConnection


def applied(view: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    """Return the View after a change."""
    rows = view["clicks"] if change["clicks"] is None else _rows(view["clicks"], change["clicks"])
    return {**view, **change["fields"], "clicks": rows}


def _rows(rows: list[dict[str, Any]], change: dict[str, Any]) -> list[dict[str, Any]]:
    following = [dict(row) for place, row in enumerate(rows) if place not in change["removed"]]
    for place in change["added"]:
        following.insert(place, {})
    for values in change["values"]:
        places = range(len(following)) if values["rows"] is None else values["rows"]
        for name, column in values["fields"].items():
            for place, value in zip(places, column, strict=True):
                following[place][name] = value
    return following


class PageView:
    """Follows the View on one socket."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._changes = 0
        self.view: dict[str, Any] = {}

    def next(self) -> dict[str, Any]:
        """Read on until the View changes; return it."""
        while True:
            text = self._socket.recv(timeout=20)
            message = json.loads(text) if isinstance(text, str) else {"type": "frame"}
            if message["type"] == "view":
                self.view, self._changes = message, 0
                return self.view
            if message["type"] == "view_change":
                assert message["number"] == self._changes + 1, "a change is missing"
                self.view, self._changes = applied(self.view, message), self._changes + 1
                return self.view
