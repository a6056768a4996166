"""Recordings with their calibration for Rerun and as overlay videos, compared with the time that was recorded."""

import subprocess
import sys
from pathlib import Path

from benchmarks.speed.recordings import write_bag
from benchmarks.speed.rows import Row, Table

__all__ = ["measure_showing"]

_FRAMES = 2_000
_SHOW = """
import pathlib, sys, time
import numpy as np
from cocalib.platform.process import keep_freed_memory
from cocalib.recorded_view import recorded_view
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.options import CalibrationOptions
from calib_core.recordings import open_recording
from calib_core.results import Calibration, Metrics
keep_freed_memory()
def peak():
    lines = pathlib.Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024
kind, path, out = sys.argv[1:4]
nan = float("nan")
with open_recording(path) as recording:
    image = recording.image_bytes(0)
    matrix = np.array([[900.0, 0, image.width_px / 2], [0, 900, image.height_px / 2], [0, 0, 1]])
    camera = Camera("plumb_bob", image.width_px, image.height_px, matrix, np.array([-0.1, 0.02, 0.001, 0.0]))
    ahead = RigidTransform(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]), np.zeros(3))
    calibration = Calibration(ahead, np.eye(6) * 1e-4, camera, Metrics(), (), (), (), CalibrationOptions())
    view = recorded_view(recording, calibration, "range")
    if kind == "rrd":
        import rerun
        import rerun.blueprint
        from cocalib.rerun import write_view
        work = lambda: write_view(view, pathlib.Path(out))
    else:
        import av
        from cocalib.overlay_video import OverlayOptions, write_overlay
        work = lambda: write_overlay(view, pathlib.Path(out), OverlayOptions(("calibration.json",)))
    before, start = peak(), time.process_time()
    work()
    elapsed_s = time.process_time() - start
    recorded_s = float(recording.image_times[-1] - recording.image_times[0]) / 1e9
    print(recorded_s, elapsed_s, before, peak())
"""


def measure_showing(scratch: Path) -> Table:
    """Measure on generated bags.

    Args:
        scratch: folder with enough space for the files.
    """
    large = write_bag(scratch / "large.bag", _FRAMES)
    short = write_bag(scratch / "short.bag", _FRAMES // 4)
    small = write_bag(scratch / "small.bag", _FRAMES // 4, size_px=(1280, 720), one_scene=True)
    rows = (
        *_rrd(scratch, large, short),
        _overlay(scratch, small, "overlay video of 1280 x 720"),
    )
    for path in (large, short, small):
        path.unlink()
    return Table(
        "Recordings for Rerun and overlay videos",
        "Bags generated for this run: images at 30 Hz, ten clouds of 120 returns a second; those of the overlay video are of "
        "one scene and differ in their noise. The times are the processor time, of all threads together, of the conversion of "
        "an open recording.",
        rows,
    )


def _shown(kind: str, path: Path, out: Path) -> tuple[float, float, float, float]:
    """Return the seconds recorded, the seconds of processor time needed, and the peak memory before and after [MB]."""
    command = [sys.executable, "-c", _SHOW, kind, str(path), str(out)]
    answer = subprocess.run(command, check=True, capture_output=True, text=True)
    recorded_s, needed_s, before_mb, after_mb = map(float, answer.stdout.split())
    out.unlink()
    return recorded_s, needed_s, before_mb, after_mb


def _rrd(scratch: Path, large: Path, short: Path) -> tuple[Row, Row]:
    recorded_s, needed_s, _, large_mb = _shown("rrd", large, scratch / "large.rrd")
    *_, short_mb = _shown("rrd", short, scratch / "short.rrd")
    ratio = recorded_s / needed_s
    return (
        Row(
            "record-rrd, 1920 x 1080",
            f"{needed_s:.1f} s for {recorded_s:.0f} s",
            f"{ratio:.0f} times as fast as recorded",
            "at least 10 times",
            ratio >= 10,
        ),
        Row(
            f"peak memory of it, {_FRAMES} frames, against a quarter of them",
            f"{large_mb:.0f} MB, {short_mb:.0f} MB",
            f"{large_mb / short_mb:.2f}",
            "under 1.3",
            large_mb < 1.3 * short_mb,
        ),
    )


def _overlay(scratch: Path, path: Path, what: str) -> Row:
    recorded_s, needed_s, _, peak_mb = _shown("overlay", path, scratch / "overlay.mp4")
    ratio = recorded_s / needed_s
    figure = f"{needed_s:.1f} s for {recorded_s:.0f} s, {peak_mb:.0f} MB"
    return Row(what, figure, f"{ratio:.2f} times as fast as recorded", "at least as fast", ratio >= 1)


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        for row in measure_showing(Path(folder)).rows:
            print(" | ".join((row.what, row.figure, row.ratio, row.aim, "met" if row.met else "MISSED")))
