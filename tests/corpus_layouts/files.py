"""Layouts without ROS: tables, JSON lines, dated images and a data port."""

import json
import struct
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from calib_core.recordings import RecordingOptions
from tests.corpus_layouts.truth import START_NS, Returns, Truth, image_times, jpeg, scene


def date_text(time_ns: int, pattern: str) -> str:
    """Format a time in UTC; %f stands for its microseconds."""
    return datetime.fromtimestamp(time_ns // 1000 / 1e6, UTC).strftime(pattern)


def write_dated_images(folder: Path, times_ns: np.ndarray) -> None:
    """Write images as scripts name them that store the date with microseconds."""
    folder.mkdir(parents=True)
    for number, time_ns in enumerate(times_ns.tolist()):
        (folder / date_text(time_ns, "img_%Y-%m-%d_%H-%M-%S-%f.jpg")).write_bytes(jpeg(number))


def json_lines(folder: Path) -> Truth:
    """JSON lines of a Python script: a time in seconds and a list of objects with a nested position."""
    returns = scene(20)
    lines = []
    for number, scan in enumerate(returns.scans()):
        objects = [
            {"id": index, "pos": {"x": x, "y": y, "z": z}, "vel": doppler, "snr": snr}
            for index, ((x, y, z), doppler, snr) in enumerate(
                zip(scan.points_m.round(4).tolist(), scan.doppler_mps.tolist(), scan.snr_db.tolist(), strict=True)
            )
        ]
        lines.append(json.dumps({"ts": int(scan.times_ns[0]) / 1e9, "frame": number, "objects": objects}))
    (folder / "radar.jsonl").write_text("\n".join(lines) + "\n")
    write_dated_images(folder / "cam", image_times())
    return Truth((folder,), returns, image_times(), has_camera=False, time_tolerance_ns=1000)


def german_table(folder: Path) -> Truth:
    """CSV of a German spreadsheet: semicolons, decimal commas, a row of units, columns nobody knows."""
    returns = scene(21)
    rows = ["Timestamp;Mode;PosX;PosY;PosZ;vRad;RCS;Existence", "ms;;m;m;m;km/h;dBsm;%"]
    for time_ns, (x, y, z), doppler, snr in _table(returns):
        figures = [
            f"{time_ns / 1e6:.3f}",
            "A",
            f"{x:.3f}",
            f"{y:.3f}",
            f"{z:.3f}",
            f"{doppler * 3.6:.3f}",
            f"{snr - 20:.1f}",
        ]
        rows.append(";".join([*(figure.replace(".", ",") for figure in figures), "99,5"]))
    (folder / "radar_export.csv").write_text("\ufeff" + "\r\n".join(rows) + "\r\n", encoding="utf-8")
    write_dated_images(folder / "camera", image_times())
    return Truth((folder,), returns, image_times(), has_camera=False, time_tolerance_ns=1000)


def tab_separated(folder: Path) -> Truth:
    """A .tsv with two lines of comments, a row of units in brackets, and millimetres."""
    returns = scene(25)
    rows = ["# radar log, version 2", "# sensor: front", "time\tx\ty\tz\tv", "[ns]\t[mm]\t[mm]\t[mm]\t[m/s]"]
    for time_ns, (x, y, z), doppler, _ in _table(returns):
        rows.append(f"{time_ns}\t{x * 1e3:.1f}\t{y * 1e3:.1f}\t{z * 1e3:.1f}\t{doppler:.3f}")
    (folder / "radar.tsv").write_text("\n".join(rows) + "\n")
    write_dated_images(folder / "camera", image_times())
    return Truth((folder,), returns, image_times(), has_camera=False)


def _table(returns: Returns) -> list[tuple[int, list[float], float, float]]:
    return list(
        zip(
            returns.times_ns.tolist(),
            returns.points_m.tolist(),
            returns.doppler_mps.tolist(),
            returns.snr_db.tolist(),
            strict=True,
        )
    )


def lists_and_dates(folder: Path) -> Truth:
    """CSV of pandas: one scan a row, lists in the cells, dates such as 2024/05/17/09:42:31.20."""
    start_ns = 1_715_938_951_200_000_000
    returns = scene(22, start_ns=start_ns)
    rows = ["date,num_points,x,y,z,velocity,snr"]
    for scan in returns.scans():
        time_ns = int(scan.times_ns[0])
        lists = [*scan.points_m.T.round(4).tolist(), scan.doppler_mps.round(4).tolist(), scan.snr_db.round(2).tolist()]
        moment = date_text(time_ns, "%Y/%m/%d/%H:%M:%S.") + f"{time_ns // 10_000_000 % 100:02d}"
        rows.append(",".join([moment, str(len(scan.times_ns)), *(f'"{values}"' for values in lists)]))
    (folder / "radar_points.csv").write_text("\n".join(rows) + "\n")
    write_dated_images(folder / "images", image_times())
    stated = RecordingOptions(map=("x=x:m", "y=y:m", "z=z:m", "doppler=velocity:mps"))
    return Truth((folder,), returns, image_times(), has_camera=False, stated=stated)


def scans_paired_by_number(folder: Path) -> Truth:
    """One CSV per frame, numbered as the images are; the images have a list of times."""
    times_ns = image_times()
    returns = scene(23, scans=len(times_ns))
    (folder / "radar").mkdir()
    (folder / "image").mkdir()
    for number, scan in enumerate(returns.scans()):
        rows = [f"{x:.4f},{y:.4f},{z:.4f},{doppler:.3f},{snr:.1f}" for _, (x, y, z), doppler, snr in _table(scan)]
        (folder / "radar" / f"{number:06d}.csv").write_text("\n".join(["x_m,y_m,z_m,doppler_mps,snr_db", *rows]) + "\n")
        (folder / "image" / f"{number:06d}.png").write_bytes(jpeg(number, ".png"))
    (folder / "image" / "timestamps.txt").write_text("\n".join(str(time) for time in times_ns.tolist()) + "\n")
    counts = [len(scan.times_ns) for scan in returns.scans()]
    return Truth((folder,), returns.with_times(np.repeat(times_ns, counts)), times_ns, has_camera=False)


def data_port(folder: Path) -> Truth:
    """The bytes of a TI AWR1843's data port as a terminal program stored them, beside dated images."""
    start_ns, period_ns = START_NS, 100_000_000
    returns = scene(24, start_ns=start_ns, period_ns=period_ns)
    stream = bytearray(b"\x13\x37" * 5)
    for number, scan in enumerate(returns.scans()):
        stream += _packet(number + 1, int(number * 0.1 * 200e6) + 9_000, scan)
    (folder / "xwr18xx_processed_stream.dat").write_bytes(bytes(stream))
    write_dated_images(folder / "camera", image_times())
    given = RecordingOptions(radar_start=f"{start_ns / 1e9:.6f},0.1")
    return Truth((folder,), returns, image_times(), has_camera=False, time_tolerance_ns=1000, given=given)


def _packet(frame: int, cycles: int, scan: Returns) -> bytes:
    """Pack a scan as SDK 3 does; TI counts x to the right and y forward."""
    count = len(scan.times_ns)
    points = np.column_stack([-scan.points_m[:, 1], scan.points_m[:, 0], scan.points_m[:, 2], scan.doppler_mps])
    side = np.column_stack([np.rint(scan.snr_db * 10), np.full(count, 300)]).astype("<i2")
    parts = [(1, points.astype("<f4").tobytes()), (7, side.tobytes()), (2, bytes(512)), (6, bytes(24))]
    body = b"".join(struct.pack("<II", kind, len(data)) + data for kind, data in parts)
    length = -(-(40 + len(body)) // 32) * 32
    header = bytes((2, 1, 4, 3, 6, 5, 8, 7)) + struct.pack(
        "<8I", 0x03050004, length, 0x000A1843, frame, cycles & 0xFFFFFFFF, count, len(parts), 0
    )
    return (header + body).ljust(length, b"\x0f")
