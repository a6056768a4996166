"""Read radar messages with a list of returns, targets or tracks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.recordings.assumptions import CONFIRM_ALL, Assumption
from calib_core.recordings.field_words.words import has_word
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.radar.column_mapping import StatedReading
from calib_core.recordings.radar.column_plan import ColumnAssumption, ColumnPlan
from calib_core.recordings.radar.column_plans import find_decoder, plan_described
from calib_core.recordings.radar.columns import Returns, no_returns, returns_from
from calib_core.recordings.radar.message_layouts.samples import Samples, described, leaf_names
from calib_core.recordings.radar.message_layouts.struct_lists import ListPlace, count_field, joined, struct_lists

_NOTHING = StatedReading()


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
        cls, definition: Definition, samples: Samples | None = None, stated: StatedReading = _NOTHING
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
        return best.with_plan(replace(best.plan, notes=(*best.plan.notes, note)))

    @property
    def rank(self) -> tuple[bool, bool, bool, bool, bool]:
        """The order of preference among several lists: detections with speed and amplitude first."""
        plan = self.plan
        return (
            bool(plan.mapped),
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

    def with_plan(self, plan: ColumnPlan) -> "ListLayout":
        """Return the same layout with another plan."""
        return replace(self, plan=plan)

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
    first = plan_described("list", described(definition, place.element, numbers, _no_values), others)
    if not within.column_map and (first is None or not first.looks_like_radar):
        return None
    parents = (
        [parent for message in samples.messages for parent in place.parents(message)] if samples and not known else []
    )
    counter = count_field(definition, place.scope, place.fixed, place.path[-1], parents) if place.fixed else None
    columns = described(
        definition, place.element, numbers, lambda name: _sampled(parents, place.path[-1], name, counter)
    )
    remarks = "\n".join(definition.remarks.get(kind, "") for kind in (place.element, place.scope))
    plan = plan_described("list", columns, others, remarks)
    if plan is not None and not plan.looks_like_radar and not within.column_map:
        return None
    plan = within.applied(plan)
    return (
        None
        if plan is None
        else ListLayout(
            definition,
            place,
            _about_place(plan, place, parents, counter, len(samples.messages) if parents and samples else 0),
            counter,
        )
    )


def _no_values(name: str) -> np.ndarray:
    return np.zeros(0)


def _sampled(parents: Sequence[Message], last: str, name: str, counter: str | None) -> np.ndarray:
    """Return the values of one number in all sampled lists."""
    columns = [
        parent.column(last, name)[: parent.whole(counter) if counter else None]
        for parent in parents
        if parent.count(last)
    ]
    return np.concatenate(columns) if columns else np.zeros(0)


def _about_place(
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
