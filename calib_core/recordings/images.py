"""Camera images: recorded JPEG and PNG passed through, raw pixels converted and encoded once."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.decoding import Message, decode
from calib_core.recordings.definitions import Definition
from calib_core.recordings.jpeg import JPEG_MAGIC, PNG_MAGIC, mended_jpeg, png_size

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["EncodedImage", "ImageLayout", "is_compressed_image", "is_raw_image"]

_RAW_NAMES = frozenset({"height", "width", "encoding", "step", "data"})
_COMPRESSED_NAMES = frozenset({"format", "data"})
_MAX_PIXELS = 200_000_000
_JPEG_QUALITY = 95

# encoding: bytes per pixel, name of OpenCV's conversion to BGR ("" for none)
_ENCODINGS: "Mapping[str, tuple[int, str]]" = {
    "bgr8": (3, ""), "8UC3": (3, ""), "rgb8": (3, "COLOR_RGB2BGR"),
    "bgra8": (4, "COLOR_BGRA2BGR"), "8UC4": (4, "COLOR_BGRA2BGR"), "rgba8": (4, "COLOR_RGBA2BGR"),
    "mono8": (1, "COLOR_GRAY2BGR"), "8UC1": (1, "COLOR_GRAY2BGR"),
    "bayer_rggb8": (1, "COLOR_BayerRGGB2BGR"), "bayer_bggr8": (1, "COLOR_BayerBGGR2BGR"),
    "bayer_gbrg8": (1, "COLOR_BayerGBRG2BGR"), "bayer_grbg8": (1, "COLOR_BayerGRBG2BGR"),
    "yuv422": (2, "COLOR_YUV2BGR_UYVY"), "uyvy": (2, "COLOR_YUV2BGR_UYVY"),
    "yuv422_yuy2": (2, "COLOR_YUV2BGR_YUYV"), "yuyv": (2, "COLOR_YUV2BGR_YUYV"),
}  # fmt: skip
_WORKS = "jpeg, png, mono8, rgb8, bgr8, rgba8, bgra8, bayer_*8, yuv422 and yuv422_yuy2 can be read"
_DEPTH = ("16UC1", "32FC1", "mono16", "16SC1")


@dataclass(frozen=True, slots=True)
class EncodedImage:
    """A frame as a file.

    Attributes:
        data: the bytes of the file.
        format: "jpeg" or "png".
        width_px: columns.
        height_px: rows.
    """

    data: bytes
    format: Literal["jpeg", "png"]
    width_px: int
    height_px: int


def is_raw_image(definition: Definition) -> bool:
    """Tell whether a message is laid out as sensor_msgs/Image."""
    return definition.names >= _RAW_NAMES


def is_compressed_image(definition: Definition) -> bool:
    """Tell whether a message is laid out as sensor_msgs/CompressedImage."""
    return definition.names >= _COMPRESSED_NAMES and not is_raw_image(definition)


@dataclass(frozen=True, slots=True, eq=False)
class ImageLayout:
    """Reads the images of one topic; errors begin with the topic's name."""

    definition: Definition
    topic: str

    @property
    def compressed(self) -> bool:
        """Tell whether messages hold files rather than pixels."""
        return is_compressed_image(self.definition)

    def check(self, payload: bytes) -> None:
        """Refuse a topic by its first message, without decoding the picture.

        Raises:
            MessageError: the encoding cannot be read; the text says which would.
        """
        self.size_px(payload)

    def size_px(self, payload: bytes) -> tuple[int, int]:
        """Return width and height without decoding the picture.

        Raises:
            MessageError: the message cannot be read.
        """
        message = self._message(payload)
        if self.compressed:
            file = self._file(message)
            return file.width_px, file.height_px
        pixels = self._pixels(message)
        return pixels.shape[1], pixels.shape[0]

    def encoded(self, payload: bytes) -> EncodedImage:
        """Return the frame as a file: the recorded one, or raw pixels encoded as JPEG.

        Raises:
            MessageError: the message cannot be read.
        """
        message = self._message(payload)
        if self.compressed:
            return self._file(message)
        import cv2

        picture = self._converted(message)
        settings = [
            cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY,
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
        ]  # fmt: skip
        _, data = cv2.imencode(".jpg", picture, settings)
        return EncodedImage(data.tobytes(), "jpeg", picture.shape[1], picture.shape[0])

    def picture(self, payload: bytes) -> np.ndarray:
        """Return the frame's pixels: uint8 (h, w, 3), blue first.

        Raises:
            MessageError: the message cannot be read.
        """
        message = self._message(payload)
        if not self.compressed:
            return self._converted(message)
        import cv2

        file = self._file(message)
        flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        picture = cv2.imdecode(np.frombuffer(file.data, dtype=np.uint8), flags)
        if picture is None:
            raise self._refused(f"a {file.format} picture of {len(file.data)} bytes is damaged; choose another frame")
        return np.asarray(picture)

    def _refused(self, why: str) -> MessageError:
        return MessageError(f"topic {self.topic}: {why}")

    def _message(self, payload: bytes) -> Message:
        try:
            return decode(self.definition, payload)
        except MessageError as error:
            raise self._refused(str(error)) from error

    def _file(self, message: Message) -> EncodedImage:
        """Take out the recorded file; what it is, its first bytes say and not the field 'format'."""
        data = message.octets("data").tobytes()
        said = message.text("format")
        if "compressedDepth" in said:
            raise self._refused(
                f"'{said}' is a depth image, not a picture; choose a colour or grey image topic: {_WORKS}"
            )
        try:
            if data.startswith(JPEG_MAGIC):
                data, width, height = mended_jpeg(data)
                self._limit(width, height)
                return EncodedImage(data, "jpeg", width, height)
            if data.startswith(PNG_MAGIC):
                return self._png(data, said)
        except MessageError as error:
            raise self._refused(str(error)) from error
        kind = "qoi" if data.startswith(b"qoif") else said or data[:4].hex() or "nothing"
        raise self._refused(f"the encoding '{kind}' cannot be read; record or convert it to jpeg or png: {_WORKS}")

    def _png(self, data: bytes, said: str) -> EncodedImage:
        width, height, bits, colour = png_size(data)
        self._limit(width, height)
        if bits == 16 and colour == 0:
            raise MessageError(
                f"'{said}' is a PNG of 16-bit grey, a depth or raw image without an agreed brightness; "
                f"convert it to mono8: {_WORKS}"
            )
        return EncodedImage(data, "png", width, height)

    def _limit(self, width: int, height: int) -> None:
        if not 0 < width * height <= _MAX_PIXELS:
            raise MessageError(
                f"an image of {width} x {height} pixels is refused; 1 to {_MAX_PIXELS // 10**6} million can be read"
            )

    def _pixels(self, message: Message) -> np.ndarray:
        """View raw pixels as (h, w, bytes per pixel), padding of rows left out."""
        encoding = message.text("encoding")
        if encoding not in _ENCODINGS:
            hint = (
                "a depth or 16-bit image has no agreed brightness; convert it to mono8: " if encoding in _DEPTH else ""
            )
            raise self._refused(f"the encoding '{encoding}' cannot be read; {hint}{_WORKS}")
        height, width, step = message.whole("height"), message.whole("width"), message.whole("step")
        try:
            self._limit(width, height)
        except MessageError as error:
            raise self._refused(str(error)) from error
        row = width * _ENCODINGS[encoding][0]
        step = step or row
        data = message.octets("data")
        if step < row or len(data) < step * (height - 1) + row:
            raise self._refused(
                f"an image of {width} x {height} {encoding} pixels with rows of {step} bytes has {len(data)} bytes of data; "
                f"{step * (height - 1) + row} are needed with rows of at least {row}: the message is damaged"
            )
        rows = np.ndarray((height, row), np.uint8, np.ascontiguousarray(data), 0, (step, 1))
        return rows.reshape(height, width, -1)

    def _converted(self, message: Message) -> np.ndarray:
        import cv2

        pixels = self._pixels(message)
        conversion = _ENCODINGS[message.text("encoding")][1]
        if not conversion:
            return np.ascontiguousarray(pixels)
        if conversion.startswith("COLOR_YUV") and pixels.shape[1] % 2:
            raise self._refused(f"a 4:2:2 image must have an even width, not {pixels.shape[1]}")
        return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels), getattr(cv2, conversion)))
