"""CameraInfo for the images of a recording: on the topic where viewers look for it, unless another one is there."""

from dataclasses import dataclass

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings import Recording
from calib_core.recordings.camera.recorded_intrinsics import camera_from_info, is_camera_info
from calib_core.recordings.containers.writing import CameraInfoMessage, MessageBuilder
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.topics import Topic, join_topics

OWN_TOPIC = "/cocalib/camera_info"
"""Where the topic beside the images holds other intrinsics."""

_TRANSPORTS = ("compressed", "compressedDepth", "ffmpeg", "foxglove", "theora", "zstd", "draco", "h264")
_STAMP_PLACE = 4  # after the sequence number (ROS 1), or after the encapsulation (CDR)


@dataclass(frozen=True, slots=True)
class ChosenTopic:
    """Where viewers find the intrinsics.

    Attributes:
        name: the topic.
        written: whether messages are to be written to it; otherwise the recording has them.
        note: what the user must know; "" if nothing.
    """

    name: str
    written: bool
    note: str = ""


def topic_beside(image_topic: str) -> str:
    """Return the topic on which ROS expects the intrinsics of an image topic, its transport left out."""
    base, _, transport = image_topic.rpartition("/")
    if transport in _TRANSPORTS and base:
        image_topic = base
    return f"{image_topic.rpartition('/')[0]}/camera_info"


def choose_topic(recording: Recording, camera: Camera, frame: str) -> ChosenTopic:
    """Choose the topic for the intrinsics of a calibration.

    Args:
        recording: with images.
        camera: the intrinsics of the calibration.
        frame: the images' frame.
    """
    assert recording.image_topic is not None
    name = topic_beside(recording.image_topic)
    taken = {topic.name: topic for topic in recording.topics if topic.count}
    if name not in taken:
        return ChosenTopic(name, written=True)
    (topic,), _ = join_topics(recording.sources, (name,))
    difference = _difference(topic, camera, frame)
    if not difference:
        return ChosenTopic(name, written=False, note=f"{name} has these intrinsics already; none are added")
    own, number = OWN_TOPIC, 2
    while own in taken:
        own, number = f"{OWN_TOPIC}_{number}", number + 1
    return ChosenTopic(
        own,
        written=True,
        note=f"{name} of the recording {difference}; it is kept, and the calibration's intrinsics are on {own}: RViz's Camera "
        f"display takes {name}, so remap it when you play the recording ({name}:=/unused {own}:={name})",
    )


def _difference(topic: Topic, camera: Camera, frame: str) -> str:
    """Say how recorded intrinsics differ from the calibration's; "" if they do not."""
    try:
        if not is_camera_info(topic.definition()):
            return f"is of type {topic.type}"
        for row in sorted({0, len(topic) // 2, len(topic) - 1}):
            message = topic.message(row)
            if difference := _misfit(message, camera, topic.name):
                return difference
            recorded = message.message("header").text("frame_id").lstrip("/")
            if recorded != frame:
                return f"has the frame_id {recorded!r} and the images have {frame!r}"
    except RecordingError as error:
        return f"cannot be read ({error})"
    return ""


def _misfit(message: Message, camera: Camera, topic: str) -> str:
    recorded = camera_from_info(message, topic=topic).camera
    if recorded is None:
        return "has no usable intrinsics"
    upper = "P" in message
    rotation, projection = message.numbers("R" if upper else "r", 9), message.numbers("P" if upper else "p", 12)
    same = (
        (recorded.width_px, recorded.height_px) == (camera.width_px, camera.height_px)
        and np.allclose(recorded.matrix_px, camera.matrix_px, rtol=1e-9, atol=1e-9)
        and _same_lens(recorded, camera)
    )
    if not same:
        return "has other intrinsics"
    plain = np.allclose(rotation.reshape(3, 3), np.eye(3), rtol=0, atol=1e-9) and not projection[3::4].any()
    return "" if plain and projection[0] > 0 else "has a rectification (R, P) of its own"


def _same_lens(recorded: Camera, camera: Camera) -> bool:
    if not recorded.is_distorted and not camera.is_distorted:
        return True
    count = max(len(recorded.distortion), len(camera.distortion))
    here, there = (np.pad(one.distortion, (0, count - len(one.distortion))) for one in (recorded, camera))
    families = {one.lens.opencv for one in (recorded, camera)}
    return len(families) == 1 and bool(np.allclose(here, there, rtol=1e-9, atol=1e-12))


class InfoTemplate:
    """CameraInfo messages that differ only in their stamps.

    Args:
        build: serialises.
        camera: the intrinsics.
        frame: the images' frame.
    """

    def __init__(self, build: MessageBuilder, camera: Camera, frame: str) -> None:
        self._is_ros1 = build.generation == 1
        self._bytes = build.serialised(CameraInfoMessage(TimeNs(0), frame, camera))
        self._count = 0

    def stamped(self, stamp: bytes) -> bytes:
        """Return the next message.

        Args:
            stamp: seconds and nanoseconds as two little-endian words of 4 bytes.
        """
        head = self._count.to_bytes(4, "little") if self._is_ros1 else self._bytes[:_STAMP_PLACE]
        self._count += 1
        return head + stamp + self._bytes[_STAMP_PLACE + len(stamp) :]
