"""Cut-outs of marks for the contact sheet: made one after the other, and kept in a file in the session's folder.

The file may be cut short or removed: what is missing is made again.
"""

import contextlib
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypeAlias

import numpy as np

from calib_core.recordings import Recording
from cocalib.session.file.guarded_folder import GuardedFolder, SessionFileError
from cocalib.view.model import View
from cocalib.web.frames import CROP_PX, crop

CropKey: TypeAlias = tuple[int, float, float, int]
"""Stamp of the image [ns], column and row of the middle, and side of the square in the image [px]."""
FILE = "crops"
_MOST_BYTES = 30_000_000
_RECORD = struct.Struct("<IIQddH")  # checksum of what follows, length of the JPEG, key


class Crops:
    """Cut-outs by their keys, read, made and written in `thread`, so that nothing else waits for them."""

    def __init__(self, recording: Recording, folder: Path, *, most_bytes: int = _MOST_BYTES) -> None:
        self.thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="crops")
        self._recording, self._folder, self._most_bytes = recording, folder, most_bytes
        self._kept: dict[CropKey, bytes] = {}
        self._size = 0
        self._marks: list[CropKey] = []
        self.thread.submit(self._read)

    def keep_marks(self, view: View) -> None:
        """Make the cut-outs of all marks, one at a time between those that are asked for."""
        self._marks = [(row.image_time.time, round(row.u_px, 2), round(row.v_px, 2), CROP_PX) for row in view.clicks]
        self.thread.submit(self._make_next)

    def end(self) -> None:
        """Read nothing more of the recording."""
        self.thread.shutdown(cancel_futures=True)

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
            self._keep(key, crop(self._recording.image_bytes(index).data, u_px, v_px, side_px))
        return self._kept[key]

    def _make_next(self) -> None:
        while self._marks:
            key = self._marks.pop()
            if key not in self._kept:
                self.thread.submit(self._make_next)
                self.get(key)
                return

    def _keep(self, key: CropKey, made: bytes) -> None:
        self._kept[key] = made
        self._size += _RECORD.size + len(made)
        if self._size > self._most_bytes:
            self._replace(dict(list(self._kept.items())[len(self._kept) // 2 :]))  # the older half makes room
            return
        self._on_disk(lambda folder: _append(folder, _record(key, made)))

    def _read(self) -> None:
        def read(folder: GuardedFolder) -> None:
            data = folder.read(FILE) or b""
            self._kept = dict(_records(data[: self._most_bytes]))
            self._size = sum(_RECORD.size + len(made) for made in self._kept.values())
            if self._size < len(data):  # a damaged end
                self._replace(self._kept)

        self._on_disk(read)

    def _replace(self, kept: dict[CropKey, bytes]) -> None:
        whole = b"".join(_record(*item) for item in kept.items())
        self._kept, self._size = kept, len(whole)
        self._on_disk(lambda folder: folder.replace(FILE, whole))

    def _on_disk(self, work: Callable[[GuardedFolder], None]) -> None:
        """Do what can be done in the session's folder; without it, cut-outs last as long as the program."""
        with contextlib.suppress(OSError, SessionFileError), contextlib.closing(GuardedFolder(self._folder)) as folder:
            work(folder)


def _append(folder: GuardedFolder, record: bytes) -> None:
    with os.fdopen(folder.open(FILE, os.O_WRONLY | os.O_APPEND | os.O_CREAT), "ab") as file:
        file.write(record)


def _record(key: CropKey, made: bytes) -> bytes:
    rest = _RECORD.pack(0, len(made), *key)[4:] + made
    return zlib.crc32(rest).to_bytes(4, "little") + rest


def _records(data: bytes) -> Iterator[tuple[CropKey, bytes]]:
    """Yield the cut-outs of a file, up to what is damaged."""
    at = 0
    while at + _RECORD.size <= len(data):
        checksum, length, *key = _RECORD.unpack_from(data, at)
        end = at + _RECORD.size + length
        if end > len(data) or zlib.crc32(data[at + 4 : end]) != checksum:
            return
        stamp, u_px, v_px, side_px = key
        yield (stamp, u_px, v_px, side_px), data[at + _RECORD.size : end]
        at = end
