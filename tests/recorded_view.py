"""A small recording with a calibration, clicks and boxes, as overlay videos and Rerun show it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from calib_core.interchange.own.clicks_json import read_clicks
from calib_core.measurements import Box, Boxes, FrameBoxes, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.recordings import Recording, open_recording
from calib_core.recordings.containers.writing import write_ros2
from calib_core.results import Calibration
from cocalib.recorded_view import RecordedView, recorded_view
from cocalib.solving.solving import solve_clicks
from tests.cli.conftest import Made


@contextmanager
def opened_view(folder: Path, **more: object) -> Iterator[RecordedView]:
    """Write the recording, solve its clicks, and yield what there is to show.

    Args:
        folder: to write it into.
        more: arguments of `recorded_view`.
    """
    made = Made()
    path = write_ros2(folder / "made.mcap", made.messages(), container="mcap")
    with open_recording(path) as recording:
        clicks = read_clicks(made.clicks(), "clicks.json")
        solved = solve_clicks(recording, clicks, made.camera, CalibrationOptions())
        assert isinstance(solved, Calibration)
        yield recorded_view(recording, solved, "range", **more)


def boxes_around(recording: Recording, frames: tuple[int, ...]) -> Boxes:
    """Return one box in each of some frames, which are all that are annotated."""
    box = Box(40.0, 50.0, 120.5, 150.0, "person", track="person-1")
    times = [TimeNs(int(recording.image_times[index])) for index in frames]
    return Boxes(tuple(FrameBoxes(time, (box,)) for time in times), "boxes.json", (320, 240))


def nearest_rows(recording: Recording, time: int) -> np.ndarray:
    """Return the positions (n, 3) of the scan nearest to a time, found one by one."""
    scans = recording.radar_scans()
    nearest = min(range(len(scans)), key=lambda index: abs(int(scans.times_ns[index]) - time))
    return scans.scan(nearest).points_radar_m
