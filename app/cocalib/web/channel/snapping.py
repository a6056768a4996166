"""Snapping: the reflector's apex near a pixel of a frame, searched off the event loop."""

import asyncio
from concurrent.futures import Executor

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import InputError
from calib_core.vision import Apex, NoApex, find_apex
from cocalib.web.frames import Frame, FrameStore
from cocalib.web.messages import Snapped, SnapWanted


async def snapped(wanted: SnapWanted, moments: TimesNs, frames: FrameStore, executor: Executor) -> Snapped:
    """Search for the apex near a pixel.

    Args:
        wanted: by a page.
        moments: (m,) stamps of the frames [ns], ascending.
        frames: of the recording.
        executor: where to decode and search.

    Raises:
        InputError: no frame has this stamp, or the frame cannot be shown.
        MessageError: the frame cannot be read.
    """
    if not len(frames):
        raise InputError("this recording has no pictures to snap in; open one with a camera topic")
    index = int(np.searchsorted(moments, wanted.image_time))
    if index == len(moments) or int(moments[index]) != wanted.image_time:
        raise InputError(f"no frame has the stamp {wanted.image_time}; the picture may belong to another recording")
    frame = await frames.get(index)
    answer = await asyncio.get_running_loop().run_in_executor(executor, _search, frame, wanted.pixel_px)
    if isinstance(answer, NoApex):
        return Snapped(None, None, f"No corner found: {answer.reason}.", wanted.id)
    column, row = (float(value) for value in answer.pixel_px)
    words = f"Snapped to the reflector's apex, with a standard deviation of {answer.sigma_px:.2f} px."
    return Snapped((column, row), answer.sigma_px, words, wanted.id)


def _search(frame: Frame, pixel_px: tuple[float, float]) -> Apex | NoApex:
    import cv2

    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    grey = cv2.imdecode(np.frombuffer(frame.data, dtype=np.uint8), flags)
    if grey is None:
        raise InputError(f"frame {frame.index + 1} cannot be decoded; snap in another frame of this placement")
    return find_apex(np.asarray(grey), np.array(pixel_px))
