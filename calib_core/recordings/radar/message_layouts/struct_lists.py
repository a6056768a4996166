"""Lists of structs in a message, at any depth, and the lists of numbers next to each other."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.field_words.words import has_word, words_of
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition

_DEEPEST = 5
_COUNTS = ("count", "cnt", "num", "number", "n", "nr", "nof", "size", "len", "length", "total", "valid")


@dataclass(frozen=True, slots=True)
class ListPlace:
    """Where a list of structs is in a message.

    Attributes:
        path: field names from the message to the list.
        lists: which of these fields are lists themselves.
        element: type of the structs.
        scope: type of the message that the list is a field of.
        fixed: the list's fixed length; None if its length varies.
    """

    path: tuple[str, ...]
    lists: tuple[bool, ...]
    element: str
    scope: str
    fixed: int | None

    @property
    def name(self) -> str:
        """The path for display, such as "sensors[].targets"."""
        parts = [f"{name}[]" if many else name for name, many in zip(self.path[:-1], self.lists[:-1], strict=True)]
        return ".".join([*parts, self.path[-1]])

    @property
    def dotted(self) -> str:
        """The path as --map spells it."""
        return ".".join(self.path)

    @property
    def several(self) -> bool:
        """Whether the list is itself inside a list."""
        return any(self.lists[:-1])

    def parents(self, message: Message) -> list[Message]:
        """Return the messages that hold the list."""
        found = [message]
        for name, many in zip(self.path[:-1], self.lists[:-1], strict=True):
            inner = (one for parent in found for one in (parent.messages(name) if many else [parent.message(name)]))
            found = list(inner)
        return found


def struct_lists(definition: Definition) -> tuple[ListPlace, ...]:
    """Return all lists of structs in a message, the outer ones first."""
    return tuple(sorted(_inside(definition, definition.type, (), ()), key=lambda place: len(place.path)))


def _inside(definition: Definition, kind: str, path: tuple[str, ...], lists: tuple[bool, ...]) -> Iterator[ListPlace]:
    if len(path) >= _DEEPEST:
        return
    for field in definition.types[kind]:
        if field.type not in definition.types or field.type == "std_msgs/Header":
            continue
        here, many = (*path, field.name), field.count is not None
        if many:
            yield ListPlace(here, (*lists, True), field.type, kind, field.count or None)
        yield from _inside(definition, field.type, here, (*lists, many))


def count_field(definition: Definition, scope: str, fixed: int, name: str, parents: Sequence[Message]) -> str | None:
    """Return the field that counts the used elements of a fixed array; None if there is none.

    Args:
        definition: of the message.
        scope: type of the message that the array is a field of.
        fixed: the array's length.
        name: of the array; a count that shares a word with it is preferred.
        parents: a sample of messages of the type scope.
    """
    found = []
    for field in definition.types[scope]:
        if field.count is not None or PRIMITIVES.get(field.type, "f")[0] == "f" or not has_word(field.name, *_COUNTS):
            continue
        values = [parent.whole(field.name) for parent in parents]
        if values and all(0 <= value <= fixed for value in values):
            shared = len(set(words_of(field.name)) & set(words_of(name)))
            found.append((-shared, field.name))
    return min(found)[1] if found else None


def joined(columns: Sequence[np.ndarray]) -> np.ndarray:
    """Concatenate columns of several lists.

    Raises:
        MessageError: there is none.
    """
    if not columns:
        raise MessageError("a message has no list of returns")
    return columns[0] if len(columns) == 1 else np.concatenate(columns)
