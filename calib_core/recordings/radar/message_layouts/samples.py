"""A few messages of a topic, to judge a layout by its values."""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition
from calib_core.recordings.radar.column_guess import DescribedColumn

_SCANS = 9
_STANDARD = "geometry_msgs/"


class Samples:
    """Messages of one topic, read only when a layout cannot be recognized by names alone.

    Args:
        definition: of the messages.
        payload: one whole message.
        more: returns up to the given number of messages spread over the topic.
    """

    def __init__(
        self, definition: Definition, payload: bytes, more: Callable[[int], Sequence[bytes]] | None = None
    ) -> None:
        self.definition = definition
        self.payload = payload
        self._more = more

    def payloads(self, count: int = _SCANS) -> Sequence[bytes]:
        """Return at most count messages."""
        return self._more(count) if self._more else (self.payload,)

    @cached_property
    def messages(self) -> tuple[Message, ...]:
        """A few decoded messages; unreadable ones are left out."""
        return self.decoded(_SCANS)

    def decoded(self, count: int) -> tuple[Message, ...]:
        """Return at most count decoded messages; unreadable ones are left out."""
        found = []
        for payload in self.payloads(count):
            try:
                found.append(decode(self.definition, payload))
            except MessageError:
                continue
        return tuple(found)


def leaf_names(definition: Definition, kind: str, prefix: str = "") -> tuple[list[str], list[str]]:
    """Return the dotted names of all single numbers of a type, and of all fixed arrays and strings."""
    numbers: list[str] = []
    others: list[str] = []
    for field in definition.types[kind]:
        if field.type in PRIMITIVES or field.type == "string":
            single = field.count is None and field.type in PRIMITIVES
            if single or field.count != 0:
                (numbers if single else others).append(prefix + field.name)
        elif field.count is None:
            more = leaf_names(definition, field.type, f"{prefix}{field.name}.")
            numbers.extend(more[0])
            others.extend(more[1])
    return numbers, others


def described(
    definition: Definition,
    kind: str,
    names: Sequence[str],
    values: Callable[[str], np.ndarray] = lambda name: np.zeros(0),
) -> list[DescribedColumn]:
    """Describe the numbers of a type.

    Args:
        definition: of the message.
        kind: the type that has the fields.
        names: their dotted names.
        values: returns the values of a name in a sample; without it there are none.
    """
    columns = []
    for name in names:
        owner, comments = kind, []
        for part in name.split("."):
            field = next(one for one in definition.types[owner] if one.name == part)
            comments.append(field.comment)
            standard, owner = owner.startswith(_STANDARD), field.type
        integer = PRIMITIVES.get(owner, "f8")[0] != "f"
        columns.append(
            DescribedColumn(name, integer, "; ".join(filter(None, reversed(comments))), values(name), standard)
        )
    return columns
