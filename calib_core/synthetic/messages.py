"""Simulated measurements as the messages that real drivers send."""

import heapq
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from calib_core.measurements import RadarScan, RadarScans, TimeNs
from calib_core.radar import polar_from_cartesian
from calib_core.recordings.containers.writing import (
    CameraInfoMessage,
    CloudMessage,
    CompressedImageMessage,
    ImageMessage,
    RadarReturnMessage,
    RecordedMessage,
    VendorScanMessage,
)
from calib_core.recordings.radar.merging import Spread, aligned, merged, moments_of
from calib_core.synthetic.options import RadarDefects
from calib_core.synthetic.radar_profiles import Antenna
from calib_core.synthetic.radar_returns import second_azimuths
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording
from calib_core.synthetic.scans import side_scans

RADAR_SCAN_TOPIC = "/ti_mmwave/radar_scan"
CLOUD_TOPIC = RadarDefects().cloud_topic
VENDOR_TOPIC = "/acme/packets"
RAW_IMAGE_TOPIC = "/camera/image_raw"
IMAGE_TOPIC = "/camera/image_raw/compressed"
CAMERA_INFO_TOPIC = "/camera/camera_info"
SECOND_SUFFIX = "_second_azimuth"
"""Of the topic with the same returns at their second azimuths."""
SECOND_COLUMN = "azimuth_2"
"""Or of the column with the second azimuth [rad]."""
RADAR_FRAME = "ti_mmwave_0"
SIDE_TOPIC, SIDE_FRAME = "/radar_left/points", "radar_left"
CAMERA_FRAME = "camera_optical_frame"

_TRANSFER_NS = 3_000_000
_PARSE_NS = 6_000
"""The driver stamps each return as it parses it; parsing one takes about this long."""


def camera_messages(
    recording: SimulatedRecording, frames: Iterable[SimulatedFrame] | None = None
) -> Iterator[RecordedMessage]:
    """Convert frames to image and camera-info messages, in order of arrival.

    Args:
        recording: the recording.
        frames: to use instead of all frames of the recording.
    """
    options = recording.options
    for frame in recording.frames() if frames is None else frames:
        if options.intrinsics.published:
            info = CameraInfoMessage(frame.time, CAMERA_FRAME, recording.stage.published_camera)
            yield RecordedMessage(CAMERA_INFO_TOPIC, frame.receive_time, info)
        if options.raw_images:
            raw = ImageMessage(frame.time, CAMERA_FRAME, frame.pixels)
            yield RecordedMessage(RAW_IMAGE_TOPIC, frame.receive_time, raw)
        else:
            jpeg = CompressedImageMessage(
                frame.time, CAMERA_FRAME, frame.jpeg(options.jpeg_quality), "bgr8; jpeg compressed bgr8"
            )
            yield RecordedMessage(IMAGE_TOPIC, frame.receive_time, jpeg)


def radar_messages(recording: SimulatedRecording, generation: Literal[1, 2]) -> Iterator[RecordedMessage]:
    """Convert scans to messages, in order of arrival.

    Args:
        recording: the recording.
        generation: of ROS; 1 writes the messages of options.radar_message, 2 writes clouds or a vendor's scans.
    """
    if recording.options.defects.ideal_topic:
        return _ideal_messages(recording)
    streams = [_antenna_messages(recording, antenna, generation) for antenna in recording.stage.antennas]
    if recording.options.defects.side_radar:
        streams.append(_side_messages(recording))
    return heapq.merge(*streams, key=lambda message: message.receive_time)


def _antenna_messages(
    recording: SimulatedRecording, antenna: Antenna, generation: Literal[1, 2]
) -> Iterator[RecordedMessage]:
    options, second = recording.options, recording.options.defects.second_azimuth
    vendor = options.radar_message == "vendor"
    cloud = generation == 2 or options.radar_message == "cloud" or options.radar == "imaging"
    cloud = cloud or second != "none" or bool(antenna.name)
    base = VENDOR_TOPIC if vendor else options.defects.cloud_topic
    topic = f"{base}_{antenna.name}" if antenna.name else base
    for scan, receive in zip(recording.scans_of(antenna), antenna.times.receive_ns, strict=True):
        if vendor:
            yield _vendor_scan(topic, scan, TimeNs(int(receive)))
            continue
        if not cloud:
            yield from _returns(recording, scan, int(receive))
            continue
        yield _cloud(topic, scan, TimeNs(int(receive)), second_column=second == "column")
        if second == "topic":
            other = replace(scan, points_radar_m=second_azimuths(scan.points_radar_m))
            yield _cloud(f"{topic}{SECOND_SUFFIX}", other, TimeNs(int(receive)))


