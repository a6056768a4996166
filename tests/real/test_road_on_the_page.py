"""The road recording with its published calibration: what is drawn over the frame lies where OpenCV projects it."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import TimeNs
from calib_core.options import CalibrationOptions
from calib_core.recordings import open_recording
from calib_core.results import Calibration, Metrics
from cocalib.session.state import Session
from cocalib.web.radar_sight import RadarSight, overlay_of

pytestmark = pytest.mark.real


def published_calibration(folder: Path) -> tuple[Calibration, np.ndarray]:
    """Return the published calibration as ours, and its matrix as it was published."""
    document = json.loads((folder / "published_calibration.json").read_text(encoding="utf-8"))
    matrix = np.array(document["T_radar_to_camera"])
    u, _, vt = np.linalg.svd(matrix[:3, :3])
    calibration = Calibration(
        camera_from_radar=RigidTransform(u @ vt, matrix[:3, 3]),
        covariance=np.full((6, 6), np.nan),
        camera=Camera(
            "plumb_bob", document["width"], document["height"], np.array(document["K"]), np.array(document["D"])
        ),
        metrics=Metrics(),
        pairs=(),
        unpaired=(),
        warnings=(),
        options=CalibrationOptions(),
    )
    return calibration, matrix


@pytest.mark.parametrize("name", ["pjlab_radar_camera.bag", "pjlab_radar_camera_mcap", "pjlab_radar_camera_db3"])
def test_tracks_are_drawn_where_opencv_projects_them(shared_data, name):
    folder = shared_data / "real_radar_camera_road"
    calibration, matrix = published_calibration(folder)
    camera = calibration.camera
    with open_recording(folder / name) as recording:
        time = TimeNs(int(recording.image_times[3]))
        scan = RadarSight(recording).scan_at(time)
        assert scan.time == time
        overlay = overlay_of(3, Session(outcome=calibration, outcome_revision=0), scan, ())
    rotation_vector, _ = cv2.Rodrigues(matrix[:3, :3])
    expected, _ = cv2.projectPoints(
        scan.points_radar_m, rotation_vector, matrix[:3, 3], camera.matrix_px, camera.distortion
    )
    in_front = calibration.camera_from_radar @ scan.points_radar_m
    visible = (in_front[:, 2] > 0) & camera.in_image(expected[:, 0])
    drawn = {round(mark.range_m, 3): (mark.u_px, mark.v_px) for mark in overlay.returns or ()}
    ranges = np.round(np.linalg.norm(scan.points_radar_m[visible], axis=1), 3)
    assert len(drawn) >= 20, "the road scene has dozens of tracks in view"
    assert set(drawn) <= set(ranges.tolist())
    for range_m, pixel in zip(ranges.tolist(), expected[visible, 0], strict=True):
        if range_m in drawn:  # a return seen beyond the fold of the lens is left out
            assert drawn[range_m] == pytest.approx(tuple(pixel), abs=0.1)
