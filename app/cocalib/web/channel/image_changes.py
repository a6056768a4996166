"""How much the image changes from one frame to the next, for the timeline; compared in the background, coarse to fine."""

import asyncio
import logging
import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import CalibrationError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import Recording

_MOST = 300
"""Number of frames that are compared with the next one; more are not visible in the timeline."""
_REST = 8
"""After each comparison, as many times its length is left to others."""
_LEAST_REST_S, _PAUSE_S = 0.02, 0.5
_ACROSS = 160
"""Columns of the small grey images that are compared [px]."""
_LARGEST_SHARE = 99.0
"""Percentile of the differences within a pair of images: a person far away covers about a hundredth of the image."""
_NEXT_INTERVALS = 5
"""A frame this many usual intervals later is not the next one: there is a gap."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ImageChanges:
    """What is known so far.

    Attributes:
        seconds: when, from the first frame [s], ascending.
        grey_levels: how much the most changed hundredth of the image changes until the next frame.
        complete: no more will come.
    """

    seconds: tuple[float, ...] = ()
    grey_levels: tuple[float, ...] = ()
    complete: bool = False


def comparison_order(moments: TimesNs) -> list[int]:
    """Return the frames to compare with the next one, so that those first in the list already span the recording.

    Args:
        moments: (m,) stamps of the frames [ns], ascending.
    """
    intervals = np.diff(moments)
    if not len(intervals):
        return []
    near = np.flatnonzero(intervals <= _NEXT_INTERVALS * np.median(intervals))
    chosen = near[np.unique(np.linspace(0, len(near) - 1, min(_MOST, len(near))).round().astype(int))].tolist()
    order: list[int] = []
    for step in (32, 16, 8, 4, 2, 1):
        order += [frame for frame in chosen[::step] if frame not in set(order)]
    return order


async def changes_of(
    source: Recording,
    moments: TimesNs,
    executor: Executor,
    tell: Callable[[ImageChanges], None],
    is_busy: Callable[[], bool],
) -> None:
    """Compare frames with the next ones, in the background and only while nobody plays.

    Args:
        source: the recording.
        moments: (m,) stamps of its frames [ns].
        executor: where images are decoded.
        tell: takes what is known, again and again.
        is_busy: whether someone plays now.
    """
    order, found = comparison_order(moments), dict[int, float]()
    for count, index in enumerate(order, start=1):
        while is_busy():
            await asyncio.sleep(_PAUSE_S)
        started = time.monotonic()
        try:
            change = await asyncio.get_running_loop().run_in_executor(executor, _change, source, index)
            if change is not None:
                found[index] = change
        except CalibrationError as error:
            _log.info("frame %d could not be compared with the next one: %s", index, error)
        tell(_known_changes(found, moments, complete=count == len(order)))
        await asyncio.sleep(max(_LEAST_REST_S, _REST * (time.monotonic() - started)))


def _known_changes(found: dict[int, float], moments: TimesNs, *, complete: bool) -> ImageChanges:
    frames = sorted(found)
    seconds = tuple(round(int(moments[frame] - moments[0]) / NS_PER_S, 3) for frame in frames)
    return ImageChanges(seconds, tuple(found[frame] for frame in frames), complete)


def _change(source: Recording, index: int) -> float | None:
    """Compare a frame with the next one [grey levels]; None if one of them cannot be decoded."""
    import cv2

    before, after = (_small(source.image_bytes(frame).data) for frame in (index, index + 1))
    if before is None or after is None or before.shape != after.shape:
        return None
    difference = cv2.blur(
        cv2.absdiff(before, after).astype(np.float32), (3, 3)
    )  # noise averages out, a person does not
    return round(float(np.percentile(difference, _LARGEST_SHARE)), 1)


def _small(data: bytes) -> np.ndarray | None:
    """Decode an image to a small grey one (h, w)."""
    import cv2

    flags = cv2.IMREAD_REDUCED_GRAYSCALE_4 | cv2.IMREAD_IGNORE_ORIENTATION
    pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    if pixels is None:
        return None
    height_px = max(1, round(pixels.shape[0] * _ACROSS / pixels.shape[1]))
    return np.asarray(cv2.resize(pixels, (_ACROSS, height_px), interpolation=cv2.INTER_AREA))
