"""The two small files written with a simulated recording: truth.json for tests, clicks.json as an example."""

import json
from typing import Any

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.interchange import write_clicks
from calib_core.measurements import TimeNs, time_parts
from calib_core.synthetic.options import Clicking
from calib_core.synthetic.recording import SimulatedRecording

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
