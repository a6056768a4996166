"""Read radar messages with a list of returns, targets or tracks, or with one array per quantity."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.containers.sources import CONFIRM_ALL, Assumption
from calib_core.recordings.field_words import has_word, words_of
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition
from calib_core.recordings.radar.column_guess import DescribedColumn, plan_described, plan_names
from calib_core.recordings.radar.column_plan import NOTHING_STATED, ColumnAssumption, ColumnPlan, StatedReading
from calib_core.recordings.radar.columns import Returns, no_returns, returns_from
from calib_core.recordings.radar.message_layouts.samples import Samples, described, leaf_names
from calib_core.recordings.radar.registry import find_decoder

_DEEPEST = 5
_COUNTS = ("count", "cnt", "num", "number", "n", "nr", "nof", "size", "len", "length", "total", "valid")


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
        cls, definition: Definition, samples: Samples | None = None, stated: StatedReading = NOTHING_STATED
    ) -> "ArrayLayout | None":
        """Recognize a message by its arrays: by the registry, or by what they say about themselves."""
        names = [field.name for field in definition.fields if field.count and field.type in PRIMITIVES]
        decoder, within = find_decoder("arrays", names), stated.within("", names)
        if decoder is not None:
            count = decoder.count_field if decoder.count_field in definition.names else None
            plan = plan_names("arrays", names, within) if within else None
            return cls(definition, plan, count) if plan else None
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
        message = _message_within(decode(self.definition, payload), self.scope)
        count = message.whole(self.count_field) if self.count_field else None
        if count == 0 or not message.count(self.plan.position[0]):
            return no_returns()
        length = message.count(self.plan.position[0])
        return returns_from(self.plan, lambda name: message.numbers(name, length)[:count])

    def for_definition(self, definition: Definition) -> "ArrayLayout | None":
        """Return the same layout for another file's definition; None if that lacks an array in use."""
        kind = dict(_scopes(definition, definition.type, ())).get(self.scope)
        names = {field.name for field in definition.types[kind]} if kind else set()
        fits = set(self.plan.columns) <= names and (self.count_field is None or self.count_field in names)
        return replace(self, definition=definition) if fits else None


def _message_within(message: Message, path: Sequence[str]) -> Message:
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
    if not stated.column_map and plan_names("arrays", [field.name for field in fields]) is None:
        return None
    messages = [_message_within(message, path) for message in samples.messages]
    for names in _equal_length_groups([(field.name, field.count or 0) for field in fields], messages):
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
                np.concatenate([_used_values(message, field.name, counter) for message in messages]),
            )
            for field in fields
            if field.name in names
        ]
        plan = plan_described("arrays", columns, (), definition.remarks.get(kind, ""), within)
        if plan is not None and (within.column_map or plan.looks_like_radar):
            return ArrayLayout(definition, plan, counter, path)
    return None


def _equal_length_groups(arrays: Sequence[tuple[str, int]], messages: Sequence[Message]) -> list[list[str]]:
    """Group arrays that have equal lengths in all messages, the largest group first."""
    groups: dict[tuple[int, ...], list[str]] = {}
    for name, fixed in arrays:
        lengths = tuple(message.count(name) for message in messages) if not fixed else (-fixed,)
        if any(lengths):
            groups.setdefault(lengths, []).append(name)
    return sorted((group for group in groups.values() if len(group) > 1), key=len, reverse=True)


def _used_values(message: Message, name: str, counter: str | None) -> np.ndarray:
    return message.numbers(name, message.count(name))[: message.whole(counter) if counter else None]


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
        messages = [message]
        for name, many in zip(self.path[:-1], self.lists[:-1], strict=True):
            inner = (one for parent in messages for one in (parent.messages(name) if many else [parent.message(name)]))
            messages = list(inner)
        return messages


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


