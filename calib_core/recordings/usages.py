"""Determine what each topic can be used for, from its definition and its messages."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.recordings.box_topics import BoxLayout, box_layout
from calib_core.recordings.camera.images import ImageLayout, is_picture
from calib_core.recordings.camera.recorded_intrinsics import is_camera_info
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition
from calib_core.recordings.radar.column_mapping import StatedReading
from calib_core.recordings.radar.layouts import RadarLayout, recognise
from calib_core.recordings.radar.message_layouts.samples import leaf_names
from calib_core.recordings.radar.message_layouts.single_returns import PointLayout
from calib_core.recordings.radar.message_layouts.struct_lists import struct_lists
from calib_core.recordings.time.clock_choice import HALF_DISTINCT, RETURNS_DISTINCT
from calib_core.recordings.topics import Topic, TopicKind


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_RAW = (
    "raw sensor packets, which only the sensor's driver can decode; play the recording to the driver and record "
    "what it publishes"
)
_NOTHING = StatedReading()
_ENOUGH_BYTES = 16
_MOST_NAMES = 8
_ROS_PACKAGES = _words(
    "actionlib_msgs builtin_interfaces control_msgs diagnostic_msgs geometry_msgs map_msgs nav_msgs rcl_interfaces "
    "rosgraph_msgs sensor_msgs shape_msgs std_msgs stereo_msgs tf tf2_msgs trajectory_msgs unique_identifier_msgs "
    "vision_msgs visualization_msgs"
)
"""Packages of ROS itself, whose lists of structs are no radar returns and need no remark."""


@dataclass(frozen=True, slots=True, eq=False)
class Usage:
    """What a topic can be used for.

    Attributes:
        kind: see TopicSummary.
        problem: see TopicSummary.
        radar: its layout, if it is a radar topic.
        image: its layout, if it is an image topic.
        boxes: its layout, if it has boxes around objects.
    """

    kind: TopicKind
    problem: str | None = None
    radar: RadarLayout | None = None
    image: ImageLayout | None = None
    boxes: BoxLayout | None = None

    @property
    def distinct_times(self) -> float:
        """The least share of different times that is plausible among its messages."""
        return RETURNS_DISTINCT if isinstance(self.radar, PointLayout) else HALF_DISTINCT


def usage_of(topic: Topic, stated: StatedReading = _NOTHING) -> Usage:
    """Determine what a topic can be used for, from its definition and its first readable message.

    Args:
        topic: the topic.
        stated: what the user states about the radar's messages.
    """
    try:
        definition = topic.definition()
    except MessageError as error:
        return Usage("other", problem=str(error))
    if is_camera_info(definition):
        return Usage("camera-info")
    boxes = box_layout(definition)
    if boxes is not None:
        return Usage("other", boxes=boxes)
    pictures = is_picture(definition)
    usage = Usage("image" if pictures else "other", problem="no messages")
    for row in sorted({0, len(topic) // 2, len(topic) - 1}) if len(topic) else ():
        try:
            payload = topic.payload(row)
            return (
                _image_usage(topic, definition, payload)
                if pictures
                else _radar_usage(topic, definition, payload, stated)
            )
        except MessageError as error:
            usage = usage if usage.problem != "no messages" else replace(usage, problem=str(error))
        except RecordingError as error:
            usage = replace(usage, problem=f"its messages cannot be read: {error}")
    if usage.problem != "no messages" and "radar" in topic.name.lower() and not pictures:
        return replace(usage, kind="radar")
    return usage


def _image_usage(topic: Topic, definition: Definition, payload: bytes) -> Usage:
    layout = ImageLayout(definition, topic.name)
    layout.check(payload)
    return Usage("image", image=layout)


def _radar_usage(topic: Topic, definition: Definition, payload: bytes, stated: StatedReading) -> Usage:
    def more(count: int) -> list[bytes]:
        rows = np.unique(np.linspace(0, len(topic) - 1, min(count, len(topic))).astype(np.int64))
        rows = rows[topic.part[rows] == topic.part[0]]
        return list(_readable(topic, rows.tolist()))

    try:
        radar = recognise(definition, payload, more, stated)
    except MessageError as error:
        if not stated.column_map:
            raise
        if recognise(definition, payload, more) is None:
            return _no_radar(definition)
        return Usage("radar", problem=str(error))
    return _no_radar(definition) if radar is None else Usage("radar", radar=radar)


def _readable(topic: Topic, rows: Sequence[int]) -> Iterator[bytes]:
    """Read messages; unreadable ones are left out: they are reported when they are used."""
    for row in rows:
        with contextlib.suppress(RecordingError):
            yield topic.payload(row)


def _no_radar(definition: Definition) -> Usage:
    """Say why a message that might be a radar's is not read."""
    if _holds_packets(definition):
        return Usage("other", problem=_RAW)
    if definition.type.partition("/")[0] in _ROS_PACKAGES:
        return Usage("other")
    for place in struct_lists(definition):
        names, _ = leaf_names(definition, place.element)
        if len(names) > 2 and place.element.partition("/")[0] not in _ROS_PACKAGES:
            shown = ", ".join(names[:_MOST_NAMES]) + (", …" if len(names) > _MOST_NAMES else "")
            return Usage("other", problem=(
                f"not read as a radar: its list '{place.name}' has structs with the fields {shown}, and no position and speed or "
                "amplitude is recognised among them; if it is one, say which is which, such as --map x=FIELD:m --map y=FIELD:m"
            ))  # fmt: skip
    return Usage("other")


def _holds_packets(definition: Definition) -> bool:
    """Return whether a message holds a list of structs that are little more than bytes: what a driver receives."""
    for place in struct_lists(definition):
        fields = definition.types[place.element]
        blobs = [field for field in fields if field.count is not None and PRIMITIVES.get(field.type, "")[1:] == "1"]
        numbers = [
            name for name in leaf_names(definition, place.element)[0] if not name.startswith(("stamp.", "header."))
        ]
        if any((blob.count or _ENOUGH_BYTES) >= _ENOUGH_BYTES for blob in blobs) and len(numbers) <= len(blobs) + 3:
            return True
    return False
