"""Read camera images: JPEG and PNG are passed through, raw pixels are viewed without copying, converted and encoded once."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Literal

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.camera.jpeg import JPEG_MAGIC, PNG_MAGIC, png_size, repaired_jpeg
from calib_core.recordings.camera.video_packets import Packet, packet_of, require_codec
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import Definition

_RAW_NAMES = frozenset({"height", "width", "encoding", "step", "data"})
_COMPRESSED_NAMES = frozenset({"format", "data"})
_PACKET_NAMES = frozenset({"encoding", "pts", "flags", "data"})
_JPEG_QUALITY = 95
_MAX_PIXELS = 200_000_000
_DEPTH = ("16UC1", "32FC1", "16SC1")


@dataclass(frozen=True, slots=True)
class EncodedImage:
    """A frame as an image file.

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
    """Return whether a message is laid out as sensor_msgs/Image."""
    return definition.names >= _RAW_NAMES


def is_compressed_image(definition: Definition) -> bool:
    """Return whether a message is laid out as sensor_msgs/CompressedImage."""
    return definition.names >= _COMPRESSED_NAMES and not is_raw_image(definition)


def is_packet(definition: Definition) -> bool:
    """Return whether a message is laid out as the packets of ffmpeg_image_transport: one frame of a video."""
    return definition.names >= _PACKET_NAMES and not is_raw_image(definition)


def is_image(definition: Definition) -> bool:
    """Return whether a message is laid out as any of them."""
    return is_raw_image(definition) or is_compressed_image(definition) or is_packet(definition)


@dataclass(frozen=True, slots=True, eq=False)
class ImageLayout:
    """Reads the images of one topic; error messages begin with the topic's name."""

    definition: Definition
    topic: str

    @property
    def compressed(self) -> bool:
        """Return whether messages contain image files rather than pixels."""
        return not is_raw_image(self.definition)

    def check(self, payload: bytes) -> None:
        """Check a topic's first message without decoding the image.

        Raises:
            MessageError: the encoding is not supported; the text lists those that are.
        """
        packet = self.packet(payload)
        if packet is None:
            self.size_px(payload)
            return
        try:
            require_codec(packet)
        except MessageError as error:
            raise self._refused(str(error)) from error

    def packet(self, payload: bytes) -> Packet | None:
        """Return the video packet in a message; None if the message contains a complete image.

        Raises:
            MessageError: the message cannot be read.
        """
        if is_raw_image(self.definition):
            return None
        return packet_of(self._message(payload))

    def recorded_as(self, payload: bytes) -> str:
        """Return the format of a message's image: "jpeg", "png", "raw bgr8" or "h264 video".

        Raises:
            MessageError: the message cannot be read.
        """
        message = self._message(payload)
        if not self.compressed:
            return f"raw {message.text('encoding')}"
        packet = packet_of(message)
        return f"{packet.codec} video" if packet else self._file(message).format

    def size_px(self, payload: bytes) -> tuple[int, int]:
        """Return width and height without decoding the image.

        Raises:
            MessageError: the message cannot be read.
        """
        message = self._message(payload)
        if self.compressed:
            file = self._file(message)
            return file.width_px, file.height_px
        try:
            raw_pixels(message)
        except MessageError as error:
            raise self._refused(str(error)) from error
        return message.whole("width"), message.whole("height")

    def size_in_head(self, head: bytes) -> tuple[int, int] | None:
        """Return width and height from the first bytes of a message; None if they are further on or cannot be read."""
        try:
            if not self.compressed:
                message = decode(self._fields_before("encoding"), head)
                return message.whole("width"), message.whole("height")
            start = min((place for magic in (JPEG_MAGIC, PNG_MAGIC) if (place := head.find(magic)) >= 0), default=-1)
            data = head[start:] if start >= 0 else b""
            return png_size(data)[:2] if data.startswith(PNG_MAGIC) else repaired_jpeg(data)[1:]
        except MessageError:
            return None

    def _fields_before(self, name: str) -> Definition:
        """Return a definition of the fields before one of them."""
        definition = self.definition
        fields = tuple(takewhile(lambda field: field.name != name, definition.fields))
        return replace(definition, types={**definition.types, definition.type: fields})

    def encoded(self, payload: bytes) -> EncodedImage:
        """Return the frame as an image file: the recorded one, or raw pixels encoded as JPEG.

        Raises:
            MessageError: the message cannot be read.
        """
        message = self._message(payload)
        if self.compressed:
            return self._file(message)
        return encoded_pixels(self._converted(message))

    def image(self, payload: bytes) -> np.ndarray:
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
        image = cv2.imdecode(np.frombuffer(file.data, dtype=np.uint8), flags)
        if image is None:
            raise self._refused(f"a {file.format} image of {len(file.data)} bytes is damaged; choose another frame")
        return np.asarray(image)

    def _converted(self, message: Message) -> np.ndarray:
        try:
            return converted_pixels(message)
        except MessageError as error:
            raise self._refused(str(error)) from error

    def _refused(self, why: str) -> MessageError:
        return MessageError(f"topic {self.topic}: {why}")

    def _message(self, payload: bytes) -> Message:
        try:
            return decode(self.definition, payload)
        except MessageError as error:
            raise self._refused(str(error)) from error

    def _file(self, message: Message) -> EncodedImage:
        """Extract the recorded file; its type is recognized by its first bytes, not by the field 'format'."""
        data = message.octets("data").tobytes()
        said = message.text("format")
        if "compressedDepth" in said:
            raise self._refused(
                f"'{said}' is a depth image, not an image; choose a color or grey image topic; {READABLE}"
            )
        try:
            if data.startswith(JPEG_MAGIC):
                data, width, height = repaired_jpeg(data)
                check_size(width, height)
                return EncodedImage(data, "jpeg", width, height)
            if data.startswith(PNG_MAGIC):
                return self._png(data, said)
        except MessageError as error:
            raise self._refused(str(error)) from error
        if said.lower() in ("jpeg", "jpg", "png") and not data.startswith(b"qoif"):
            raise self._refused(f"declared as '{said}', but the data is neither JPEG nor PNG; {READABLE}")
        kind = "qoi" if data.startswith(b"qoif") else said or data[:4].hex() or "nothing"
        raise self._refused(
            f"the encoding '{kind}' is not supported; record in jpeg or png, or convert to them; {READABLE}"
        )

    def _png(self, data: bytes, said: str) -> EncodedImage:
        width, height, bits, colour = png_size(data)
        check_size(width, height)
        if bits != 16 or colour != 0:
            return EncodedImage(data, "png", width, height)
        if "16UC1" in said or "mono16" not in said:
            raise MessageError(
                f"'{said}' is a 16-bit grey PNG, a depth or raw image without a defined brightness scale; "
                f"convert it to mono8; {READABLE}"
            )
        import cv2

        pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
        if pixels is None:
            raise MessageError(f"a png image of {len(data)} bytes is damaged; choose another frame")
        eight = cv2.imencode(".png", stretched(np.asarray(pixels)))[1].tobytes()
        return EncodedImage(eight, "png", width, height)


