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

import msgspec
import numpy as np

from calib_core.boxes import boxes_text, labels_text
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.own.clicks_json import write_clicks
from calib_core.interchange.own.documents import camera_document
from calib_core.lens_models.registry import written_lens
from calib_core.measurements import RadarScan, TimeNs, time_parts
from calib_core.radar import polar_from_cartesian
from calib_core.recordings.containers.writing import (
    CameraInfoMessage,
    CloudMessage,
    CompressedImageMessage,
    RadarReturnMessage,
    RecordedMessage,
    Ros2Container,
    write_ros1_bag,
    write_ros2,
)
from calib_core.synthetic.annotations import is_annotated, true_boxes, true_labels
from calib_core.synthetic.options import Container, RadarDefects
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
            metadata.yaml, whose data file can also be opened alone. "csv" writes a folder without ROS: images named by date,
            the radar as a table, and camera.yaml.
        progress: called after each frame with the number written and the total over all containers.

    Raises:
        RecordingError: a file already exists.
        InputError: ROS has no name for the camera's lens model, or a container has no room for a second camera.
    """
    camera, other = recording.camera, recording.other_camera
    if other is not None and "csv" in containers:
        raise InputError("a folder of images holds one camera; write a recording of two cameras as ros1, mcap or db3")
    written_lens(camera.lens, camera.distortion, "camera_info")  # refused before anything is written
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    frame_count = len(recording.stage.frame_times.header_ns)
    for number, container in enumerate(containers):
        frames = _count_frames(recording, progress, before=number * frame_count, total=len(containers) * frame_count)
        if container == "csv":
            written.extend(write_plain_files(recording, folder / "recording_csv", frames))
        elif container == "ros1":
            written.append(write_ros1_bag(folder / "radar.bag", radar_messages(recording, 1)))
            written.append(write_ros1_bag(folder / "camera.bag", _images(recording, frames)))
        else:
            messages = _by_arrival(_images(recording, frames), radar_messages(recording, 2))
            storage: Ros2Container = "mcap" if container == "mcap" else "sqlite3"
            written.append(write_ros2(folder / f"recording_{container}", messages, container=storage))
    _write_truth(recording, folder)
    if other is not None:
        _write_truth(other, folder, "_2")
    return tuple(written)


def images_size_bytes(recording: SimulatedRecording) -> int:
    """Return about how large the images of one container will be on disk, by the first one."""
    first = next(recording.frames(1)).jpeg(recording.options.jpeg_quality)
    cameras = 1 if recording.other_camera is None else 2
    return len(first) * cameras * len(recording.stage.frame_times.header_ns)


def _write_truth(recording: SimulatedRecording, folder: Path, suffix: str = "") -> None:
    (folder / f"truth{suffix}.json").write_text(truth_text(recording), encoding="utf-8")
    (folder / f"clicks{suffix}.json").write_text(clicks_text(recording), encoding="utf-8")
    if is_annotated(recording):
        (folder / f"boxes{suffix}.json").write_text(boxes_text(true_boxes(recording)), encoding="utf-8")
        if not suffix:
            (folder / "labels.json").write_text(labels_text(true_labels(recording)), encoding="utf-8")


def _count_frames(
    recording: SimulatedRecording, progress: Progress, *, before: int, total: int
) -> Iterator[SimulatedFrame]:
    for done, frame in enumerate(recording.frames(), start=before + 1):
        yield frame
        progress(done, total)


_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_HEADER = "Timestamp;Track;Range [m];Azimuth (deg);Elevation (deg);Doppler [m/s];RCS (dBsm);Quality\n"


def write_plain_files(
    recording: SimulatedRecording, folder: Path, frames: Iterable[SimulatedFrame]
) -> tuple[Path, ...]:
    """Write a folder of images, the radar's returns and the intrinsics; return their paths.

    Args:
        recording: what to write.
        folder: created. Its table has a row per return, in degrees, with columns that nobody needs.
        frames: of the recording.
    """
    images = folder / "camera"
    images.mkdir(parents=True)
    for frame in frames:
        name = f"img_{_date(frame.time):%Y-%m-%d_%H-%M-%S-%f}.jpg"
        (images / name).write_bytes(frame.jpeg(recording.options.jpeg_quality))
    written = [images]
    if recording.options.intrinsics.published:
        written.append(folder / "camera.yaml")
        written[1].write_text(camera_info_text(recording.stage.published_camera, "camera"), encoding="utf-8")
    for antenna in recording.stage.antennas:
        path = folder / f"radar{'_' if antenna.name else ''}{antenna.name}.csv"
        with path.open("w", encoding="utf-8", newline="") as file:
            file.writelines(_table(recording, antenna))
        written.append(path)
    return tuple(written)


def _date(time: TimeNs) -> datetime:
    return _EPOCH + timedelta(microseconds=int(time) // 1000)


def _table(recording: SimulatedRecording, antenna: Antenna) -> Iterator[str]:
    """Yield the lines of a table whose times are dates, in the manner of logging software."""
    yield _HEADER
    for scan in recording.scans_of(antenna):
        when = f"{_date(scan.time):%Y/%m/%d %H:%M:%S.%f}"
        polar = polar_from_cartesian(scan.points_radar_m)
        columns = (polar[:, 0], *np.rad2deg(polar[:, 1:]).T, scan.doppler_mps, scan.snr_db)
        for number, row in enumerate(np.column_stack(columns).tolist()):
            yield ";".join((when, str(number), *(f"{value:.6f}" for value in row), "1")) + "\n"


_PIXEL_DECIMALS = 6
"""The last bits of a projection depend on the order of its sums; the file must not."""


def truth_text(recording: SimulatedRecording) -> str:
    """Return the truth about a recording (schema cocalib/truth-1). No estimator may read it."""
    stage, options = recording.stage, recording.options
    document: dict[str, Any] = {
        "schema": "cocalib/truth-1",
        "camera_from_radar": _transform(recording.camera_from_radar),
        "camera": msgspec.to_builtins(camera_document(recording.camera)),
        "radar_stamps_ahead_s": stage.profile.latency_s,
        "seed": options.seed,
        "placements": [
            {
                "id": placement.id,
                **_span(placement.start, placement.end),
                "position_radar_m": placement.position_radar_m.tolist(),
                "pixel_px": placement.pixel_px.round(_PIXEL_DECIMALS).tolist(),
                "best_image_time": _time(placement.best_image_time),
            }
            for placement in recording.placements
        ],
    }
    defects = options.defects
    if defects.azimuth_bias_deg or defects.elevation_bias_deg:
        document["camera_from_reported"] = _transform(stage.camera_from_reported)
    if stage.waving is not None:
        board, when = stage.waving.board, _span(*stage.recorded_span(0.0, options.waved_board_s))
        size = {"columns": board.columns, "rows": board.rows, "square_m": board.square_m}
        document["board"] = {"kind": board.kind, **size, **when}
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def clicks_text(recording: SimulatedRecording) -> str:
    """Return the example clicks (schema cocalib/clicks-1)."""
    return write_clicks(recording.clicks)


def _transform(pose: RigidTransform) -> dict[str, Any]:
    return {"rotation": pose.rotation.tolist(), "translation_m": pose.translation_m.tolist()}


def _time(time: TimeNs) -> dict[str, int]:
    sec, nanosec = time_parts(time)
    return {"sec": sec, "nanosec": nanosec}


def _span(start: TimeNs, end: TimeNs) -> dict[str, dict[str, int]]:
    return {"start": _time(start), "end": _time(end)}


CLOUD_TOPIC = RadarDefects().cloud_topic
SECOND_SUFFIX = "_second_azimuth"
"""Of the topic with the same returns at their second azimuths."""
SECOND_COLUMN = "azimuth_2"
"""Or of the column with the second azimuth [rad]."""
SIDE_TOPIC, SIDE_FRAME = "/radar_left/points", "radar_left"
TRANSFER_NS = 3_000_000
"""From a cloud's stamp to the recorder, where that is not drawn."""
_RADAR_FRAME = "ti_mmwave_0"
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
    options, frame_id = recording.options, f"{name}_optical_frame"
    for frame in recording.frames() if frames is None else frames:
        if options.intrinsics.published:
            info = CameraInfoMessage(frame.time, frame_id, recording.stage.published_camera)
            yield RecordedMessage(f"/{name}/camera_info", frame.receive_time, info)
        data = frame.jpeg(options.jpeg_quality)
        image = CompressedImageMessage(frame.time, frame_id, data, "bgr8; jpeg compressed bgr8")
        yield RecordedMessage(f"/{name}/image_raw/compressed", frame.receive_time, image)


