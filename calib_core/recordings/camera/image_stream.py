"""The stream of images of a recording, accessed by frame."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib_core.arrays import Indices, TimesNs, frozen_array
from calib_core.errors import MessageError, RecordingError
from calib_core.recordings.camera.images import EncodedImage, ImageLayout
from calib_core.recordings.topics import Topic

_HEAD_BYTES = 4096


def _no_layouts() -> dict[int, ImageLayout]:
    return {}


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

    def picture(self, index: int) -> np.ndarray:
        """Return a frame's pixels, blue first.

        Raises:
            MessageError: it cannot be read, or has another size than the others.
        """
        layout, payload = self._frame(index)
        pixels = layout.picture(payload)
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
