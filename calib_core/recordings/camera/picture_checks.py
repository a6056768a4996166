"""Check that pictures are whole: by their first and last bytes, or by decoding them."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from tempfile import TemporaryFile
from typing import IO

from calib_core.errors import MessageError
from calib_core.recordings.camera.images import ImageLayout
from calib_core.recordings.camera.jpeg import JPEG_MAGIC, has_end

_CUT = "the JPEG has no end marker: it is cut off"


@dataclass(slots=True)
class PictureCheck:
    """Checks the pictures of one topic, one after the other.

    Attributes:
        layout: of the topic's messages.
        decode: whether to decode each picture.
        open_ended: number of pictures without an end marker, which some drivers never write.
        pictures: number of pictures checked.
    """

    layout: ImageLayout
    decode: bool
    open_ended: int = 0
    pictures: int = 0
    _decoder: "_Complaints" = field(default_factory=lambda: _Complaints())

    def check(self, payload: bytes) -> None:
        """Check one message.

        Raises:
            MessageError: it contains no picture, or a damaged one.
        """
        self.pictures += 1
        if self.layout.packet(payload) is not None:
            return
        self.layout.size_px(payload)
        start = payload.find(JPEG_MAGIC) if self.layout.compressed else -1
        if start >= 0 and not has_end(payload[start:]):
            self.open_ended += 1
        if self.decode:
            with self._decoder.heard() as said:
                self.layout.picture(payload)
            if said:
                raise MessageError(f"topic {self.layout.topic}: the decoder says: {said[0]}")

    def cut_off(self) -> tuple[int, str]:
        """Return how many pictures are cut off, and why; none if the driver writes no end markers at all."""
        habit = self.open_ended > self.pictures / 2
        return (0, "") if habit or not self.open_ended else (self.open_ended, _CUT)


class _Complaints:
    """What the picture decoder prints to the standard error of the process: its only sign of damage it passes over."""

    @contextmanager
    def heard(self) -> Iterator[list[str]]:
        """Collect the lines printed meanwhile."""
        said: list[str] = []
        sys.stderr.flush()
        kept = os.dup(2)
        with TemporaryFile() as heard:
            os.dup2(heard.fileno(), 2)
            try:
                yield said
            finally:
                os.dup2(kept, 2)
                os.close(kept)
                said.extend(_lines(heard))


def _lines(file: IO[bytes]) -> list[str]:
    file.seek(0)
    return [line for line in file.read(1 << 16).decode("utf-8", "replace").splitlines() if line.strip()]