@dataclass(frozen=True, slots=True, eq=False)
class ListLayout:
    """Reads messages with a list of structs at any depth: radar_msgs, Ainstein, Continental, object lists, vendors' own.

    Attributes:
        definition: of the message.
        place: where the list is.
        plan: which fields of its elements are used.
        count_field: how many elements of a fixed list are used; None if all are.
    """

    definition: Definition
    place: ListPlace
    plan: ColumnPlan
    count_field: str | None = None

    one_per_message = False
    lidar_like = False

    @classmethod
    def recognise(
        cls, definition: Definition, samples: Samples | None = None, stated: StatedReading = NOTHING_STATED
    ) -> "ListLayout | None":
        """Find the list that looks most like a radar's returns, or that has the columns the user maps.

        Args:
            definition: of the message.
            samples: a few messages; without them, values cannot be judged.
            stated: what the user states about the messages.
        """
        places = struct_lists(definition)
        found = [one for place in places if (one := _list_at(definition, place, samples, stated)) is not None]
        if not found:
            return None
        best = max(found, key=lambda one: one.rank)
        spare = [one.place.name for one in found if one is not best]
        if not spare:
            return best
        note = (
            f"only the list '{best.place.name}' is read; the message also has {', '.join(spare)}, "
            f"which can be chosen by naming columns with --map, such as --map x={spare[0]}.FIELD"
        )
        return replace(best, plan=replace(best.plan, notes=(*best.plan.notes, note)))

    @property
    def rank(self) -> tuple[bool, bool, bool, bool]:
        """The order of preference among several lists: detections with speed and amplitude first."""
        plan = self.plan
        return (
            bool(plan.decoder),
            not self.objects,
            plan.doppler is not None or bool(plan.velocity),
            plan.amplitude is not None,
        )

    @property
    def objects(self) -> bool:
        """Whether the elements are tracked objects with an extent, not reflections."""
        names, _ = leaf_names(self.definition, self.place.element)
        return has_word(self.place.dotted, "object", "objects", "track", "tracks") or any(
            has_word(name, "width", "length", "orientation", "yaw") for name in names
        )

    @property
    def description(self) -> str:
        """Describe what is read."""
        return f"list '{self.place.name}': {self.plan.describe()}"

    def returns(self, payload: bytes) -> Returns:
        """Read one list.

        Raises:
            MessageError: the bytes do not fit the definition.
        """
        last, message = self.place.path[-1], decode(self.definition, payload)
        if len(self.place.path) == 1 and self.place.fixed is None:
            return (
                returns_from(self.plan, lambda name: message.column(last, name))
                if message.count(last)
                else no_returns()
            )
        lists = [(parent, count) for parent in self.place.parents(message) if (count := self._count(parent))]
        if not lists:
            return no_returns()
        found = returns_from(
            self.plan, lambda name: joined([parent.column(last, name)[:count] for parent, count in lists])
        )
        if self.place.fixed and self.count_field is None:
            found.points_radar_m[~found.points_radar_m.any(axis=1)] = np.nan  # unused elements
        return found

    def _count(self, parent: Message) -> int:
        count = parent.count(self.place.path[-1])
        return count if self.count_field is None else min(count, max(0, parent.whole(self.count_field)))

    def for_definition(self, definition: Definition) -> "ListLayout | None":
        """Return the same layout for another file's definition; None if that lacks the list or a column in use."""
        place = next((place for place in struct_lists(definition) if place.path == self.place.path), None)
        if place is None or place.lists != self.place.lists or place.fixed != self.place.fixed:
            return None
        numbers, others = leaf_names(definition, place.element)
        scope = {field.name for field in definition.types[place.scope]}
        fits = set(self.plan.columns) <= {*numbers, *others} and (self.count_field or place.path[-1]) in scope
        return replace(self, definition=definition, place=place) if fits else None


def _list_at(
    definition: Definition, place: ListPlace, samples: Samples | None, stated: StatedReading
) -> ListLayout | None:
    """Return the reader of one list if it holds a radar's returns or the columns that the user maps."""
    numbers, others = leaf_names(definition, place.element)
    within = stated.within(place.dotted, numbers)
    if within is None:
        return None
    known = find_decoder("list", (*numbers, *others)) is not None
    if not within.column_map:
        first = plan_described("list", described(definition, place.element, numbers), others)
        if first is None or not first.looks_like_radar:
            return None
    parents = (
        [parent for message in samples.messages for parent in place.parents(message)] if samples and not known else []
    )
    counter = count_field(definition, place.scope, place.fixed, place.path[-1], parents) if place.fixed else None
    columns = described(
        definition, place.element, numbers, lambda name: _sampled(parents, place.path[-1], name, counter)
    )
    remarks = "\n".join(definition.remarks.get(kind, "") for kind in (place.element, place.scope))
    plan = plan_described("list", columns, others, remarks, within)
    if plan is None or not (plan.looks_like_radar or within.column_map):
        return None
    messages = len(samples.messages) if parents and samples else 0
    return ListLayout(definition, place, _with_place_assumption(plan, place, parents, counter, messages), counter)


def _sampled(parents: Sequence[Message], last: str, name: str, counter: str | None) -> np.ndarray:
    """Return the values of one number in all sampled lists."""
    columns = [
        parent.column(last, name)[: parent.whole(counter) if counter else None]
        for parent in parents
        if parent.count(last)
    ]
    return np.concatenate(columns) if columns else np.zeros(0)


def _with_place_assumption(
    plan: ColumnPlan, place: ListPlace, parents: Sequence[Message], counter: str | None, messages: int
) -> ColumnPlan:
    """Add to a plan what its list's place in the message leaves open.

    Args:
        plan: of the list's elements.
        place: of the list.
        parents: what holds the list, in a sample of messages.
        counter: the field that counts the used elements.
        messages: number of sampled messages.
    """
    assumptions, notes = list(plan.assumptions), list(plan.notes)
    if place.several and len(parents) > messages:
        outer = ".".join(place.path[:-1])
        text = f"the returns of all elements of '{outer}' are taken as one sensor's, in one frame"
        assumptions.append(ColumnAssumption(Assumption("field-meaning", "", text, CONFIRM_ALL), ()))
    if place.fixed and counter is None:
        notes.append(f"'{place.name}' has {place.fixed} elements and no count: those at position 0 are skipped")
    elif place.fixed:
        notes.append(f"'{place.name}' has {place.fixed} elements; {counter} counts those in use")
    return replace(plan, assumptions=tuple(assumptions), notes=tuple(notes))
