"""What the tab Lens says of a camera and of a calibrated lens."""

import numpy as np
import pytest

from calib_core.camera import Camera, CameraCovariance
from calib_core.geometry import RigidTransform
from calib_core.intrinsics import Board, BoardCorners, CalibratedLens, LeftOutPicture, LensView, ModelTrial
from calib_core.results import DataWarning
from cocalib.web.channel.lens_panel import camera_table, lens_result, view_corners
from cocalib.web.messages import encode

MATRIX = np.array([[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]])
NAMES = ("fx_px", "fy_px", "cx_px", "cy_px")
CAMERA = Camera("pinhole", 640, 480, MATRIX, covariance=CameraCovariance(NAMES, np.diag([0.25, 0.25, 0.01, 0.01])))
BOARD = Board("checkerboard", 4, 3, 0.1)


def lens_view(index: int, rms_px: float) -> LensView:
    pose = RigidTransform(np.eye(3), np.array([-0.15, -0.1, 1.0 + 0.2 * index]))
    pixels = CAMERA.project(pose @ BOARD.corners_m)
    found = BoardCorners(index, f"frame {index + 1}", None, (640, 480), np.arange(12), pixels)
    used = np.arange(12) != 5
    return LensView(found, pose, np.full((12, 2), 0.1), used, rms_px, rms_px + 0.01)


LENS = CalibratedLens(
    CAMERA,
    BOARD,
    BOARD.corners_m,
    tuple(lens_view(index, rms_px) for index, rms_px in ((3, 0.1), (7, 0.4), (9, 0.2))),
    (LeftOutPicture(5, "frame 6", "blurred"),),
    0.25,
    float("nan"),
    (ModelTrial("pinhole", 0.25, 0.26), ModelTrial("plumb_bob", 0.25, 0.27, 0.01, 0.002)),
    "pinhole: the others predict no better",
    (DataWarning("board-bent", "the board is bent", "fix it to glass"),),
)


def test_intrinsics_are_shown_with_what_is_known_of_them() -> None:
    table = camera_table(CAMERA, "camera.yaml")
    assert [(row.name, row.value, row.unit) for row in table.parameters[:2]] == [
        ("fx", "500.0 ± 0.5", "px"),
        ("fy", "500.0 ± 0.5", "px"),
    ]
    assert table.known
    assert table.field == "65.2 x 51.3 deg"
    unknown = camera_table(Camera("pinhole", 640, 480, MATRIX), "camera.yaml")
    assert unknown.parameters[0].value == "500.000"
    assert not unknown.known


def test_a_lens_is_shown_with_its_views_what_was_left_out_and_why() -> None:
    shown = lens_result(4, LENS, "the board")
    assert [view.frame for view in shown.views] == [7, 9, 3], "the worst first"
    assert [(one.frame, one.reason) for one in shown.left_out] == [(5, "blurred")]
    assert [(trial.model, trial.chosen, trial.note) for trial in shown.trials] == [
        ("pinhole", True, ""),
        ("plumb_bob", False, "0.0100 ± 0.0020 px² worse"),
    ]
    assert shown.choice == "pinhole: the others predict no better."
    assert shown.warnings[0].message == "The board is bent."
    assert len(shown.residuals) == 33, "of corners that were used"
    assert shown.uncertainty is not None
    assert len(shown.uncertainty.values) == shown.uncertainty.columns * shown.uncertainty.rows
    assert '"held_out_rms_px":null' in encode(shown), "what is not known is no number"


@pytest.mark.parametrize(("frame", "count"), [(7, 12), (5, 0)])
def test_the_corners_of_a_frame_are_those_of_its_view(frame: int, count: int) -> None:
    corners = view_corners(LENS, frame)
    assert len(corners) == count
    assert [one[4] for one in corners] == [number != 5 for number in range(count)]
