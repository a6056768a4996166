"""Cut-outs of marks for the contact sheet: made one after the other, and kept in a file in the session's folder.

The file may be damaged or removed: what is missing is made again.
"""

import contextlib
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypeAlias

import msgspec
import numpy as np

from calib_core.recordings import Recording
from cocalib.session.file.guarded_folder import GuardedFolder, SessionFileError
from cocalib.view.model import View
from cocalib.web.frames import CROP_PX, crop

CropKey: TypeAlias = tuple[int, float, float, int]
"""Stamp of the image [ns], column and row of the middle, and side of the square in the image [px]."""
FILE = "crops"
_MOST_BYTES, _KEY_BYTES = 30_000_000, 64
"""Of the file, and at most of a key in it."""


class Crops:
    """Cut-outs by their keys, read, made and written in `thread`, so that nothing else waits for them."""

    def __init__(self, recording: Recording, folder: Path, *, most_bytes: int = _MOST_BYTES) -> None:
        self.thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="crops")
        self._recording, self._folder, self._most_bytes = recording, folder, most_bytes
        self._kept: dict[CropKey, bytes] = {}
        self._marks: list[CropKey] = []
        self._has_new = False
        self.thread.submit(self._read)

    def keep_marks(self, view: View) -> None:
        """Make the cut-outs of all marks, one at a time between those that are asked for."""
        self._marks = [
            (int(row.image_time.time), round(row.u_px, 2), round(row.v_px, 2), CROP_PX) for row in view.clicks
        ]
        self.thread.submit(self._make_next)

    def end(self) -> None:
        """Read nothing more of the recording."""
        self.thread.shutdown(cancel_futures=True)
        self._write()

    def get(self, key: CropKey) -> bytes:
        """Return a cut-out as JPEG, made if it is not kept.

        Raises:
            KeyError: no image has this stamp.
            ValueError: the image cannot be decoded.
        """
        if key not in self._kept:
            stamp, u_px, v_px, side_px = key
            times = self._recording.image_times
            index = int(np.searchsorted(times, stamp))
            if not 0 <= index < len(times) or times[index] != stamp:
                raise KeyError(stamp)
            self._kept[key] = crop(self._recording.image_bytes(index).data, u_px, v_px, side_px)
            self._has_new = True
        return self._kept[key]

    def _make_next(self) -> None:
        while self._marks:
            key = self._marks.pop()
            if key not in self._kept:
                self.thread.submit(self._make_next)
                self.get(key)
                return
        self._write()

    def _read(self) -> None:
        with contextlib.suppress(OSError, SessionFileError, msgspec.MsgspecError):
            with contextlib.closing(GuardedFolder(self._folder)) as folder:
                data = folder.read(FILE) or b""
            if zlib.crc32(data[4:]) == int.from_bytes(data[:4]):
                self._kept = msgspec.msgpack.decode(data[4:], type=dict[CropKey, bytes])

    def _write(self) -> None:
        """Write what is kept, the newest first up to the limit; without a folder it lasts as long as the program."""
        if not self._has_new:
            return
        self._has_new = False
        room = self._most_bytes
        for key, made in reversed(self._kept.copy().items()):
            room -= len(made) + _KEY_BYTES
            if room < 0:
                del self._kept[key]
        packed = msgspec.msgpack.encode(self._kept)
        with contextlib.suppress(OSError, SessionFileError), contextlib.closing(GuardedFolder(self._folder)) as folder:
            folder.replace(FILE, zlib.crc32(packed).to_bytes(4) + packed)
