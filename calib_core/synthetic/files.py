"""Write a simulated recording to a folder: in common containers or as plain files, with clicks and the truth."""

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from calib_core.boxes import boxes_text, labels_text
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.interchange import camera_info_text, write_clicks
from calib_core.lens_models.naming import written_lens
from calib_core.measurements import RadarScan, TimeNs, time_parts
from calib_core.radar import polar_from_cartesian
from calib_core.recordings.containers.writing import write_ros1_bag, write_ros2
from calib_core.synthetic.annotations import is_annotated, true_boxes, true_labels
from calib_core.synthetic.messages import all_messages, camera_messages, radar_messages
from calib_core.synthetic.options import Clicking, Container
from calib_core.synthetic.radar_profiles import Antenna
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording

Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number done and the total."""


def write_recording(
    recording: SimulatedRecording,
    folder: Path,
    containers: Sequence[Container] = ("ros1",),
    *,
    progress: Progress = lambda done, total: None,
) -> tuple[Path, ...]:
    """Write recording, truth.json and clicks.json, and return the data files.

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
        InputError: ROS has no name for the camera's lens model.
    """
    camera = recording.camera
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
            written.append(write_ros1_bag(folder / "camera.bag", camera_messages(recording, frames)))
        else:
            name = folder / f"recording_{container}"
            messages = all_messages(recording, 2, frames)
            written.append(write_ros2(name, messages, container="mcap" if container == "mcap" else "sqlite3"))
    (folder / "truth.json").write_text(truth_text(recording), encoding="utf-8")
    (folder / "clicks.json").write_text(clicks_text(recording), encoding="utf-8")
    if is_annotated(recording):
        (folder / "boxes.json").write_text(boxes_text(true_boxes(recording)), encoding="utf-8")
        (folder / "labels.json").write_text(labels_text(true_labels(recording)), encoding="utf-8")
    return tuple(written)


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
