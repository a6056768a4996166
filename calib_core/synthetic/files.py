"""Write a simulated recording to a folder: in common containers or as plain files, with clicks and the truth.

The measurements become the messages that real drivers send.
"""

import heapq
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from calib_core.boxes import boxes_text, labels_text
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange import camera_info_text, write_clicks
from calib_core.lens_models.registry import written_lens
from calib_core.measurements import RadarScan, RadarScans, TimeNs, time_parts
from calib_core.radar import polar_from_cartesian
from calib_core.recordings.containers.writing import (
    CameraInfoMessage,
    CloudMessage,
    CompressedImageMessage,
    ImageMessage,
    RadarReturnMessage,
    RecordedMessage,
    VendorScanMessage,
    write_ros1_bag,
    write_ros2,
)
from calib_core.recordings.radar.merging import Spread, aligned, merged, moments_of
from calib_core.synthetic.annotations import is_annotated, true_boxes, true_labels
from calib_core.synthetic.options import Clicking, Container, RadarDefects
from calib_core.synthetic.radar_returns import Antenna, second_azimuths
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording
from calib_core.synthetic.scans import side_scans

Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number done and the total."""


def write_recording(
    recording: SimulatedRecording,
    folder: Path,
    containers: Sequence[Container] = ("ros1",),
    *,
    progress: Progress = lambda done, total: None,
) -> tuple[Path, ...]:
    """Write recording, truth.json and clicks.json, and return the data files; of a second camera truth_2.json and so on.

    If people, robots or cars move that are worth judging, boxes.json and labels.json are written too.

    Args:
        recording: what to write.
        folder: created if it does not exist; existing files are not overwritten.
        containers: "ros1" writes radar.bag and camera.bag; "mcap" and "db3" write a ROS 2 bag each: a folder with
            metadata.yaml, whose data file can also be opened alone. "csv" and "jsonl" write a folder without ROS: pictures
            named by date, the radar as a table or as one JSON object per scan, and camera.yaml.
        progress: called after each frame with the number written and the total over all containers.

    Raises:
        RecordingError: a file already exists.
        InputError: ROS has no name for the camera's lens model, or a container has no room for a second camera.
    """
    camera, other = recording.camera, recording.other_camera
    if other is not None and not set(containers).isdisjoint({"csv", "jsonl"}):
        raise InputError("a folder of pictures holds one camera; write a recording of two cameras as ros1, mcap or db3")
    written_lens(camera.lens, camera.distortion, "camera_info")  # refused before anything is written
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    frame_count = len(recording.stage.frame_times.header_ns)
    for number, container in enumerate(containers):
        frames = _counted(recording, progress, before=number * frame_count, total=len(containers) * frame_count)
        if container in ("csv", "jsonl"):
            written.extend(write_plain_files(recording, folder / f"recording_{container}", container, frames))
        elif container == "ros1":
            written.append(write_ros1_bag(folder / "radar.bag", radar_messages(recording, 1)))
            written.append(write_ros1_bag(folder / "camera.bag", _pictures(recording, frames)))
        else:
            name = folder / f"recording_{container}"
            messages = all_messages(recording, 2, frames)
            written.append(write_ros2(name, messages, container="mcap" if container == "mcap" else "sqlite3"))
    _write_truth(recording, folder)
    if other is not None:
        _write_truth(other, folder, "_2")
    return tuple(written)


def _write_truth(recording: SimulatedRecording, folder: Path, suffix: str = "") -> None:
    (folder / f"truth{suffix}.json").write_text(truth_text(recording), encoding="utf-8")
    (folder / f"clicks{suffix}.json").write_text(clicks_text(recording), encoding="utf-8")
    if is_annotated(recording):
        (folder / f"boxes{suffix}.json").write_text(boxes_text(true_boxes(recording)), encoding="utf-8")
        if not suffix:
            (folder / "labels.json").write_text(labels_text(true_labels(recording)), encoding="utf-8")


def _counted(recording: SimulatedRecording, progress: Progress, *, before: int, total: int) -> Iterator[SimulatedFrame]:
    for done, frame in enumerate(recording.frames(), start=before + 1):
        yield frame
        progress(done, total)


_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_HEADER = (
    "Timestamp",
    "Track",
    "Range [m]",
    "Azimuth (deg)",
    "Elevation (deg)",
    "Doppler [m/s]",
    "RCS (dBsm)",
    "Quality",
)


def write_plain_files(
    recording: SimulatedRecording, folder: Path, radar: Literal["csv", "jsonl"], frames: Iterable[SimulatedFrame]
) -> tuple[Path, ...]:
    """Write a folder of pictures, the radar's returns and the intrinsics; return their paths.

    Args:
        recording: what to write.
        folder: created.
        radar: "csv" writes a table with a row per return, in degrees, with columns that nobody needs; "jsonl" an object per
            scan, with a list of returns in Cartesian positions.
        frames: of the recording.
    """
    pictures = folder / "camera"
    pictures.mkdir(parents=True)
    for frame in frames:
        name = f"img_{_date(frame.time):%Y-%m-%d_%H-%M-%S-%f}.jpg"
        (pictures / name).write_bytes(frame.jpeg(recording.options.jpeg_quality))
    written = [pictures]
    if recording.options.intrinsics.published:
        written.append(folder / "camera.yaml")
        written[1].write_text(camera_info_text(recording.stage.published_camera, "camera"), encoding="utf-8")
    for antenna in recording.stage.antennas:
        path = folder / f"radar{'_' if antenna.name else ''}{antenna.name}.{radar}"
        lines = _table(recording, antenna) if radar == "csv" else _objects(recording, antenna)
        with path.open("w", encoding="utf-8", newline="") as file:
            file.writelines(lines)
        written.append(path)
    return tuple(written)


def _date(time: TimeNs) -> datetime:
    return _EPOCH + timedelta(microseconds=int(time) // 1000)


def _table(recording: SimulatedRecording, antenna: Antenna) -> Iterator[str]:
    """Yield the lines of a table whose times are dates, in the manner of logging software."""
    yield _line(_HEADER)
    for scan in recording.scans_of(antenna):
        when = f"{_date(scan.time):%Y/%m/%d %H:%M:%S.%f}"
        polar = polar_from_cartesian(scan.points_radar_m)
        columns = (polar[:, 0], *np.rad2deg(polar[:, 1:]).T, scan.doppler_mps, scan.snr_db)
        for number, row in enumerate(np.column_stack(columns).tolist()):
            yield _line((when, str(number), *(f"{value:.6f}" for value in row), "1"))


def _line(cells: Iterable[str]) -> str:
    return ";".join(cells) + "\n"


def _objects(recording: SimulatedRecording, antenna: Antenna) -> Iterator[str]:
    for scan in recording.scans_of(antenna):
        yield json.dumps(_object(scan)) + "\n"


def _object(scan: RadarScan) -> dict[str, object]:
    names = ("x_m", "y_m", "z_m", "doppler_mps", "snr_db")
    rows = np.column_stack([scan.points_radar_m, scan.doppler_mps, scan.snr_db]).round(6).tolist()
    return {"time_ns": int(scan.time), "targets": [dict(zip(names, row, strict=True)) for row in rows]}


_PIXEL_DECIMALS = 6
"""The last bits of a projection depend on the order of its sums; the file must not."""


def truth_text(recording: SimulatedRecording) -> str:
    """Return the truth about a recording (schema cocalib/truth-1). No estimator may read it."""
    pose = recording.camera_from_radar
    document: dict[str, Any] = {
        "schema": "cocalib/truth-1",
        "camera_from_radar": _transform(pose),
        "camera": _camera(recording.camera),
        "radar_stamps_ahead_s": recording.stage.profile.latency_s + recording.options.clock_offset_s,
        "seed": recording.options.seed,
        "placements": [
            {
                "id": placement.id,
                "start": _time(placement.start),
                "end": _time(placement.end),
                "position_radar_m": placement.position_radar_m.tolist(),
                "pixel_px": placement.pixel_px.round(_PIXEL_DECIMALS).tolist(),
                "best_image_time": _time(placement.best_image_time),
            }
            for placement in recording.placements
        ],
    }
    defects = recording.options.defects
    if defects.azimuth_bias_deg or defects.elevation_bias_deg or defects.z_offset_m:
        document["camera_from_reported"] = _transform(recording.stage.camera_from_reported)
    if recording.stage.waving is not None:
        document["board"] = _board(recording)
    if recording.options.clicking != Clicking():
        document["clicks"] = [
            {"id": one.click.id, "placement": one.placement_id, "faults": list(one.faults)} for one in recording.clicked
        ]
    return _text(document)


def clicks_text(recording: SimulatedRecording) -> str:
    """Return the example clicks (schema cocalib/clicks-1)."""
    return write_clicks(recording.clicks)


def _transform(pose: RigidTransform) -> dict[str, Any]:
    return {"rotation": pose.rotation.tolist(), "translation_m": pose.translation_m.tolist()}


def _time(time: TimeNs) -> dict[str, int]:
    sec, nanosec = time_parts(time)
    return {"sec": sec, "nanosec": nanosec}


def _camera(camera: Camera) -> dict[str, Any]:
    return {
        "model": camera.model,
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        "matrix_px": camera.matrix_px.tolist(),
        "distortion": camera.distortion.tolist(),
    }


def _board(recording: SimulatedRecording) -> dict[str, Any]:
    """Return the board that is waved at the start, and when."""
    board = recording.options.waved_board
    start, end = recording.stage.recorded_span(0.0, board.duration_s)
    size = {"columns": board.columns, "rows": board.rows, "square_m": board.square_mm / 1e3}
    return {"kind": "checkerboard", **size, "start": _time(start), "end": _time(end)}


def _text(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


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
    recording: SimulatedRecording, frames: Iterable[SimulatedFrame] | None = None, *, name: str = "camera"
) -> Iterator[RecordedMessage]:
    """Convert frames to image and camera-info messages, in order of arrival.

    Args:
        recording: the recording.
        frames: to use instead of all frames of the recording.
        name: of the camera, in topics and frame.
    """
    options, frame_id = recording.options, CAMERA_FRAME.replace("camera", name)
    image, raw_image, camera_info = (
        topic.replace("/camera/", f"/{name}/") for topic in (IMAGE_TOPIC, RAW_IMAGE_TOPIC, CAMERA_INFO_TOPIC)
    )
    for frame in recording.frames() if frames is None else frames:
        if options.intrinsics.published:
            info = CameraInfoMessage(frame.time, frame_id, recording.stage.published_camera)
            yield RecordedMessage(camera_info, frame.receive_time, info)
        if options.raw_images:
            raw = ImageMessage(frame.time, frame_id, frame.pixels)
            yield RecordedMessage(raw_image, frame.receive_time, raw)
        else:
            jpeg = CompressedImageMessage(
                frame.time, frame_id, frame.jpeg(options.jpeg_quality), "bgr8; jpeg compressed bgr8"
            )
            yield RecordedMessage(image, frame.receive_time, jpeg)


def _pictures(recording: SimulatedRecording, frames: Iterable[SimulatedFrame] | None) -> Iterator[RecordedMessage]:
    streams = [camera_messages(recording, frames)]
    if recording.other_camera is not None:
        streams.append(camera_messages(recording.other_camera, name="camera_2"))
    return heapq.merge(*streams, key=lambda message: message.receive_time)


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
        _pictures(recording, frames),
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
