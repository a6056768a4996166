"""Camera frames for the page and the 3D view: untouched bytes, smaller ones, ones without distortion; made off the event loop."""

import asyncio
import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.rectification import rectification_maps, rectified_camera
from calib_core.recordings import Recording
from cocalib.web.messages.outgoing import FrameHeader

Size = Literal["full", "half", "thumbnail", "rectified"]

_HALF_ABOVE_PX = 2_500_000
"""Images with more pixels than this are sent at half size while playing [px]."""
_THUMBNAIL_WIDTH_PX = 480
_BUDGET_BYTES = 16 << 20
"""Enough for the frames read ahead and those just shown: the recording's file, which the system caches, has all the others."""
_PROXY_QUALITY, _THUMBNAIL_QUALITY, _RECTIFIED_QUALITY = 85, 80, 92


@dataclass(frozen=True, slots=True)
class Frame:
    """One compressed image.

    Attributes:
        header: what it is; the number of the request is set when it is sent.
        data: JPEG or PNG bytes.
    """

    header: FrameHeader
    data: bytes


class FrameStore:
    """Frames by index and size, cached by last use; concurrent requests share one read. Runs on one event loop."""

    def __init__(
        self,
        source: Recording,
        count: int,
        executor: Executor,
        *,
        budget_bytes: int = _BUDGET_BYTES,
        camera: Callable[[], Camera | None] = lambda: None,
    ) -> None:
        self._source = source
        self._count = count
        self._executor = executor
        self._budget_bytes = budget_bytes
        self._kept: OrderedDict[tuple[int, Size], Frame] = OrderedDict()
        self._kept_bytes = 0
        self._coming: dict[tuple[int, Size], asyncio.Task[Frame]] = {}
        self._closed = False
        self._camera = camera
        self._rectified_with: Camera | None = None
        self._rectifier = _FrameRectifier()

    def __len__(self) -> int:
        return self._count

    def extend(self, count: int) -> None:
        """Take note of the number of frames that there are now; those before keep their indices."""
        self._count = max(self._count, count)

    @property
    def kept_bytes(self) -> int:
        """Size of the frames in memory [bytes]."""
        return self._kept_bytes

    async def get(self, index: int, size: Size = "full") -> Frame:
        """Return a frame, from memory or made in the executor.

        Raises:
            IndexError: there is no such frame, or the store is closed.
        """
        if self._closed:
            raise IndexError("the server is stopping")
        if not 0 <= index < self._count:
            raise IndexError(f"frame {index} of {self._count}")
        if size == "rectified":
            self._forget_others(self._camera())
        key = (index, size)
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        task = self._coming.get(key)
        if task is None:
            task = asyncio.get_running_loop().create_task(self._make(key))
            self._coming[key] = task
        return await asyncio.shield(task)  # a client that leaves must not cancel the frame for the others

    def prefetch(self, index: int, size: Size, step: int, *, ahead: int = 3) -> None:
        """Start reading the next frames in the direction of playback."""
        for next_index in range(index + step, index + step * (ahead + 1), step) if step and not self._closed else ():
            key: tuple[int, Size] = (next_index, size)
            if 0 <= next_index < self._count and key not in self._kept and key not in self._coming:
                task = asyncio.get_running_loop().create_task(self._make(key))
                task.add_done_callback(_retrieve)
                self._coming[key] = task

    async def close(self) -> None:
        """Cancel pending reads and start no more, so that the event loop can end."""
        self._closed = True
        coming = list(self._coming.values())
        for task in coming:
            task.cancel()
        await asyncio.gather(*coming, return_exceptions=True)

    async def _make(self, key: tuple[int, Size]) -> Frame:
        index, size = key
        make = partial(self._rectified, self._camera()) if size == "rectified" else partial(_MAKERS[size], self._source)
        try:
            frame = await asyncio.get_running_loop().run_in_executor(self._executor, make, index)
        finally:
            self._coming.pop(key, None)
        self._kept[key] = frame
        self._kept_bytes += len(frame.data)
        while self._kept_bytes > self._budget_bytes and len(self._kept) > 1:
            _, dropped = self._kept.popitem(last=False)
            self._kept_bytes -= len(dropped.data)
        return frame

    def _rectified(self, camera: Camera | None, index: int) -> Frame:
        """Make a rectified frame.

        Raises:
            InputError: there are no intrinsics, or they cannot rectify it.
        """
        full = _full(self._source, index)
        rectified = self._rectifier.rectified(_decoded(full.data, 1), camera)
        header = replace(full.header, format="jpeg", rectified=True)
        return Frame(header, _encoded(rectified, _RECTIFIED_QUALITY))

    def _forget_others(self, camera: Camera | None) -> None:
        """Forget the frames that were rectified with another camera."""
        if camera is self._rectified_with:
            return
        self._rectified_with = camera
        for table in (self._kept, self._coming):
            for key in [key for key in table if key[1] == "rectified"]:
                dropped = table.pop(key)
                self._kept_bytes -= len(dropped.data) if isinstance(dropped, Frame) else 0


