"""Encode frames with the best codec that PyAV has, each at its recorded time."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import video_format

_CODECS = {
    "libx264": ("H.264", {"preset": "veryfast", "crf": "21"}),
    "libopenh264": ("H.264", {}),
    "mpeg4": ("MPEG-4", {"qscale": "3"}),
    "mjpeg": ("Motion JPEG", {"qscale": "3"}),
}
"""In order of preference; the first that this build of PyAV can write is used."""
_TICKS_PER_S = 60_000
"""MPEG-4 allows at most 65535."""
_BT709, _LIMITED_RANGE = 1, 1


@dataclass(slots=True)
class Encoder:
    """A video that is being written.

    Attributes:
        codec: what it is encoded with, for the user.
    """

    codec: str
    container: Any
    stream: Any
    start: TimeNs | None = None
    ticks: int = -1

    def add(self, picture: np.ndarray, time: TimeNs) -> None:
        """Append a frame.

        Args:
            picture: uint8 (h, w, 3), blue first, of the size given.
            time: its stamp.
        """
        import av

        self.start = time if self.start is None else self.start
        self.ticks = max(self.ticks + 1, round((time - self.start) * _TICKS_PER_S / NS_PER_S))
        frame = av.VideoFrame.from_ndarray(picture, format="bgr24")
        frame = frame.reformat(format=self.stream.pix_fmt, dst_colorspace="ITU709")
        frame.pts, frame.time_base = self.ticks, Fraction(1, _TICKS_PER_S)
        self.container.mux(self.stream.encode(frame))

    def finish(self) -> None:
        """Write what the codec still holds back."""
        self.container.mux(self.stream.encode(None))


@contextmanager
def encoding(path: Path, size_px: tuple[int, int], frames_per_s: float) -> Iterator[Encoder]:
    """Yield an encoder that writes a file; the caller finishes it.

    Args:
        path: of the video.
        size_px: width and height, both even.
        frames_per_s: on average.

    Raises:
        InputError: PyAV is missing or has no codec, or the suffix is not supported.
    """
    form = video_format(path)
    import av

    name = next((name for name in _CODECS if _can_write(name)), None)
    if name is None:
        raise InputError(
            f"PyAV has none of the codecs {', '.join(_CODECS)}; install the wheel: pip install 'cocalib[video]'"
        )
    label, options = _CODECS[name]
    with av.open(str(path), "w", format=form) as container:
        stream: Any = container.add_stream(name, rate=max(1, round(frames_per_s)), options=options)
        stream.width, stream.height = size_px
        stream.pix_fmt = "yuvj420p" if name == "mjpeg" else "yuv420p"
        stream.codec_context.time_base = Fraction(1, _TICKS_PER_S)
        stream.codec_context.colorspace = stream.codec_context.color_primaries = stream.codec_context.color_trc = _BT709
        if name != "mjpeg":
            stream.codec_context.color_range = _LIMITED_RANGE
        yield Encoder(label, container, stream)


def _can_write(name: str) -> bool:
    from av.codec import Codec
    from av.codec.codec import UnknownCodecError

    try:
        return bool(Codec(name, "w").name)
    except UnknownCodecError:
        return False
