"""Determine what each topic can be used for, from its definition and its messages."""

import re
from dataclasses import dataclass, replace

from calib_core.errors import MessageError, RecordingError
from calib_core.recordings.camera.camera_info import is_camera_info
from calib_core.recordings.camera.images import ImageLayout, is_picture
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.radar.axes import RadarAxes
from calib_core.recordings.radar.layouts import RadarLayout, recognise
from calib_core.recordings.radar.list_messages import PointLayout
from calib_core.recordings.time.clock_faults import HALF_DISTINCT, RETURNS_DISTINCT
from calib_core.recordings.topics import Topic, TopicKind

__all__ = ["Usage", "usage_of"]

_PACKETS = re.compile(r"/(?!FFMPEG)\w*Packets?$")
_RAW = (
    "raw sensor packets, which only the sensor's driver can decode; play the recording to the driver and record "
    "what it publishes"
)


@dataclass(frozen=True, slots=True, eq=False)
class Usage:
    """What a topic can be used for.

    Attributes:
        kind: see TopicSummary.
        problem: see TopicSummary.
        radar: its layout, if it is a radar topic.
        image: its layout, if it is an image topic.
    """

    kind: TopicKind
    problem: str | None = None
    radar: RadarLayout | None = None
    image: ImageLayout | None = None

    @property
    def distinct_times(self) -> float:
        """The least share of different times that is plausible among its messages."""
        return RETURNS_DISTINCT if isinstance(self.radar, PointLayout) else HALF_DISTINCT

    def read_as(self, axes: RadarAxes | None) -> "Usage":
        """Apply the user's --radar-axes."""
        if self.radar is None or axes is None:
            return self
        return replace(self, radar=self.radar.with_plan(self.radar.plan.read_as(axes)))


def usage_of(topic: Topic) -> Usage:
    """Determine what a topic can be used for, from its definition and its first readable message."""
    if _PACKETS.search(topic.type):
        return Usage("other", problem=_RAW)
    try:
        definition = topic.definition()
    except MessageError as error:
        return Usage("other", problem=str(error))
    if is_camera_info(definition):
        return Usage("camera-info")
    pictures = is_picture(definition)
    usage = Usage("image" if pictures else "other", problem="no messages")
    for row in sorted({0, len(topic) // 2, len(topic) - 1}) if len(topic) else ():
        try:
            payload = topic.payload(row)
            return _image_usage(topic, definition, payload) if pictures else _radar_usage(definition, payload)
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


def _radar_usage(definition: Definition, payload: bytes) -> Usage:
    radar = recognise(definition, payload)
    return Usage("other") if radar is None else Usage("radar", radar=radar)
