"""First lenses: of every model, of a fisheye beyond 180 deg, and with views that show something else."""

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.geometry import rotation_exp
from calib_core.intrinsics import BoardCorners
from calib_core.intrinsics.solving.adjustment import adjust
from calib_core.intrinsics.solving.linearization import Freedom, residuals_of, stack_views
from calib_core.intrinsics.solving.starting import pose_views, start
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, Errors, drawn_views


@pytest.mark.parametrize("model", CAMERAS)
def test_from_the_start_an_adjustment_reaches_the_noise(model: str) -> None:
    stack = stack_views(drawn_views(CAMERAS[model], 12, 4), BOARD.corners_m, SIZE_PX)
    first = start(model, stack)
    assert first is not None
    state = adjust(first, stack, Freedom.of(first.camera))
    assert np.sqrt(stack.mean_square(residuals_of(state, stack)).mean()) < 0.145
    assert state.camera.matrix_px[0, 0] == pytest.approx(CAMERAS[model].matrix_px[0, 0], rel=0.01)


def test_a_fisheye_of_200_degrees_is_found() -> None:
    matrix = np.array([[280.0, 0.0, 500.0], [0.0, 281.0, 490.0], [0.0, 0.0, 1.0]])
    camera = Camera("equidistant", 1000, 1000, matrix, np.array([0.01, -0.004, 0.001, -0.0001]))
    rng, board_m = np.random.default_rng(3), BOARD.corners_m - BOARD.corners_m.mean(axis=0)
    views = []
    for index in range(16):
        angle, around = rng.uniform(0.0, 1.6), 2.0 * np.pi * index / 16
        look = rotation_exp(angle * np.array([-np.sin(around), np.cos(around), 0.0]))
        turn = look @ rotation_exp(rng.uniform(-0.5, 0.5, 3))
        pixels = camera.project(board_m @ turn.T + look @ [0.0, 0.0, 0.25])
        views.append(
            BoardCorners(index, str(index), None, (1000, 1000), np.arange(54), pixels + rng.normal(0, 0.1, (54, 2)))
        )
    stack = stack_views(views, BOARD.corners_m, (1000, 1000))
    first = start("equidistant", stack)
    assert first is not None
    state = adjust(first, stack, Freedom.of(first.camera))
    assert np.abs(state.camera.parameters[:4] - camera.parameters[:4]).max() < 0.5
    most = max(np.degrees(np.arccos(state.camera.rays(view.pixels_px)[:, 2])).max() for view in views)
    assert most > 90.0


def test_poses_without_noise_are_exact() -> None:
    camera = CAMERAS["plumb_bob"]
    stack = stack_views(drawn_views(camera, 5, 2, Errors(noise_px=0.0)), BOARD.corners_m, SIZE_PX)
    state, posed = pose_views(camera, stack)
    assert posed.corner_counts.tolist() == [54] * 5
    assert np.abs(residuals_of(state, stack)).max() < 1e-6


def test_a_third_of_views_that_show_something_else_does_not_mislead_the_start() -> None:
    views = drawn_views(CAMERAS["plumb_bob"], 12, 6)
    rng = np.random.default_rng(0)
    strange = [
        BoardCorners(12 + n, f"strange {n}", None, SIZE_PX, np.arange(54), rng.uniform(0, 700, (54, 2)))
        for n in range(5)
    ]
    first = start("plumb_bob", stack_views([*views, *strange], BOARD.corners_m, SIZE_PX))
    assert first is not None
    assert first.camera.matrix_px[0, 0] == pytest.approx(900.0, rel=0.01)
