"""What views cover, and which view is missing."""

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_from_euler
from calib_core.intrinsics import Board, BoardCorners, Coverage, view_coverage
from calib_core.synthetic import typical_camera

BOARD = Board("checkerboard", 9, 6, 0.025)
CAMERA = typical_camera("plumb_bob", width_px=1280, height_px=720)
MIDDLE = BOARD.corners_m.mean(axis=0)


def seen(
    pan_deg: float = 0.0,
    tip_deg: float = 0.0,
    at: tuple[float, float, float] = (0.0, 0.0, 0.5),
    camera: Camera = CAMERA,
):
    """Return a view of the board turned about its upright and its level axis, with its middle at a point [m]."""
    turned = rotation_from_euler(*np.deg2rad([tip_deg, pan_deg, 0.0]))
    pose = RigidTransform(turned, np.array(at) - turned @ MIDDLE)
    pixels = camera.project(pose @ BOARD.corners_m)
    return BoardCorners(0, "view", None, (camera.width_px, camera.height_px), np.arange(54), pixels)


def covered(*views: BoardCorners) -> Coverage:
    return view_coverage(views, BOARD, (1280, 720))


@pytest.mark.parametrize(
    ("pan_deg", "tip_deg", "faces"),
    [(0.0, 0.0, "square on"), (35.0, 0.0, "left"), (-35.0, 0.0, "right"), (0.0, 35.0, "down"), (0.0, -35.0, "up")],
)
@pytest.mark.parametrize("at", [(0.0, 0.0, 0.5), (0.15, -0.05, 0.5), (-0.1, 0.08, 0.7)])
def test_a_tilt_is_named_by_where_the_board_faces(
    pan_deg: float, tip_deg: float, faces: str, at: tuple[float, float, float]
) -> None:
    sideways = float(np.degrees(np.arctan2(at[0], at[2])))
    upward = float(np.degrees(np.arctan2(at[1], at[2])))
    tilts = covered(seen(pan_deg + sideways, tip_deg - upward, at)).tilts
    assert tilts[faces] == 1
    assert sum(tilts.values()) == 1


def test_the_face_of_the_board_is_where_its_normal_points() -> None:
    view = seen(35.0)
    left, right = view.pixels_px[:9:8], view.pixels_px[-9::8]
    heights = np.abs(right[:, 1] - left[:, 1])
    assert heights[1] != pytest.approx(heights[0], rel=0.05)  # one side is nearer
    nearer_right = heights[1] > heights[0]
    assert covered(view).tilts["left" if nearer_right else "right"] == 1


def test_distance_is_told_by_the_share_of_the_picture() -> None:
    assert covered(seen(at=(0, 0, 0.25))).distances["near"] == 1
    assert covered(seen(at=(0, 0, 0.45))).distances["middle"] == 1
    assert covered(seen(at=(0, 0, 0.9))).distances["far"] == 1


def test_what_is_missing_is_said_until_nothing_is() -> None:
    few = covered(seen())
    assert "1 views of the board" in few.missing[0]
    assert any("upper left corner" in sentence for sentence in few.missing)
    assert any("no view in which the board faces left" in sentence for sentence in few.missing)
    every = [
        seen(pan, tip, (x, y, z))
        for x, y in ((-0.2, -0.1), (0.2, -0.1), (-0.2, 0.1), (0.2, 0.1), (0.0, 0.0))
        for pan, tip, z in ((35, 0, 0.35), (-35, 0, 0.35), (0, 35, 0.35), (0, -35, 0.35), (0, 0, 0.22))
    ]
    assert covered(*every).missing == ()
    assert covered(*every).share > 0.7


def test_counts_are_those_of_all_corners() -> None:
    coverage = covered(seen(), seen(35.0))
    assert coverage.counts.sum() == 108
    assert covered().share == 0.0
