"""The transforms between coordinate frames in a recording: /tf_static, and what does not move in /tf."""

import contextlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calib_core.arrays import Vector3, freeze
from calib_core.errors import MessageError, RecordingError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz
from calib_core.recordings.containers.opening import open_sources
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.radar.returns_origin import named_origin
from calib_core.recordings.selection import RADAR_WORDS
from calib_core.recordings.topics import Topic, join_topics

_TYPES = ("TFMessage", "tfMessage")
_MOST_MESSAGES = 3000
"""Of one topic: /tf may have millions, and whether a joint moves shows in evenly spaced ones."""
_MOST_STATIC = 100
"""Likewise, where only a radar's mount is looked for."""
_STILL = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class FrameTransform:
    """A transform as recorded, its latest value.

    Attributes:
        parent: the frame that the pose is given in.
        child: the frame that is posed.
        translation_m: (3,) position of the child in the parent.
        quaternion_xyzw: (4,) orientation of the child in the parent.
        topic: where it was published.
        moves: whether it changes during the recording.
    """

    parent: str
    child: str
    translation_m: Vector3
    quaternion_xyzw: np.ndarray
    topic: str
    moves: bool = False

    def __post_init__(self) -> None:
        freeze(self, translation_m=(3,), quaternion_xyzw=(4,))

    @property
    def pose(self) -> RigidTransform:
        """Of the child in the parent."""
        return RigidTransform(matrix_from_quaternion_wxyz(self.quaternion_xyzw[[3, 0, 1, 2]]), self.translation_m)


def frame_transforms(paths: Sequence[Path]) -> tuple[FrameTransform, ...]:
    """Read the transforms between frames of a recording, static topics first; nothing if it has none.

    Args:
        paths: of the recording's files or folders.

    Raises:
        RecordingError: a path cannot be read, or a message is damaged.
    """
    sources = open_sources(paths)
    try:
        names = {channel.topic for source in sources for channel in source.channels if is_transforms(channel.type)}
        return _transforms_of(join_topics(sources, names)[0], _MOST_MESSAGES)
    except MessageError as error:
        raise RecordingError(f"{paths[0]}: {error}") from error
    finally:
        for source in sources:
            source.close()


def recorded_mount(topics: Sequence[Topic], frame: str, *, radar: str, body: bool) -> tuple[RigidTransform, str] | None:
    """Return the pose of a radar in the body frame, and the name of the radar's own frame; None if it is not known.

    Args:
        topics: of the recording.
        frame: frame_id of the returns.
        radar: the radar's topic, whose name tells which of several radars it is.
        body: whether the returns are said to be in the body frame; then what does not move in /tf counts too.
    """
    published = [topic for topic in topics if is_transforms(topic.type) and len(topic)]
    kinds = [[topic for topic in published if not _is_moving(topic)], published if body else []]
    for some, most in zip(kinds, (_MOST_STATIC, _MOST_MESSAGES), strict=True):
        with contextlib.suppress(RecordingError, ValueError):  # damaged, or a quaternion that is none
            above = {one.child: one for one in _transforms_of(some, most) if not one.moves}
            below = "" if _is_radar(frame) else _radar_below(above, frame, radar)
            poses = dict(_poses_above(above, below or frame))
            named = [one for one in poses if named_origin(one) == "body"]
            base = frame if below else named[0] if named else next(reversed(poses), "")
            if base in poses and (below or named_origin(frame) != "body"):
                return poses[base], below or frame
    return None


def _is_radar(frame: str) -> bool:
    return any(word in frame.lower() for word in RADAR_WORDS)


def _radar_below(above: Mapping[str, FrameTransform], frame: str, radar: str) -> str:
    """Return the frame below the body's that is named as a radar, of several the one most like the topic; "" if none is."""
    below = {one: tuple(dict(_poses_above(above, one))) for one in above if _is_radar(one)}
    carriers = {carrier for carried in below.values() for carrier in carried}
    found = [one for one, carried in below.items() if frame in carried and one not in carriers]
    words = set(re.findall(r"[a-z]+|\d+", radar.lower()))
    alike = [len(words & set(re.findall(r"[a-z]+|\d+", one.lower()))) for one in found]
    best = [one for one, score in zip(found, alike, strict=True) if score == max(alike)]
    return best[0] if len(best) == 1 else ""


def _poses_above(above: Mapping[str, FrameTransform], frame: str) -> Iterator[tuple[str, RigidTransform]]:
    """Yield each frame that carries another one, and the pose of this in it, from its parent to the root."""
    pose, seen = RigidTransform.identity(), {frame}
    while (joint := above.get(frame)) is not None and joint.parent not in seen:
        pose, frame = joint.pose @ pose, joint.parent
        seen.add(frame)
        yield frame, pose


def _transforms_of(topics: Sequence[Topic], most: int) -> tuple[FrameTransform, ...]:
    """Read the transforms of at most so many messages of each topic."""
    found: dict[tuple[str, str], FrameTransform] = {}
    for topic in sorted(topics, key=_is_moving):
        for transform in _transforms(topic, most):
            _add(found, transform)
    return tuple(found.values())


def _is_moving(topic: Topic) -> bool:
    return not topic.name.endswith("static")


def _transforms(topic: Topic, most: int) -> Iterator[FrameTransform]:
    rows = np.unique(np.linspace(0, len(topic) - 1, min(len(topic), most)).astype(np.int64))
    for row in rows.tolist():
        yield from transforms_in(topic.message(row), topic.name)


def is_transforms(kind: str) -> bool:
    """Return whether messages of a type hold transforms."""
    return kind.endswith(_TYPES)


def transforms_in(message: Message, topic: str) -> Iterator[FrameTransform]:
    """Yield the transforms of a message.

    Raises:
        MessageError: it is damaged.
    """
    return (_transform(stamped, topic) for stamped in message.messages("transforms"))


def _transform(stamped: Message, topic: str) -> FrameTransform:
    place = "transform.translation", "transform.rotation"
    return FrameTransform(
        stamped.message("header").text("frame_id").lstrip("/"),
        stamped.text("child_frame_id").lstrip("/"),
        np.array([stamped.number(f"{place[0]}.{axis}") for axis in "xyz"]),
        np.array([stamped.number(f"{place[1]}.{axis}") for axis in "xyzw"]),
        topic,
    )


def _add(found: dict[tuple[str, str], FrameTransform], latest: FrameTransform) -> None:
    """Keep the latest value of a transform; a static topic replaces values, another one that changes them moves."""
    earlier = found.get((latest.parent, latest.child))
    if earlier is None or not _is_apart(earlier, latest):
        found[latest.parent, latest.child] = latest if earlier is None else earlier
    elif latest.topic == earlier.topic and latest.topic.endswith("static"):
        found[latest.parent, latest.child] = latest
    else:
        found[latest.parent, latest.child] = replace(latest, moves=True)


def _is_apart(first: FrameTransform, second: FrameTransform) -> bool:
    shift = np.abs(first.translation_m - second.translation_m).max()
    turn = min(np.abs(first.quaternion_xyzw - sign * second.quaternion_xyzw).max() for sign in (1, -1))
    return not (shift <= _STILL and turn <= _STILL)
