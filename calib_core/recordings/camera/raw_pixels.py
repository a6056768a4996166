"""View the raw pixels of sensor_msgs/Image as an array without copying, and convert them to blue, green, red."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.messages.decoding import Message

_MAX_PIXELS = 200_000_000
READABLE = (
    "jpeg, png, mono8, mono16, rgb8, bgr8, rgba8, bgra8, their 16-bit kinds, bayer_*8, bayer_*16, yuv422, yuv422_yuy2 and "
    "H.264 are supported"
)
_DEPTH = ("16UC1", "32FC1", "16SC1")


@dataclass(frozen=True, slots=True)
class _Encoding:
    """Channels of a pixel, bytes per channel, and the name of OpenCV's conversion to blue, green, red ("" for none)."""

    channels: int
    conversion: str
    channel_bytes: int = 1


def _bayer(bits: int) -> dict[str, _Encoding]:
    return {
        f"bayer_{pattern}{bits}": _Encoding(1, f"COLOR_Bayer{pattern.upper()}2BGR", bits // 8)
        for pattern in ("rggb", "bggr", "gbrg", "grbg")
    }


_ENCODINGS: Mapping[str, _Encoding] = {
    "bgr8": _Encoding(3, ""), "8UC3": _Encoding(3, ""), "rgb8": _Encoding(3, "COLOR_RGB2BGR"),
    "bgra8": _Encoding(4, "COLOR_BGRA2BGR"), "8UC4": _Encoding(4, "COLOR_BGRA2BGR"), "rgba8": _Encoding(4, "COLOR_RGBA2BGR"),
    "mono8": _Encoding(1, "COLOR_GRAY2BGR"), "8UC1": _Encoding(1, "COLOR_GRAY2BGR"),
    "mono16": _Encoding(1, "COLOR_GRAY2BGR", 2),
    "bgr16": _Encoding(3, "", 2), "rgb16": _Encoding(3, "COLOR_RGB2BGR", 2),
    "bgra16": _Encoding(4, "COLOR_BGRA2BGR", 2), "rgba16": _Encoding(4, "COLOR_RGBA2BGR", 2),
    **_bayer(8), **_bayer(16),
    "yuv422": _Encoding(2, "COLOR_YUV2BGR_UYVY"), "uyvy": _Encoding(2, "COLOR_YUV2BGR_UYVY"),
    "yuv422_yuy2": _Encoding(2, "COLOR_YUV2BGR_YUYV"), "yuyv": _Encoding(2, "COLOR_YUV2BGR_YUYV"),
}  # fmt: skip


def check_size(width: int, height: int) -> None:
    """Refuse implausible image sizes.

    Raises:
        MessageError: no pixels, or too many.
    """
    if not (width > 0 and height > 0 and width * height <= _MAX_PIXELS):
        raise MessageError(
            f"an image of {width} x {height} pixels is refused; 1 to {_MAX_PIXELS // 10**6} million are supported"
        )


def raw_pixels(message: Message) -> np.ndarray:
    """View raw pixels as (h, w, channels), uint8 or uint16, without row padding.

    Raises:
        MessageError: the encoding is not supported, or the sizes contradict each other.
    """
    name = message.text("encoding")
    if name not in _ENCODINGS:
        hint = "a depth image has no defined brightness scale, convert it to mono8; " if name in _DEPTH else ""
        raise MessageError(f"the encoding '{name}' is not supported; {hint}{READABLE}")
    encoding = _ENCODINGS[name]
    height, width, step = message.whole("height"), message.whole("width"), message.whole("step")
    check_size(width, height)
    row = width * encoding.channels * encoding.channel_bytes
    step = step or row
    data = message.octets("data")
    if step < row or len(data) < step * (height - 1) + row:
        raise MessageError(
            f"an image of {width} x {height} {name} pixels with rows of {step} bytes has {len(data)} bytes of data, but "
            f"{step * (height - 1) + row} are required, with rows of at least {row}: the message is damaged"
        )
    rows = np.ndarray((height, row), np.uint8, np.ascontiguousarray(data), 0, (step, 1))
    if encoding.channel_bytes == 2:
        order = ">u2" if message.whole("is_bigendian") else "<u2"
        rows = np.ascontiguousarray(rows).view(order).astype(np.uint16)
    return rows.reshape(height, width, -1)


def converted_pixels(message: Message) -> np.ndarray:
    """Return raw pixels as uint8 (h, w, 3), blue first; 16-bit pixels are stretched to 8.

    Raises:
        MessageError: as raw_pixels, or a width that the encoding does not allow.
    """
    import cv2

    pixels = raw_pixels(message)
    conversion = _ENCODINGS[message.text("encoding")].conversion
    if pixels.dtype == np.uint16:
        pixels = stretched(pixels)
    if not conversion:
        return np.ascontiguousarray(pixels)
    if conversion.startswith("COLOR_YUV") and pixels.shape[1] % 2:
        raise MessageError(f"a 4:2:2 image must have an even width, not {pixels.shape[1]}")
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), getattr(cv2, conversion)))


def stretched(pixels: np.ndarray) -> np.ndarray:
    """Reduce 16-bit pixels to 8: cameras fill 10, 12 or 16 bits, so the darkest and brightest 0.1 % become 0 and 255."""
    low, high = np.percentile(pixels, (0.1, 99.9))
    scale = 255.0 / max(float(high - low), 1.0)
    return np.clip((pixels.astype(np.float32) - np.float32(low)) * np.float32(scale) + 0.5, 0, 255).astype(np.uint8)