def _ideal_messages(recording: SimulatedRecording) -> Iterator[RecordedMessage]:
    """Put the returns that all antennas report in one moment into one cloud; none is left out."""
    parts = [RadarScans.from_scans(list(recording.scans_of(antenna))) for antenna in recording.stage.antennas]
    moments = moments_of([part.times_ns for part in parts])
    together = [aligned(part, own, moments.times_ns) for part, own in zip(parts, moments.scan_of, strict=True)]
    scans = merged(together, [Spread(np.full(3, 1e-9), 1e-9)] * len(parts), list(range(len(parts))))
    for number in range(len(scans)):
        scan = scans.scan(number)
        yield _cloud(recording.options.defects.cloud_topic, scan, TimeNs(scan.time + _TRANSFER_NS))


def _side_messages(recording: SimulatedRecording) -> Iterator[RecordedMessage]:
    for scan in side_scans(recording.stage):
        yield _cloud(SIDE_TOPIC, scan, TimeNs(scan.time + _TRANSFER_NS), frame=SIDE_FRAME)


def all_messages(
    recording: SimulatedRecording, generation: Literal[1, 2], frames: Iterable[SimulatedFrame] | None = None
) -> Iterator[RecordedMessage]:
    """Merge both sensors' messages as one recorder would receive them.

    Args:
        recording: the recording.
        generation: of ROS.
        frames: to use instead of all frames of the recording.
    """
    return heapq.merge(
        camera_messages(recording, frames),
        radar_messages(recording, generation),
        key=lambda message: message.receive_time,
    )


def _cloud(
    topic: str, scan: RadarScan, receive: TimeNs, *, second_column: bool = False, frame: str = RADAR_FRAME
) -> RecordedMessage:
    names: tuple[str, ...] = ("x", "y", "z", "intensity", "velocity")
    columns = [scan.points_radar_m, scan.snr_db, scan.doppler_mps]
    if second_column:
        names = (*names, SECOND_COLUMN)
        columns.append(polar_from_cartesian(second_azimuths(scan.points_radar_m))[:, 1])
    return RecordedMessage(topic, receive, CloudMessage(scan.time, frame, names, np.column_stack(columns)))


def _vendor_scan(topic: str, scan: RadarScan, receive: TimeNs) -> RecordedMessage:
    polar = polar_from_cartesian(scan.points_radar_m)
    return RecordedMessage(
        topic, receive, VendorScanMessage(scan.time, RADAR_FRAME, polar, scan.doppler_mps, scan.snr_db)
    )


def _returns(recording: SimulatedRecording, scan: RadarScan, receive: int) -> Iterator[RecordedMessage]:
    """Yield one message per return, each stamped slightly later, as the TI driver does."""
    filled = recording.options.radar_message == "filled"
    profile = recording.stage.profile
    ranges = np.linalg.norm(scan.points_radar_m, axis=1)
    bearings = np.rad2deg(np.arctan2(scan.points_radar_m[:, 1], scan.points_radar_m[:, 0]))
    bins = np.round(scan.doppler_mps / profile.doppler_bin_mps).astype(int) + profile.doppler_bins // 2
    for i, point in enumerate(scan.points_radar_m.tolist()):
        body = RadarReturnMessage(
            TimeNs(scan.time + i * _PARSE_NS),
            RADAR_FRAME,
            i,
            point[0],
            point[1],
            point[2],
            range_m=float(ranges[i]) if filled else 0.0,
            velocity_mps=float(scan.doppler_mps[i]),
            doppler_bin=int(bins[i]) if filled else 0,
            bearing_deg=float(bearings[i]) if filled else 0.0,
            intensity_db=float(scan.snr_db[i]) if filled else 0.0,
        )
        yield RecordedMessage(RADAR_SCAN_TOPIC, TimeNs(receive + i * _PARSE_NS), body)