def _images(recording: SimulatedRecording, frames: Iterable[SimulatedFrame]) -> Iterator[RecordedMessage]:
    other = recording.other_camera
    return _by_arrival(
        camera_messages(recording, frames), *([] if other is None else [camera_messages(other, name="camera_2")])
    )


def _by_arrival(*streams: Iterable[RecordedMessage]) -> Iterator[RecordedMessage]:
    """Merge messages as one recorder would receive them."""
    return heapq.merge(*streams, key=lambda message: message.receive_time)


def radar_messages(recording: SimulatedRecording, generation: Literal[1, 2]) -> Iterator[RecordedMessage]:
    """Convert scans to messages, in order of arrival.

    Args:
        recording: the recording.
        generation: of ROS; 1 writes a message per return where the radar is an AWR1843 with one antenna and one azimuth of
            each return, otherwise clouds are written.
    """
    streams = [_antenna_messages(recording, antenna, generation) for antenna in recording.stage.antennas]
    if recording.options.defects.side_radar:
        streams.append(
            cloud_message(SIDE_TOPIC, scan, TimeNs(scan.time + TRANSFER_NS), frame=SIDE_FRAME)
            for scan in side_scans(recording.stage)
        )
    return _by_arrival(*streams)


def _antenna_messages(
    recording: SimulatedRecording, antenna: Antenna, generation: Literal[1, 2]
) -> Iterator[RecordedMessage]:
    options, second = recording.options, recording.options.defects.second_azimuth
    cloud = generation == 2 or options.radar == "imaging" or second != "none" or bool(antenna.name)
    topic = f"{options.defects.cloud_topic}{'_' if antenna.name else ''}{antenna.name}"
    for scan, receive in zip(recording.scans_of(antenna), antenna.times.receive_ns, strict=True):
        if not cloud:
            yield from _returns(recording, scan, int(receive))
            continue
        yield cloud_message(topic, scan, TimeNs(int(receive)), second_column=second == "column")
        if second == "topic":
            other = replace(scan, points_radar_m=second_azimuths(scan.points_radar_m))
            yield cloud_message(f"{topic}{SECOND_SUFFIX}", other, TimeNs(int(receive)))


