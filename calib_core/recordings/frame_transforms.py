"""The transforms between coordinate frames in a recording: /tf_static, and what does not move in /tf."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calib_core.arrays import Vector3, freeze
from calib_core.errors import MessageError, RecordingError
from calib_core.recordings.containers.opening import open_sources
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.topics import Topic, join_topics

_TYPES = ("TFMessage", "tfMessage")
_MOST_MESSAGES = 3000
"""Of one topic: /tf may have millions, and whether a joint moves shows in evenly spaced ones."""
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


def frame_transforms(paths: Sequence[Path]) -> tuple[FrameTransform, ...]:
    """Read the transforms between frames of a recording, static topics first; nothing if it has none.

    Args:
        paths: of the recording's files or folders.

    Raises:
        RecordingError: a path cannot be read, or a message is damaged.
    """
    sources = open_sources(paths)
    try:
        names = {channel.topic for source in sources for channel in source.channels if channel.type.endswith(_TYPES)}
        topics, _ = join_topics(sources, names)
        found: dict[tuple[str, str], FrameTransform] = {}
        for topic in sorted(topics, key=_is_moving):
            for transform in _transforms(topic):
                _add(found, transform)
        return tuple(found.values())
    except MessageError as error:
        raise RecordingError(f"{paths[0]}: {error}") from error
    finally:
        for source in sources:
            source.close()


def _is_moving(topic: Topic) -> bool:
    return not topic.name.endswith("static")


def _transforms(topic: Topic) -> Iterator[FrameTransform]:
    rows = np.unique(np.linspace(0, len(topic) - 1, min(len(topic), _MOST_MESSAGES)).astype(np.int64))
    for row in rows.tolist():
        for stamped in topic.message(row).messages("transforms"):
            yield _transform(stamped, topic.name)


def _transform(stamped: Message, topic: str) -> FrameTransform:
    place = "transform.translation", "transform.rotation"
    return FrameTransform(
        stamped.message("header").text("frame_id"),
        stamped.text("child_frame_id"),
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
