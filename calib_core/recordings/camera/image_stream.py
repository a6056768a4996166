"""The stream of images or of video packets of a recording, accessed by frame; frames of another size are left out."""

import contextlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib_core.arrays import Indices, TimesNs, frozen_array
from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import DataWarning, TimeNs
from calib_core.recordings.camera.images import EncodedImage, ImageLayout, encoded_pixels
from calib_core.recordings.camera.video_packets import Packet, PacketDecoder
from calib_core.recordings.time.written_times import utc
from calib_core.recordings.topics import Topic

_HEAD_BYTES = 4096
_SOUGHT_MESSAGES = 2000
_SAMPLED_FRAMES = 64
_SHOWN_TIMES = 3


@dataclass(frozen=True, slots=True, eq=False)
class ImageStream:
    """The frames of one image topic, read one at a time.

    Attributes:
        topic: the image topic.
        layouts: one per part of the topic.
        times_ns: (m,) stamps, ascending and unique.
        row: (m,) the message of each frame.
        repeated: how many messages were skipped because another frame has the same stamp.
        usual_px: width and height of the frames in use; None if they were not compared.
    """

    topic: Topic
    layouts: Sequence[ImageLayout]
    times_ns: TimesNs
    row: Indices
    repeated: int = field(default=0)
    usual_px: tuple[int, int] | None = None

    @classmethod
    def build(cls, topic: Topic, layouts: Sequence[ImageLayout], stamps_ns: TimesNs) -> "ImageStream":
        """Sort the frames by time; of frames with the same stamp, keep the first received."""
        times_ns, row = np.unique(stamps_ns, return_index=True)
        return cls(
            topic,
            layouts,
            frozen_array(times_ns, (None,), dtype=np.int64),
            frozen_array(row, (None,), dtype=np.int64),
            len(stamps_ns) - len(times_ns),
        )

    def encoded(self, index: int) -> EncodedImage:
        """Return a frame as an image file.

        Raises:
            MessageError: it cannot be read, or has another size than the others.
        """
        layout, payload = self._frame(index)
        image = layout.encoded(payload)
        self._require_usual((image.width_px, image.height_px))
        return image

    def image(self, index: int) -> np.ndarray:
        """Return a frame's pixels, blue first.

        Raises:
            MessageError: it cannot be read, or has another size than the others.
        """
        layout, payload = self._frame(index)
        pixels = layout.image(payload)
        self._require_usual((pixels.shape[1], pixels.shape[0]))
        return pixels

    def sizes_px(self, indices: Indices) -> list[tuple[int, int] | MessageError]:
        """Return width and height of some frames from their first bytes, or why a frame cannot be read."""
        heads = self.topic.heads(self.row[indices], _HEAD_BYTES)
        found: list[tuple[int, int] | MessageError] = []
        for index, head, length in zip(indices.tolist(), heads.rows, heads.lengths.tolist(), strict=True):
            layout = self.layouts[int(self.topic.part[self.row[index]])]
            size = layout.size_in_head(head[: max(length, 0)].tobytes())
            found.append(size if size is not None else self._size_or_fault(index))
        return found

    def keep(self, kept: np.ndarray, usual_px: tuple[int, int]) -> "ImageStream":
        """Keep the frames (m,) marked True, which have this size."""
        return replace(self, times_ns=self.times_ns[kept], row=self.row[kept], usual_px=usual_px)

    def _size_or_fault(self, index: int) -> tuple[int, int] | MessageError:
        try:
            return self.size_px(index)
        except RecordingError as error:
            return error if isinstance(error, MessageError) else MessageError(str(error))

    def _require_usual(self, size_px: tuple[int, int]) -> None:
        if self.usual_px is not None and size_px != self.usual_px:
            raise MessageError(
                f"topic {self.topic.name}: this frame has {size_px[0]} x {size_px[1]} pixels, the others have "
                f"{self.usual_px[0]} x {self.usual_px[1]}; choose another frame"
            )

    def size_px(self, index: int) -> tuple[int, int]:
        """Return a frame's width and height, without decoding it."""
        layout, payload = self._frame(index)
        return layout.size_px(payload)

    def recorded_as(self, index: int) -> str:
        """Return the format a frame was recorded in."""
        layout, payload = self._frame(index)
        return layout.recorded_as(payload)

    def _frame(self, index: int) -> tuple[ImageLayout, bytes]:
        """Return a frame's message and its layout."""
        row = int(self.row[index])
        return self.layouts[int(self.topic.part[row])], self.topic.payload(row)


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
        return encoded_pixels(self.image(index))

    def image(self, index: int) -> np.ndarray:
        """Return a frame's pixels, blue first.

        Raises:
            MessageError: it cannot be decoded.
        """
        assert self.decoder is not None
        try:
            return self.decoder.image(int(self.row[index]))
        except MessageError as error:
            raise MessageError(f"topic {self.topic.name}: {error}") from error

    def size_px(self, index: int) -> tuple[int, int]:
        """Return a frame's width and height."""
        height, width = self.image(index).shape[:2]
        return width, height


