"""A joint: the pose of a coordinate frame in its parent, where it was read, and where its numbers stand in the text."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.imported import Form, WrittenPose

_SAME = 1e-6


@dataclass(frozen=True, slots=True)
class Place:
    """Where something was read: a file or topic, and the line; None where there are no lines."""

    source: str
    line: int | None = None

    def __str__(self) -> str:
        return self.source if self.line is None else f"{self.source}:{self.line}"


@dataclass(frozen=True, slots=True)
class Slot:
    """Where one number stands in a file's text.

    Attributes:
        start: index of its first character.
        end: index after its last one; start if the number is not written yet.
        before: text to write before a number that is not written yet, such as its attribute's name.
        after: text to write after it.
    """

    start: int
    end: int
    before: str = ""
    after: str = ""


@dataclass(frozen=True, slots=True)
class JointNumbers:
    """Where the numbers of a joint stand in a file's text.

    Attributes:
        form: how the rotation is written; angles in radians.
        translation: of x, y, z.
        rotation: of the rotation's numbers, in the order of the form.
    """

    form: Form
    translation: tuple[Slot, ...]
    rotation: tuple[Slot, ...]

    @classmethod
    def at(cls, form: Form, spans: Sequence[tuple[int, int] | None]) -> "JointNumbers | None":
        """Return the places of x, y, z and the rotation's numbers; None if one of them has none of its own."""
        slots = tuple(Slot(*span) for span in spans if span is not None)
        return cls(form, slots[:3], slots[3:]) if len(slots) == len(spans) else None

    @property
    def slots(self) -> tuple[Slot, ...]:
        """All of them, the translation first."""
        return (*self.translation, *self.rotation)


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """The pose of a frame in its parent.

    Attributes:
        parent: the frame that the pose is given in.
        child: the frame that is posed.
        parent_from_child: carries child points into the parent; None if it cannot be used.
        place: where it was read.
        name: of the joint itself, in URDF.
        problem: why it cannot be used, as the end of a sentence about it; "" if it can.
        written: the numbers as written, in the direction parent_from_child; None if it cannot be used.
        numbers: where they stand in the text; None if they cannot be changed there.
    """

    parent: str
    child: str
    parent_from_child: RigidTransform | None
    place: Place
    name: str = ""
    problem: str = ""
    written: WrittenPose | None = None
    numbers: JointNumbers | None = None

    def __post_init__(self) -> None:
        for end in ("parent", "child"):
            object.__setattr__(self, end, getattr(self, end).strip().lstrip("/"))
        if (self.parent_from_child is None) != bool(self.problem):
            raise ValueError("a joint has a transform or a problem")

    @classmethod
    def posed(
        cls,
        parent: str,
        child: str,
        written: WrittenPose,
        place: Place,
        *,
        name: str = "",
        numbers: JointNumbers | None = None,
    ) -> "Joint":
        """Return a joint of numbers as written; one whose rotation is invalid cannot be used."""
        try:
            return cls(parent, child, written.as_written(), place, name, "", written, numbers)
        except ValueError as error:
            return cls(parent, child, None, place, name, str(error), None, numbers)

    def __str__(self) -> str:
        return f"{self.parent} -> {self.child} ({self.place})"

    @property
    def transform(self) -> RigidTransform:
        """parent_from_child.

        Raises:
            InputError: it cannot be used.
        """
        if self.parent_from_child is None:
            raise InputError(
                f"{self.place}: the joint from {self.parent} to {self.child} cannot be used: {self.problem}"
            )
        return self.parent_from_child

    def repeats(self, other: "Joint") -> bool:
        """Return whether another joint of the same child says the same."""
        if self.parent != other.parent or self.parent_from_child is None or other.parent_from_child is None:
            return False
        off = self.parent_from_child.as_matrix() - other.parent_from_child.as_matrix()
        return bool(np.abs(off).max() <= _SAME)
