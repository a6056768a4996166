"""Read camera images: JPEG and PNG are passed through, raw pixels are converted and encoded once."""

from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Literal

import numpy as np

from calib_core.errors import MessageError
from calib_core.recordings.camera.jpeg import JPEG_MAGIC, PNG_MAGIC, png_size, repaired_jpeg
from calib_core.recordings.camera.raw_pixels import READABLE, check_size, converted_pixels, raw_pixels, stretched
from calib_core.recordings.camera.video_packets import Packet, packet_of, require_codec
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import Definition

_RAW_NAMES = frozenset({"height", "width", "encoding", "step", "data"})
_COMPRESSED_NAMES = frozenset({"format", "data"})
_PACKET_NAMES = frozenset({"encoding", "pts", "flags", "data"})
_JPEG_QUALITY = 95


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


def is_picture(definition: Definition) -> bool:
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
        """Check a topic's first message without decoding the picture.

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
        """Return the video packet in a message; None if the message contains a complete picture.

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
        """Return width and height without decoding the picture.

        Raises:
            MessageError: the message cannot be read.
        """
        message = self._message(payload)
        if self.compressed:
            file = self._file(message)
            return file.width_px, file.height_px
        try:
            pixels = raw_pixels(message)
        except MessageError as error:
            raise self._refused(str(error)) from error
        return pixels.shape[1], pixels.shape[0]

    def size_in_head(self, head: bytes) -> tuple[int, int] | None:
        """Return width and height from the first bytes of a message; None if they are further on or cannot be read."""
        try:
            if not self.compressed:
                message = decode(self._before("encoding"), head)
                return message.whole("width"), message.whole("height")
            start = min((place for magic in (JPEG_MAGIC, PNG_MAGIC) if (place := head.find(magic)) >= 0), default=-1)
            data = head[start:] if start >= 0 else b""
            return png_size(data)[:2] if data.startswith(PNG_MAGIC) else repaired_jpeg(data)[1:]
        except MessageError:
            return None

    def _before(self, name: str) -> Definition:
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
                f"'{said}' is a depth image, not a picture; choose a colour or grey image topic; {READABLE}"
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
            raise MessageError(f"a png picture of {len(data)} bytes is damaged; choose another frame")
        eight = cv2.imencode(".png", stretched(np.asarray(pixels)))[1].tobytes()
        return EncodedImage(eight, "png", width, height)


def encoded_pixels(picture: np.ndarray) -> EncodedImage:
    """Encode pixels as JPEG at a quality sufficient for clicking."""
    import cv2

    settings = [
        cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
    ]  # fmt: skip
    _, data = cv2.imencode(".jpg", picture, settings)
    return EncodedImage(data.tobytes(), "jpeg", picture.shape[1], picture.shape[0])
