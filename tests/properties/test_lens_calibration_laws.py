"""Laws of calibrating a lens: what must not change it, and how it changes with the image."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch
from tests.unit.intrinsics.corner_draws import BOARD, CAMERAS, SIZE_PX, drawn_views

VIEWS = drawn_views(CAMERAS["plumb_bob"], 9, 31)


def calibrated(
    views: tuple[BoardCorners, ...], *, square_m: float = BOARD.square_m, size_px: tuple[int, int] = SIZE_PX
) -> CalibratedLens:
    lens = calibrate_lens(
        BoardSearch(msgspec.structs.replace(BOARD, square_m=square_m), size_px, views, (), len(views)), "plumb_bob"
    )
    assert isinstance(lens, CalibratedLens), lens
    return lens


@pytest.fixture(scope="module")
def lens() -> CalibratedLens:
    return calibrated(VIEWS)


def same_lens(one: CalibratedLens, other: np.ndarray) -> None:
    apart = (one.camera.parameters - other) / np.sqrt(np.diag(one.camera.covariance.matrix))
    assert np.abs(apart).max() < 1e-3  # of a standard deviation


@pytest.mark.parametrize("factor", [0.01, 3.0])
def test_the_size_of_the_squares_changes_distances_and_nothing_else(factor, lens):
    other = calibrated(VIEWS, square_m=factor * BOARD.square_m)
    same_lens(other, lens.camera.parameters)
    for one, two in zip(lens.views, other.views, strict=True):
        np.testing.assert_allclose(
            two.camera_from_board.translation_m, factor * one.camera_from_board.translation_m, rtol=1e-4
        )


def test_the_order_of_the_views_does_not_matter(lens):
    same_lens(calibrated(VIEWS[::-1]), lens.camera.parameters)


def test_the_order_of_the_corners_does_not_matter(lens):
    order = np.random.default_rng(0).permutation(54)
    mixed = tuple(replace(view, corner_ids=view.corner_ids[order], pixels_px=view.pixels_px[order]) for view in VIEWS)
    same_lens(calibrated(mixed), lens.camera.parameters)


def test_images_of_twice_the_size_have_twice_the_focal_length(lens):
    larger = tuple(replace(view, size_px=(2560, 1440), pixels_px=2.0 * view.pixels_px + 0.5) for view in VIEWS)
    same_lens(calibrated(larger, size_px=(2560, 1440)), lens.camera.scaled(2.0).parameters)


def test_mirroring_all_images_mirrors_the_principal_point(lens):
    mirrored = tuple(replace(view, pixels_px=view.pixels_px * [-1.0, 1.0] + [SIZE_PX[0] - 1.0, 0.0]) for view in VIEWS)
    expected = lens.camera.parameters.copy()
    expected[2] = SIZE_PX[0] - 1.0 - expected[2]
    expected[7] *= -1.0  # p2, which belongs to x
    same_lens(calibrated(mirrored), expected)
