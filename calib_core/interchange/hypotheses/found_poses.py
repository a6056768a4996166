"""Poses in a file's values: where they are, and each way in which their numbers can be read."""

from dataclasses import dataclass, field, replace

from calib_core.arrays import Matrix33, Vector3, frozen_array
from calib_core.interchange.hypotheses.key_words import KeyHints


@dataclass(frozen=True, slots=True, eq=False)
class RotationReading:
    """One way to read the numbers of a rotation.

    Attributes:
        rotation: (3, 3).
        key: distinguishes it from the other ways to read the same numbers, such as "wxyz"; "" if there is only one.
        words: the same for people.
        weight: how usual it is among these, a probability.
    """

    rotation: Matrix33
    key: str = ""
    words: str = ""
    weight: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", frozen_array(self.rotation, (3, 3)))


@dataclass(frozen=True, slots=True, eq=False)
class PoseReading:
    """One way to read the numbers of a pose, before it is known which frames it connects.

    Attributes:
        turned: its rotation.
        translation: (3,) as written, in an unknown unit of length.
    """

    turned: RotationReading
    translation: Vector3

    def __post_init__(self) -> None:
        object.__setattr__(self, "translation", frozen_array(self.translation, (3,)))


@dataclass(frozen=True, slots=True)
class FoundPose:
    """A pose in a file.

    Attributes:
        place: the path to it, such as "calibration.radar.T"; "the file" if it is all there is.
        readings: every way to read its numbers; at least one.
        hints: what the names around it suggest.
    """

    place: str
    readings: tuple[PoseReading, ...]
    hints: KeyHints = field(default_factory=KeyHints)

    def with_hints(self, hints: KeyHints) -> "FoundPose":
        """Return it with other hints."""
        return replace(self, hints=hints)


@dataclass(frozen=True, slots=True)
class Unreadable:
    """Numbers in the shape of a pose that are none.

    Attributes:
        place: the path to them.
        fault: why, for people.
    """

    place: str
    fault: str
