"""Read radar messages that hold their returns as parallel arrays of equal length (Delphi's Ethernet driver, vendors' own)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition
from calib_core.recordings.radar.column_mapping import StatedReading
from calib_core.recordings.radar.column_plan import ColumnPlan
from calib_core.recordings.radar.column_plans import find_decoder, plan_described, plan_for
from calib_core.recordings.radar.columns import Returns, no_returns, returns_from
from calib_core.recordings.radar.message_layouts.samples import Samples
from calib_core.recordings.radar.message_layouts.struct_lists import count_field
from calib_core.recordings.radar.self_describing.candidates import DescribedColumn

_NOTHING = StatedReading()


@dataclass(frozen=True, slots=True, eq=False)
class ArrayLayout:
    """Reads messages of arrays side by side.

    Attributes:
        definition: of the message.
        plan: which arrays are used.
        count_field: how many elements of the arrays hold returns; None if all do.
        scope: path of the nested message that holds the arrays; empty for the message itself.
    """

    definition: Definition
    plan: ColumnPlan
    count_field: str | None
    scope: tuple[str, ...] = ()

    one_per_message = False
    lidar_like = False

    @classmethod
    def recognise(
        cls, definition: Definition, samples: Samples | None = None, stated: StatedReading = _NOTHING
    ) -> "ArrayLayout | None":
        """Recognise a message by its arrays: by the registry, or by what they say about themselves."""
        names = [field.name for field in definition.fields if field.count and field.type in PRIMITIVES]
        decoder, plan = find_decoder("arrays", names), plan_for("arrays", names)
        if decoder is not None and plan is not None:
            count = decoder.count_field if decoder.count_field in definition.names else None
            within = stated.within("", names)
            return cls(definition, within.applied(plan) or plan, count) if within else None
        if samples is None:
            return None
        scopes = _scopes(definition, definition.type, ())
        return next((one for path, kind in scopes if (one := _arrays_in(samples, path, kind, stated))), None)

    @property
    def description(self) -> str:
        """Describe what is read."""
        where = f" in '{'.'.join(self.scope)}'" if self.scope else ""
        return f"parallel arrays{where}: {self.plan.describe()}"

    def returns(self, payload: bytes) -> Returns:
        """Read one scan.

        Raises:
            MessageError: the bytes do not fit the definition.
        """
        message = _within(decode(self.definition, payload), self.scope)
        count = message.whole(self.count_field) if self.count_field else None
        if count == 0 or not message.count(self.plan.position[0]):
            return no_returns()
        length = message.count(self.plan.position[0])
        return returns_from(self.plan, lambda name: message.numbers(name, length)[:count])

    def with_plan(self, plan: ColumnPlan) -> "ArrayLayout":
        """Return the same layout with another plan."""
        return replace(self, plan=plan)

    def for_definition(self, definition: Definition) -> "ArrayLayout | None":
        """Return the same layout for another file's definition; None if that lacks an array in use."""
        kind = dict(_scopes(definition, definition.type, ())).get(self.scope)
        names = {field.name for field in definition.types[kind]} if kind else set()
        fits = set(self.plan.columns) <= names and (self.count_field is None or self.count_field in names)
        return replace(self, definition=definition) if fits else None


def _within(message: Message, path: Sequence[str]) -> Message:
    for name in path:
        message = message.message(name)
    return message


def _scopes(definition: Definition, kind: str, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Return the message and all nested messages that are not in lists, with their types."""
    yield path, kind
    for field in definition.types[kind] if len(path) < 4 else ():
        if field.type in definition.types and field.count is None and field.type != "std_msgs/Header":
            yield from _scopes(definition, field.type, (*path, field.name))


def _arrays_in(samples: Samples, path: tuple[str, ...], kind: str, stated: StatedReading) -> ArrayLayout | None:
    """Return the reader of the arrays of one message if they hold a radar's returns or the columns that the user maps."""
    definition = samples.definition
    fields = [field for field in definition.types[kind] if field.count is not None and field.type in PRIMITIVES]
    named = [DescribedColumn(field.name, False, "", np.zeros(0)) for field in fields]
    if not stated.column_map and plan_described("arrays", named) is None:
        return None
    messages = [_within(message, path) for message in samples.messages]
    for names in _alike([(field.name, field.count or 0) for field in fields], messages):
        within = stated.within(".".join(path), names)
        if within is None:
            continue
        fixed = next(field.count for field in fields if field.name == names[0])
        counter = count_field(definition, kind, fixed, names[0], messages) if fixed else None
        columns = [
            DescribedColumn(
                field.name,
                PRIMITIVES[field.type][0] != "f",
                field.comment,
                np.concatenate([_used(message, field.name, counter) for message in messages]),
            )
            for field in fields
            if field.name in names
        ]
        plan = plan_described("arrays", columns, (), definition.remarks.get(kind, ""))
        known = plan is not None and plan.looks_like_radar
        plan = within.applied(plan)
        if plan is not None and (within.column_map or known):
            return ArrayLayout(definition, plan, counter, path)
    return None


def _alike(arrays: Sequence[tuple[str, int]], messages: Sequence[Message]) -> list[list[str]]:
    """Group arrays that have equal lengths in all messages, the largest group first."""
    groups: dict[tuple[int, ...], list[str]] = {}
    for name, fixed in arrays:
        lengths = tuple(message.count(name) for message in messages) if not fixed else (-fixed,)
        if any(lengths):
            groups.setdefault(lengths, []).append(name)
    return sorted((group for group in groups.values() if len(group) > 1), key=len, reverse=True)


def _used(message: Message, name: str, counter: str | None) -> np.ndarray:
    return message.numbers(name, message.count(name))[: message.whole(counter) if counter else None]
