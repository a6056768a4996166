"""Decode video topics: one encoded frame per message, of which only key frames can be decoded alone."""

import re
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.camera.jpeg import JPEG_MAGIC, PNG_MAGIC
from calib_core.recordings.messages.decoding import Message

_CODECS = {"h264": "h264", "avc": "h264", "h265": "hevc", "hevc": "hevc"}
_START = re.compile(rb"\x00\x00\x01(.)", re.DOTALL)
_LOOK_BYTES = 4096
_LOOK_AHEAD = 16
_KEPT_IMAGES = 8
_INSTALL = "pip install 'cocalib[video]'"


@dataclass(frozen=True, slots=True)
class Packet:
    """One encoded frame.

    Attributes:
        codec: FFmpeg's name.
        data: the bytes, with start codes (Annex B).
        key: whether decoding can begin here.
    """

    codec: str
    data: bytes
    key: bool


def packet_of(message: Message) -> Packet | None:
    """Extract the encoded frame of a foxglove CompressedVideo, CompressedImage or FFMPEGPacket; None if it is an image."""
    said = next((message.text(name) for name in ("format", "encoding") if name in message), "").lower()
    words = re.findall(r"[a-z0-9]+", said.replace(".", "").replace("libx", "h").replace("_", " "))
    codec = next((_CODECS[word] for word in words if word in _CODECS), None)
    if codec is None:
        return None
    data = message.octets("data").tobytes()
    if data.startswith((JPEG_MAGIC, PNG_MAGIC)):
        return None
    flagged = "flags" in message and bool(message.whole("flags") & 1)
    return Packet(codec, data, flagged or _begins_with_key(codec, data))


def _begins_with_key(codec: str, data: bytes) -> bool:
    """Return whether decoding can begin here, from the first stream units: parameter sets or an independent image."""
    for match in _START.finditer(data[:_LOOK_BYTES]):
        unit = match[1][0]
        kind = unit & 0x1F if codec == "h264" else unit >> 1 & 0x3F
        if kind in ((5, 7) if codec == "h264" else (16, 17, 18, 19, 20, 21, 32, 33)):
            return True
    return False


def require_codec(packet: Packet) -> None:
    """Check that the decoder is installed.

    Raises:
        MessageError: it is not, or the packet has no start codes; the text says what to do.
    """
    if find_spec("av") is None:
        raise MessageError(f"its images are {packet.codec} video, which needs PyAV; install it with: {_INSTALL}")
    if b"\0\0\1" not in packet.data[:_LOOK_BYTES]:
        raise MessageError(
            f"its images are declared as {packet.codec} but have no start codes (Annex B); record them as foxglove "
            "CompressedVideo or with ffmpeg_image_transport"
        )


class PacketDecoder:
    """Decode frames of a video topic in any order: the next frame directly, others from the key frame before them.

    Args:
        packet: returns the packet of a message by its number.
        count: number of messages.
    """

    def __init__(self, packet: Callable[[int], Packet], count: int) -> None:
        self._packet = packet
        self._count = count
        self._lock = threading.Lock()
        self._kept: OrderedDict[int, np.ndarray] = OrderedDict()
        self._context: Any = None
        self._next = -1

    def image(self, number: int) -> np.ndarray:
        """Return the pixels of a message's frame: uint8 (h, w, 3), blue first.

        Raises:
            MessageError: there is no key frame before it, or the video is damaged.
        """
        with self._lock:
            if number in self._kept:
                return self._kept[number]
            begin = self._key_before(number)
            if self._context is None or not begin <= self._next <= number:
                self._restart(begin)
            for step in range(self._next, min(number + _LOOK_AHEAD, self._count)):
                self._feed(step)
                if number in self._kept:
                    return self._kept[number]
        raise MessageError(f"frame {number} of the video cannot be decoded; choose another frame")

    def _key_before(self, number: int) -> int:
        place = number
        while place >= 0:
            if place == self._next and self._context is not None:
                return place  # everything up to here is already decoded
            if self._packet(place).key:
                return place
            place -= 1
        raise MessageError(f"frame {number} of the video comes before its first key frame; choose a later one")

    def _restart(self, begin: int) -> None:
        import av

        self._context = av.CodecContext.create(self._packet(begin).codec, "r")
        self._context.thread_count = 1  # several threads would delay the output of frames
        self._next = begin

    def _feed(self, number: int) -> None:
        import av

        data = self._packet(number).data
        if not data:
            self._context = None
            raise MessageError(f"frame {number} of the video is empty; choose another frame")
        packet = av.Packet(data)
        packet.pts = number
        self._next = number + 1
        try:
            frames = self._context.decode(packet)
        except av.FFmpegError as error:
            self._context = None
            raise MessageError(f"frame {number} of the video is damaged ({error}); choose another frame") from error
        for frame in frames:
            self._kept[int(frame.pts)] = frame.to_ndarray(format="bgr24")
        while len(self._kept) > _KEPT_IMAGES:
            self._kept.popitem(last=False)
