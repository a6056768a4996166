"""Recordings with images and returns, a calibration of them, and readers that are not ours."""

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros1.decoder import DecoderFactory as Ros1Decoder
from mcap_ros2.decoder import DecoderFactory as Ros2Decoder

from calib_core.camera import Camera
from calib_core.deployment import RecordingWritten, write_into_recording
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, choose_check_point
from calib_core.measurements import NS_PER_S
from calib_core.options import CalibrationOptions
from calib_core.radar import RadarErrors
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.results import Calibration, Metrics
from tests.unit.recordings.conftest import Ros, jpeg, plain_rows, ros, write

_BORROWED = (jpeg, ros, write)
"""Fixtures of the recordings' tests."""

START_NS = 1_700_000_000 * NS_PER_S
CAMERA_FROM_RADAR = RigidTransform(
    rotation_exp(np.array([0.02, -0.03, 0.01])) @ np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]),
    np.array([0.1, -0.2, 0.05]),
)
RECORDED = Camera(
    "plumb_bob",
    64,
    48,
    np.array([[500.0, 0, 319.5], [0, 510, 239.5], [0, 0, 1]]),
    np.array([-0.1, 0.02, 0.001, -0.002, 0.003]),
)
"""The intrinsics of the camera-info messages."""
SEEING = Camera(
    "plumb_bob", 64, 48, np.array([[50.0, 0, 31.5], [0, 51, 23.5], [0, 0, 1]]), np.array([-0.1, 0.02, 0.001, -0.002])
)
"""Intrinsics with which the images show something."""


def calibration_file(
    camera: Camera = SEEING, radar_errors: RadarErrors | None = None, **frames: str
) -> CalibrationFile:
    nothing = float("nan")
    calibration = Calibration(
        camera_from_radar=CAMERA_FROM_RADAR,
        covariance=np.full((6, 6), nothing),
        camera=camera,
        metrics=Metrics(),
        pairs=(),
        unpaired=(),
        warnings=(),
        options=CalibrationOptions(),
        radar_errors=radar_errors or RadarErrors(),
    )
    names = FrameNames(frames.get("radar_frame", "radar"), frames.get("camera_frame", "camera"))
    return CalibrationFile(calibration, names, choose_check_point(calibration))


@dataclass(frozen=True)
class Message:
    """One message of a file, as mcap's own reader gives it."""

    topic: str
    type: str
    definition: bytes
    encoding: tuple[str, str]
    log_time: int
    publish_time: int
    sequence: int
    data: bytes
    decoded: Any


@dataclass(frozen=True)
class Written:
    """A new file, and what was said of it."""

    data: bytes
    said: RecordingWritten

    @property
    def messages(self) -> list[Message]:
        return read(self.data)

    def on(self, topic: str) -> list[Message]:
        return [message for message in self.messages if message.topic == topic]

    @property
    def notes(self) -> str:
        return "\n".join(self.said.notes)


def read(data: bytes) -> list[Message]:
    reader = make_reader(io.BytesIO(data), validate_crcs=True, decoder_factories=[Ros1Decoder(), Ros2Decoder()])
    return [
        Message(
            channel.topic,
            schema.name,
            schema.data,
            (channel.message_encoding, schema.encoding),
            message.log_time,
            message.publish_time,
            message.sequence,
            message.data,
            decoded,
        )
        for schema, channel, message, decoded in reader.iter_decoded_messages()
    ]


def exported(path: Path | Sequence[Path], file: CalibrationFile, options: RecordingOptions | None = None) -> Written:
    out = io.BytesIO()
    with open_recording(path, options, require=("image",)) as recording:
        said = write_into_recording(recording, file, out, version="0")
    return Written(out.getvalue(), said)


def without_info(rows: list[Any]) -> list[Any]:
    return [row for row in rows if row[0] != "/camera/camera_info"]


@pytest.fixture
def rows(jpeg: bytes) -> Callable[..., list[Any]]:
    """Return the function that builds an ordinary recording."""

    def build(ros: Ros, **changes: Any) -> list[Any]:
        return plain_rows(ros, jpeg, **changes)

    return build
