"""The frames of a recording, as pictures in which a board may be."""

import hashlib

import numpy as np

from calib_core.input_files import name_text
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import Recording


class RecordedPictures:
    """The frames of a recording's camera, by number."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording

    def __len__(self) -> int:
        return len(self._recording.image_times)

    def name(self, index: int, /) -> str:
        """Return a frame's number and its time since the first one."""
        times = self._recording.image_times
        return f"frame {index + 1} ({(int(times[index]) - int(times[0])) / NS_PER_S:.2f} s)"

    def time_ns(self, index: int, /) -> TimeNs | None:
        """Return a frame's stamp."""
        return TimeNs(int(self._recording.image_times[index]))

    def picture(self, index: int, /) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first.

        Raises:
            CalibrationError: it cannot be read.
        """
        return self._recording.image(index)

    def digest(self) -> str:
        """Return a hash of the names and sizes of the files, the topic and the stamps: whether they are the same as earlier."""
        recording = self._recording
        digest = hashlib.sha256(f"{recording.image_topic}\0".encode())
        for source in recording.sources:
            digest.update(f"{name_text(source.path.name)}\0{source.size_bytes}\0".encode())
        digest.update(np.ascontiguousarray(recording.image_times).tobytes())
        return digest.hexdigest()