def _retrieve(task: "asyncio.Task[Frame]") -> None:
    """Consume the outcome of a prefetch that nobody awaits; a later request for the frame raises its error."""
    if not task.cancelled():
        task.exception()


def _full(source: Recording, index: int) -> Frame:
    image = source.image_bytes(index)
    return Frame(FrameHeader(index, 0, image.width_px, image.height_px, 1.0, image.format), image.data)


def _half(source: Recording, index: int) -> Frame:
    """Halve a large image; return a small one as it is."""
    full = _full(source, index)
    if full.header.width_px * full.header.height_px <= _HALF_ABOVE_PX:
        return full
    return Frame(replace(full.header, scale=0.5, format="jpeg"), _encoded(_decoded(full.data, 2), _PROXY_QUALITY))


def _thumbnail(source: Recording, index: int) -> Frame:
    """Shrink an image for the frustum of the 3D view."""
    import cv2

    full = _full(source, index)
    width_px, height_px = full.header.width_px, full.header.height_px
    if width_px <= _THUMBNAIL_WIDTH_PX and full.header.format == "jpeg":
        return full
    shrink = next((factor for factor in (8, 4, 2) if width_px >= factor * _THUMBNAIL_WIDTH_PX), 1)
    pixels = _decoded(full.data, shrink)
    scale = min(1.0, _THUMBNAIL_WIDTH_PX / width_px)
    size = (max(1, round(width_px * scale)), max(1, round(height_px * scale)))
    data = _encoded(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), _THUMBNAIL_QUALITY)
    return Frame(replace(full.header, scale=scale, format="jpeg"), data)


def _decoded(data: bytes, shrink: int) -> np.ndarray:
    import cv2

    flags = {
        1: cv2.IMREAD_COLOR,
        2: cv2.IMREAD_REDUCED_COLOR_2,
        4: cv2.IMREAD_REDUCED_COLOR_4,
        8: cv2.IMREAD_REDUCED_COLOR_8,
    }
    pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags[shrink] | cv2.IMREAD_IGNORE_ORIENTATION)
    if pixels is None:
        raise ValueError("the image cannot be decoded")
    return np.asarray(pixels)


CROP_PX = 96
"""Side of the cut-out of a mark on the contact sheet."""


def crop(data: bytes, u_px: float, v_px: float, side_px: int) -> bytes:
    """Return the square of an image around a pixel as a small JPEG.

    Args:
        data: of the recorded image.
        u_px: column of the middle.
        v_px: row of the middle.
        side_px: of the square in the image; more than `CROP_PX` is shrunk to it.
    """
    import cv2

    square = cv2.getRectSubPix(_decoded(data, 1), (side_px, side_px), (u_px, v_px))
    if side_px > CROP_PX:
        square = cv2.resize(square, (CROP_PX, CROP_PX), interpolation=cv2.INTER_AREA)
    return _encoded(square, 85)


def _encoded(pixels: np.ndarray, quality: int) -> bytes:
    import cv2

    done, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise ValueError("the image cannot be encoded")
    return data.tobytes()


_MAKERS: dict[str, Callable[[Recording, int], Frame]] = {"full": _full, "half": _half, "thumbnail": _thumbnail}


class _FrameRectifier:
    """Rectifies images; the maps of one camera are kept. Every method may be called from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._camera: Camera | None = None
        self._maps: tuple[np.ndarray, np.ndarray] | None = None

    def rectified(self, pixels: np.ndarray, camera: Camera | None) -> np.ndarray:
        """Return an image (h, w, 3) rectified with the intrinsics of its camera; the same size.

        Raises:
            InputError: there are no intrinsics, they are for images of another size, or the lens cannot be rectified.
        """
        import cv2

        if camera is None:
            raise InputError("there are no intrinsics to rectify it with; calibrate the lens in the menu under Lens")
        if pixels.shape[:2] != (camera.height_px, camera.width_px):
            raise InputError(
                f"the intrinsics are for {camera.width_px} x {camera.height_px} px, and the image has "
                f"{pixels.shape[1]} x {pixels.shape[0]}"
            )
        columns, rows = self._maps_of(camera)
        return np.asarray(cv2.remap(pixels, columns, rows, cv2.INTER_LINEAR))

    def _maps_of(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        import cv2

        with self._lock:
            if self._maps is None or self._camera is not camera:
                maps = rectification_maps(camera, rectified_camera(camera))
                self._maps = cv2.convertMaps(maps.x_px, maps.y_px, cv2.CV_16SC2)
                self._camera = camera
            return self._maps
