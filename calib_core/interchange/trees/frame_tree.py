"""Coordinate frames and the joints between them: one parent per frame, no cycles, any two frames chained.

A `TreePart` is what one file says, before the files are joined.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.camera_format import FoundCamera
from calib_core.interchange.format import Axes, Form, WrittenPose

SensorKind = Literal["radar", "camera", "other"]

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


_LISTED = 12


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """What a file says about the sensor at a frame, besides its pose.

    Attributes:
        frame: its name.
        kind: which sensor.
        axes: of a camera's frame; None if the file does not say.
        lens: of a camera; None if the file has none.
    """

    frame: str
    kind: SensorKind
    axes: Axes | None = None
    lens: FoundCamera | None = None


@dataclass(frozen=True, slots=True)
class Step:
    """A joint on the way between two frames, and whether the way leads from its parent to its child."""

    joint: Joint
    down: bool

    @property
    def transform(self) -> RigidTransform:
        """From the frame it leads to, into the frame it comes from.

        Raises:
            InputError: the joint cannot be used.
        """
        return self.joint.transform if self.down else self.joint.transform.inverse()


@dataclass(frozen=True, slots=True, eq=False)
class FrameTree:
    """Joints with their sensors. A joint that is given twice alike is kept once.

    Attributes:
        joints: in the order of the files.
        sensors: what the files say about the sensors.
        format: of the files; of several formats the first.
        hint: what may be missing from it, such as macros that were not expanded; "" if nothing.
        notes: what a user of it must know, one sentence each.
        assumptions: what the files do not state and reading them takes for granted, one sentence each.

    Raises:
        InputError: a frame has two parents, or is its own ancestor.
    """

    joints: tuple[Joint, ...]
    sensors: tuple[Sensor, ...] = ()
    format: str = "tf2"
    hint: str = ""
    notes: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    _above: dict[str, Joint] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        above: dict[str, Joint] = {}
        for joint in self.joints:
            known = above.setdefault(joint.child, joint)
            if known is not joint and not joint.repeats(known):
                raise InputError(_two_parents(known, joint))
        object.__setattr__(self, "joints", tuple(above.values()))
        object.__setattr__(self, "_above", above)
        _refuse_cycles(above)

    @property
    def frames(self) -> tuple[str, ...]:
        """Every frame, in the order of the joints."""
        return tuple(dict.fromkeys(name for joint in self.joints for name in (joint.parent, joint.child)))

    def root_of(self, frame: str) -> str:
        """Return the frame at the top of a frame's chain: itself if it has no parent."""
        return self._upwards(frame)[-1]

    def below(self, frame: str) -> tuple[str, ...]:
        """Return every frame that moves with a frame, without itself."""
        return tuple(name for name in self.frames if name != frame and frame in self._upwards(name))

    def path(self, first: str, last: str) -> tuple[Step, ...]:
        """Return the joints on the way from one frame to another.

        Raises:
            InputError: a frame is not in the tree, or they are not connected.
        """
        for frame in (first, last):
            if frame not in self.frames:
                raise InputError(f"there is no frame {frame!r} among {self.listed()}{self._hinted()}")
        up, down = self._upwards(first), self._upwards(last)
        if up[-1] != down[-1]:
            raise InputError(
                f"{first} and {last} are not connected: one hangs from {up[-1]}, the other from {down[-1]}; give the file "
                f"with the transform between them as well{self._hinted()}"
            )
        meeting = next(frame for frame in up if frame in down)
        return (
            *(Step(self._above[frame], down=False) for frame in up[: up.index(meeting)]),
            *(Step(self._above[frame], down=True) for frame in reversed(down[: down.index(meeting)])),
        )

    def between(self, target: str, source: str) -> RigidTransform:
        """Return target_from_source, chained over the joints between two frames.

        Raises:
            InputError: they are not connected, or a joint between them cannot be used.
        """
        target_from_source = RigidTransform.identity()
        for step in self.path(target, source):
            target_from_source = target_from_source @ step.transform
        return target_from_source

    def sensor_at(self, frame: str) -> Sensor | None:
        """Return what the files say about the sensor at a frame; None if they say nothing."""
        return next((sensor for sensor in self.sensors if sensor.frame == frame), None)

    def listed(self) -> str:
        """Return the names of its frames for a message."""
        more = len(self.frames) - _LISTED
        return ", ".join(self.frames[:_LISTED]) + (f" and {more} more" if more > 0 else "")

    def _hinted(self) -> str:
        return f" ({self.hint})" if self.hint else ""

    def _upwards(self, frame: str) -> list[str]:
        return list(_upwards(frame, self._above))


def _upwards(frame: str, above: dict[str, Joint]) -> Iterator[str]:
    yield frame
    while frame in above:
        frame = above[frame].parent
        yield frame


def _two_parents(first: Joint, second: Joint) -> str:
    if first.parent == second.parent:
        return (
            f"{second.place}: the pose of {second.child!r} in {second.parent!r} is given twice, and differs from {first.place}; "
            "keep one of them"
        )
    return (
        f"{second.place}: {second.child!r} gets a second parent, {second.parent!r}; its parent is {first.parent!r} "
        f"({first.place}), and a frame has one: remove one of the two joints"
    )


def _refuse_cycles(above: dict[str, Joint]) -> None:
    cleared: set[str] = set()
    for start in above:
        seen: dict[str, None] = {}
        for frame in _upwards(start, above):
            if frame in cleared:
                break
            if frame in seen:
                loop = [*list(seen)[list(seen).index(frame) :], frame]
                raise InputError(
                    f"{above[frame].place}: the frames {' -> '.join(reversed(loop))} form a circle; remove one of these joints"
                )
            seen[frame] = None
        cleared.update(seen)


@dataclass(frozen=True, slots=True, eq=False)
class TreePart:
    """The joints and sensors of one file.

    Attributes:
        format: of the file.
        joints: in the order of the file.
        sensors: what it says about sensors besides their pose.
        hint: what may be missing from it, such as macros that were not expanded; "" if nothing.
        notes: what a user of it must know, one sentence each.
        assumptions: what it does not state and reading it takes for granted, one sentence each.
        statement: what it states about itself in a key; "" if nothing.
    """

    format: str
    joints: tuple[Joint, ...]
    sensors: tuple[Sensor, ...] = ()
    hint: str = ""
    notes: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    statement: str = ""


def joined(parts: Sequence[TreePart]) -> FrameTree:
    """Join what several files say into one tree.

    Raises:
        InputError: a frame has two parents, or is its own ancestor.
    """
    return FrameTree(
        tuple(joint for part in parts for joint in part.joints),
        tuple(sensor for part in parts for sensor in part.sensors),
        parts[0].format,
        "; ".join(part.hint for part in parts if part.hint),
        tuple(dict.fromkeys(note for part in parts for note in part.notes)),
        tuple(dict.fromkeys(one for part in parts for one in part.assumptions)),
    )
