"""The stream of images of a recording, accessed by frame."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Indices, TimesNs, frozen_array
from calib_core.recordings.camera.images import EncodedImage, ImageLayout
from calib_core.recordings.topics import Topic

__all__ = ["ImageStream"]


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
    """

    topic: Topic
    layouts: Sequence[ImageLayout]
    times_ns: TimesNs
    row: Indices
    repeated: int = field(default=0)

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
        """Return a frame as an image file."""
        layout, payload = self._frame(index)
        return layout.encoded(payload)

    def picture(self, index: int) -> np.ndarray:
        """Return a frame's pixels, blue first."""
        layout, payload = self._frame(index)
        return layout.picture(payload)

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
