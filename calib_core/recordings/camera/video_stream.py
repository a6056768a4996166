"""The frames of a video topic: encoded frames that depend on those before them."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import MessageError, RecordingError
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.camera.images import EncodedImage, ImageLayout, encoded_pixels
from calib_core.recordings.camera.video_packets import Packet, PacketDecoder
from calib_core.recordings.topics import Topic
from calib_core.results import DataWarning

_SOUGHT_MESSAGES = 2000


@dataclass(frozen=True, slots=True, eq=False)
class VideoStream(ImageStream):
    """Frames of a video, decoded on demand.

    Attributes:
        decoder: returns the pixels of a message's frame.
        before_key: how many frames at the beginning were skipped because no key frame precedes them.
    """

    decoder: PacketDecoder | None = None
    before_key: int = 0

    def encoded(self, index: int) -> EncodedImage:
        """Return a frame encoded as JPEG."""
        return encoded_pixels(self.picture(index))

    def picture(self, index: int) -> np.ndarray:
        """Return a frame's pixels, blue first.

        Raises:
            MessageError: it cannot be decoded.
        """
        assert self.decoder is not None
        try:
            return self.decoder.picture(int(self.row[index]))
        except MessageError as error:
            raise MessageError(f"topic {self.topic.name}: {error}") from error

    def size_px(self, index: int) -> tuple[int, int]:
        """Return a frame's width and height."""
        height, width = self.picture(index).shape[:2]
        return width, height


def image_stream(topic: Topic, layouts: Sequence[ImageLayout], stamps_ns: TimesNs) -> ImageStream:
    """Build the stream of an image topic with pictures or video."""
    stream = ImageStream.build(topic, layouts, stamps_ns)

    def packet(number: int) -> Packet | None:
        return layouts[int(topic.part[number])].packet(topic.payload(number))

    def video_packet(number: int) -> Packet:
        found = packet(number)
        if found is None:
            raise MessageError(f"frame {number} of the video is not a video packet")
        return found

    key = None
    for number in range(min(len(topic), _SOUGHT_MESSAGES)):
        with contextlib.suppress(RecordingError):  # reported when the frame itself is read
            found = packet(number)
            if found is None:
                return stream
            if found.key:
                key = number
                break
    if key is None:
        return stream
    kept = stream.row >= key
    return VideoStream(
        topic, layouts, stream.times_ns[kept], stream.row[kept], stream.repeated,
        decoder=PacketDecoder(video_packet, len(topic)), before_key=int((~kept).sum()),
    )  # fmt: skip


def about_video(images: ImageStream | None) -> list[DataWarning]:
    """Warn about frames that cannot be decoded because the recording began between key frames."""
    if not isinstance(images, VideoStream) or not images.before_key:
        return []
    return [
        DataWarning(
            "video-before-key",
            f"the first {images.before_key} frames of {images.topic.name} precede its first key frame and are skipped",
            "no action needed unless a placement is there; in that case have the encoder send key frames more often",
        )
    ]
