"""Write a simulated recording without ROS, as people's own recorders do: dated pictures, a table of returns, intrinsics."""

import json
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal

import numpy as np

from calib_core.interchange import camera_info_text
from calib_core.measurements import RadarScan, TimeNs
from calib_core.radar import polar_from_cartesian
from calib_core.synthetic.radar.antennas import Antenna
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording

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