def image_stream(topic: Topic, layouts: Sequence[ImageLayout], stamps_ns: TimesNs) -> ImageStream:
    """Build the stream of an image topic with images or video."""
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


def video_warnings(images: ImageStream | None) -> list[DataWarning]:
    """Warn about frames that cannot be decoded because the recording began between key frames."""
    if not isinstance(images, VideoStream) or not images.before_key:
        return []
    return [
        DataWarning.reported(
            "video-before-key",
            f"the first {images.before_key} frames of {images.topic.name} precede its first key frame and are skipped",
            "no action needed unless a placement is there; in that case have the encoder send key frames more often",
        )
    ]


def frames_of_one_size(images: ImageStream | None) -> tuple[ImageStream | None, list[DataWarning]]:
    """Drop frames of an unusual size and frames that are no images, with a warning for each kind.

    All frames of a short recording are examined. Of a longer one, frames spread over it are examined, and all if those
    differ; a frame that differs from them all is refused when it is read.
    """
    if images is None or isinstance(images, VideoStream) or not len(images.times_ns):
        return images, []
    count = len(images.times_ns)
    indices = np.unique(np.linspace(0, count - 1, min(_SAMPLED_FRAMES, count)).astype(np.int64))
    found = images.sizes_px(indices)
    sizes = Counter(size for size in found if not isinstance(size, MessageError))
    if not sizes:
        return images, []  # reported for the topic
    if len(indices) < count and (len(sizes) > 1 or sizes.total() < len(found)):
        found = images.sizes_px(np.arange(count))
        sizes = Counter(size for size in found if not isinstance(size, MessageError))
    usual = sizes.most_common(1)[0][0]
    if sizes[usual] == len(found):
        return images.keep(np.ones(count, dtype=bool), usual), []
    kept = np.array([size == usual for size in found])
    warnings = [*_size_warnings(images, found, usual), *_unreadable_warnings(images, found)]
    return images.keep(kept, usual), warnings


def _size_warnings(
    images: ImageStream, found: Sequence[tuple[int, int] | MessageError], usual: tuple[int, int]
) -> list[DataWarning]:
    sizes = Counter(size for size in found if not isinstance(size, MessageError))
    if len(sizes) == 1:
        return []
    others = [
        f"{count} have {width} x {height} ({_times(images, [n for n, size in enumerate(found) if size == (width, height)])})"
        for (width, height), count in sizes.most_common()[1:]
    ]
    return [
        DataWarning.reported(
            "picture-sizes",
            f"{images.topic.name} has images of several sizes: {sizes[usual]} have {usual[0]} x {usual[1]} pixels and are "
            f"used; {', '.join(others)} and are skipped",
            "if the skipped ones are those you need, record again with one size, or open their part of the recording alone",
        )
    ]


def _unreadable_warnings(images: ImageStream, found: Sequence[tuple[int, int] | MessageError]) -> list[DataWarning]:
    rows = [number for number, size in enumerate(found) if isinstance(size, MessageError)]
    if not rows:
        return []
    return [
        DataWarning.reported(
            "unreadable-pictures",
            f"{len(rows)} of {len(found)} images of {images.topic.name} cannot be read and are skipped "
            f"({_times(images, rows)}): {found[rows[0]]}",
            "no action needed unless a placement is there; if there are many, copy the recording again from its source",
        )
    ]


def _times(images: ImageStream, rows: Sequence[int]) -> str:
    times = [utc(TimeNs(int(images.times_ns[row]))) for row in rows[:_SHOWN_TIMES]]
    return ", ".join(times) + (f" and {len(rows) - _SHOWN_TIMES} more" if len(rows) > _SHOWN_TIMES else "")