def cloud_message(
    topic: str, scan: RadarScan, receive: TimeNs, *, second_column: bool = False, frame: str = _RADAR_FRAME
) -> RecordedMessage:
    """Convert a scan to a cloud.

    Args:
        topic: of the message.
        scan: its returns.
        receive: when the recorder got it.
        second_column: whether it has a column with the second azimuth.
        frame: of the radar.
    """
    names: tuple[str, ...] = ("x", "y", "z", "intensity", "velocity")
    columns = [scan.points_radar_m, scan.snr_db, scan.doppler_mps]
    if second_column:
        names = (*names, SECOND_COLUMN)
        columns.append(polar_from_cartesian(second_azimuths(scan.points_radar_m))[:, 1])
    return RecordedMessage(topic, receive, CloudMessage(scan.time, frame, names, np.column_stack(columns)))


def _returns(recording: SimulatedRecording, scan: RadarScan, receive: int) -> Iterator[RecordedMessage]:
    """Yield one message per return, each stamped slightly later, as the TI driver does."""
    profile, points = recording.stage.profile, scan.points_radar_m
    ranges = np.linalg.norm(points, axis=1)
    bearings = np.rad2deg(np.arctan2(points[:, 1], points[:, 0]))
    bins = np.round(scan.doppler_mps / profile.doppler_bin_mps).astype(int) + profile.doppler_bins // 2
    columns = (*points.T, ranges, scan.doppler_mps, bins, bearings, scan.snr_db)
    for i, row in enumerate(zip(*(column.tolist() for column in columns), strict=True)):
        body = RadarReturnMessage(TimeNs(scan.time + i * _PARSE_NS), _RADAR_FRAME, i, *row)
        yield RecordedMessage("/ti_mmwave/radar_scan", TimeNs(receive + i * _PARSE_NS), body)