def encoded_pixels(image: np.ndarray) -> EncodedImage:
    """Encode pixels as JPEG at a quality sufficient for clicking."""
    import cv2

    settings = [
        cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
    ]  # fmt: skip
    _, data = cv2.imencode(".jpg", image, settings)
    return EncodedImage(data.tobytes(), "jpeg", image.shape[1], image.shape[0])


@dataclass(frozen=True, slots=True)
class _Encoding:
    """How pixels are stored.

    Attributes:
        channels: of a pixel.
        conversion: the name of OpenCV's conversion to blue, green, red; "" for none.
        channel_bytes: of each channel.
        planes: rows that are stored for each row of the image.
    """

    channels: int
    conversion: str
    channel_bytes: int = 1
    planes: float = 1.0


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
    "nv12": _Encoding(1, "COLOR_YUV2BGR_NV12", planes=1.5), "nv21": _Encoding(1, "COLOR_YUV2BGR_NV21", planes=1.5),
}  # fmt: skip
_PLAIN = (name for name in _ENCODINGS if not name.startswith("bayer"))
READABLE = f"jpeg, png, {', '.join(_PLAIN)}, bayer_*8, bayer_*16, H.264 and H.265 are supported"


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
    """View raw pixels as (h, w, channels), uint8 or uint16, without row padding; h counts rows of all planes.

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
    if encoding.planes > 1.0 and (width % 2 or height % 2):
        raise MessageError(f"an image of {width} x {height} {name} pixels must have an even width and height")
    height = round(height * encoding.planes)
    row = width * encoding.channels * encoding.channel_bytes
    step = step or row
    data = message.octets("data")
    if step < row or len(data) < step * (height - 1) + row:
        raise MessageError(
            f"an image of {width} x {message.whole('height')} {name} pixels with rows of {step} bytes has {len(data)} bytes of "
            "data, but "
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
