"""Keep the frames of one size that can be read: pixels of two sizes cannot share intrinsics, nor one picture be clicked."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from calib_core.errors import MessageError
from calib_core.measurements import TimeNs
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.camera.video_stream import VideoStream
from calib_core.recordings.time.dates import utc
from calib_core.results import DataWarning

_SAMPLED_FRAMES = 64
_SHOWN_TIMES = 3


def frames_of_one_size(images: ImageStream | None) -> tuple[ImageStream | None, list[DataWarning]]:
    """Drop frames of an unusual size and frames that are no pictures, with a warning for each kind.

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
    warnings = [*_about_sizes(images, found, usual), *_about_unreadable(images, found)]
    return images.keep(kept, usual), warnings


def _about_sizes(
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
        DataWarning(
            "picture-sizes",
            f"{images.topic.name} has pictures of several sizes: {sizes[usual]} have {usual[0]} x {usual[1]} pixels and are "
            f"used; {', '.join(others)} and are skipped",
            "if the skipped ones are those you need, record again with one size, or open their part of the recording alone",
        )
    ]


def _about_unreadable(images: ImageStream, found: Sequence[tuple[int, int] | MessageError]) -> list[DataWarning]:
    rows = [number for number, size in enumerate(found) if isinstance(size, MessageError)]
    if not rows:
        return []
    return [
        DataWarning(
            "unreadable-pictures",
            f"{len(rows)} of {len(found)} pictures of {images.topic.name} cannot be read and are skipped "
            f"({_times(images, rows)}): {found[rows[0]]}",
            "no action needed unless a placement is there; if there are many, copy the recording again from its source",
        )
    ]


def _times(images: ImageStream, rows: Sequence[int]) -> str:
    times = [utc(TimeNs(int(images.times_ns[row]))) for row in rows[:_SHOWN_TIMES]]
    return ", ".join(times) + (f" and {len(rows) - _SHOWN_TIMES} more" if len(rows) > _SHOWN_TIMES else "")
