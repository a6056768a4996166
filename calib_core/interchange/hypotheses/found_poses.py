"""Poses in a file's values: where they are, what their keys suggest, and each way in which their numbers can be read."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from calib_core.arrays import Matrix33, Vector3, freeze
from calib_core.interchange.format import Direction, looks_like_camera, looks_like_lidar, looks_like_radar

Part = Literal["rotation", "translation", "other"]

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_INITIALS = {"c": "cam", "l": "lidar", "r": "radar"}
_OF_INITIALS = re.compile("([rt])(cl|cr|lc|rc)", re.IGNORECASE)
_JOINED = re.compile(r"(cam|camera|radar|to|from)(?=(?:cam|radar|to|from))", re.IGNORECASE)


def _set_of(words: str) -> frozenset[str]:
    return frozenset(words.split())


_ROTATION = _set_of(
    "r rot rotation orientation attitude rmat rotm q quat quaternion qvec wxyz xyzw rvec rvecs rotvec rodrigues rpy ypr euler "
    "angles"
)
_TRANSLATION = _set_of("t trans translation tvec tvecs xyz position pos offset origin location")
_WORDS_OF_PARTS: tuple[tuple[Part, frozenset[str]], ...] = (("rotation", _ROTATION), ("translation", _TRANSLATION))
_SPELT = (
    ("mm", "mm millimeter millimeters millimetres"),
    ("cm", "cm centimeters"),
    ("m", "m meter meters metres"),
    ("rad", "rad radians"),
    ("deg", "deg degrees"),
)
_UNITS = {word: unit for unit, words in _SPELT for word in words.split()}
_OF_AXES = {
    "optical": ("camera", "optical"),
    "link": ("camera", "body"),
    "body": ("camera", "body"),
    "opencv": ("camera", "optical"),
    "opengl": ("camera", "opengl"),
    "blender": ("camera", "opengl"),
    "flu": ("radar", "flu"),
    "frd": ("radar", "frd"),
    "rfu": ("radar", "rfu"),
}
_OTHERS = _set_of(
    "imu gps gnss ego vehicle chassis base world map robot rig platform odom gripper tool flange effector drone"
)
_NAMED = 0.2
_FROM, _TO = ("from", "wrt", "in"), ("to", "2")


@dataclass(frozen=True, slots=True)
class KeyHints:
    """What the names around a pose suggest.

    Attributes:
        carries_radar: probability that the numbers carry radar points into the camera, by the names alone.
        camera_axes: the camera's axes that a name mentions; "" if none does.
        radar_axes: the same for the radar.
        unit: of length that a name mentions; "" if none does.
        names_radar: whether a name mentions a radar.
        other: another sensor or frame that a name mentions although none mentions a radar, or none a camera, such as
            "lidar"; "" if none does.
    """

    carries_radar: float = 0.5
    camera_axes: str = ""
    radar_axes: str = ""
    unit: str = ""
    names_radar: bool = False
    other: str = ""

    @property
    def named_direction(self) -> Direction | None:
        """The direction that the names state; None if they leave it open."""
        if abs(self.carries_radar - 0.5) < _NAMED:
            return None
        return "camera_from_radar" if self.carries_radar > 0.5 else "radar_from_camera"


def words_of(key: object) -> tuple[str, ...]:
    """Split a key into lower-case words: T_cam_radar, radarToCamera and radar2cam alike, and rlc as r, lidar, to, cam."""
    if initials := _OF_INITIALS.fullmatch(str(key)[:200]):
        part, first, last = initials[0].lower()[:1], initials[0].lower()[1:2], initials[0].lower()[2:]
        return part, _INITIALS[first], "to", _INITIALS[last]
    return tuple(word.lower() for word in _WORD.findall(_JOINED.sub(r"\1_", str(key)[:200])))


def part_of(key: object) -> tuple[Part, tuple[str, ...]]:
    """Return which part of a pose a key names, and its other words: R_cam_radar is a rotation, and (cam, radar)."""
    words = words_of(key)
    for part, known in _WORDS_OF_PARTS:
        if known & set(words):
            rest = tuple(word for word in words if word not in known and word not in _UNITS)
            return part, rest
    return "other", words


def unit_in(key: object) -> str:
    """Return the unit that a key ends with: mm, cm, m, rad or deg; "" if it ends with none, or is nothing else."""
    words = words_of(key)
    return _UNITS.get(words[-1], "") if len(words) > 1 else ""


def hints_of(keys: Sequence[object], texts: Sequence[str] = ()) -> KeyHints:
    """Return what the names around a pose suggest.

    Args:
        keys: from the outermost to that of the pose itself.
        texts: short texts beside it, such as the names of frames.
    """
    words = [word for key in keys for word in words_of(key)]
    axes = {
        whose: which
        for word in [*words, *(part for text in texts for part in words_of(text))]
        for whose, which in [_OF_AXES.get(word, ("", ""))]
    }
    names = (*reversed(keys), *texts)
    innermost = next((hint for name in names if (hint := _direction(words_of(name))) != 0.5), 0.5)
    units = [*(unit_in(key) for key in reversed(keys)), *(_UNITS.get(text.strip().lower(), "") for text in texts)]
    unit = next((unit for unit in units if unit in ("mm", "cm", "m")), "")
    said = [word for one in (*keys, *texts) for word in words_of(one)]
    names_radar = any(map(looks_like_radar, said))
    names_both = names_radar and any(map(looks_like_camera, said))
    lidar = next((str(key) for key in keys if any(map(looks_like_lidar, (str(key), *words_of(key))))), "")
    other = "" if names_both else lidar or next((word for word in words if word in _OTHERS), "")
    return KeyHints(innermost, axes.get("camera", ""), axes.get("radar", ""), unit, names_radar, other)


def _direction(words: Sequence[str]) -> float:
    """Return the probability that a key names camera_from_radar, by the order of its words."""
    if {"rvec", "tvec"} & set(words):
        return 0.85  # OpenCV's names, and its direction
    cameras = [at for at, word in enumerate(words) if looks_like_camera(word)]
    radars = [at for at, word in enumerate(words) if looks_like_radar(word)]
    if not cameras or not radars:
        return 0.6 if "extrinsic" in words or "extrinsics" in words else 0.5
    first, last = sorted((cameras[0], radars[0]))
    between = words[first + 1 : last]
    camera_first = first == cameras[0]
    if set(between) & set(_FROM):
        return 0.97 if camera_first else 0.03
    if set(between) & set(_TO):
        return 0.15 if camera_first else 0.85  # "radar to camera" is also said of the pose of the camera in the radar
    return 0.8 if camera_first else 0.25  # T_camera_radar


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
        freeze(self, rotation=(3, 3))


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
        freeze(self, translation=(3,))

    @property
    def is_identity(self) -> bool:
        """Whether it moves nothing."""
        return np.array_equal(self.turned.rotation, np.eye(3)) and not self.translation.any()


@dataclass(frozen=True, slots=True)
class FoundPose:
    """A pose in a file.

    Attributes:
        place: the path to it, such as "calibration.radar.T"; "the file" if it is all there is.
        readings: every way to read its numbers; at least one.
        hints: what the names around it suggest.
        names: these names: the short texts beside it, then the keys from the outermost on.
    """

    place: str
    readings: tuple[PoseReading, ...]
    hints: KeyHints = field(default_factory=KeyHints)
    names: tuple[str, ...] = ()

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
