"""What a person must know about a calibrated lens: warnings in words, with what to do."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from calib_core.arrays import Values
from calib_core.camera import Camera
from calib_core.intrinsics.board_shape import RowSkew, ShapeTest
from calib_core.intrinsics.linearization import ViewStack
from calib_core.intrinsics.model_choice import folds_back, picture_places
from calib_core.results import DataWarning

_LEAST_COVERED = 0.5
_FOCAL_SIGMA = 0.01
_FAR_PRINCIPAL_POINT = 0.15
_UNEQUAL_FOCAL_LENGTHS = 0.03
_LARGE_RMS_PX = 1.0
_FEW_VIEWS = 8


def worst_focal_sigma(camera: Camera) -> float:
    """Return the larger standard deviation of both focal lengths, as a share of them."""
    if camera.covariance is None:
        return 0.0
    return max(
        camera.covariance.sigma(name) / value
        for name, value in zip(("fx_px", "fy_px"), camera.parameters[:2], strict=True)
    )


def lens_warnings(camera: Camera, stack: ViewStack, rms_px: float) -> Iterator[DataWarning]:
    """Say what is doubtful about a lens and the views that it was calibrated with."""
    yield from _about_views(camera, stack)
    yield from _about_numbers(camera, rms_px)
    outside = folds_back(camera, picture_places(stack.size_px))
    if outside.any() and camera.lens.is_perspective:
        yield DataWarning(
            "lens-folds-back",
            f"the distortion folds back in {100.0 * outside.mean():.0f} % of the picture, where no corners were found",
            "film the board there, or choose a simpler lens model",
        )


def _about_views(camera: Camera, stack: ViewStack) -> Iterator[DataWarning]:
    covered = _covered_share(stack)
    if covered < _LEAST_COVERED:
        yield DataWarning(
            "little-covered",
            f"the corners of all views cover {100.0 * covered:.0f} % of the picture; beyond them the lens is a guess",
            "film the board in the corners and along the edges of the picture",
        )
    if len(stack) < _FEW_VIEWS:
        yield DataWarning(
            "few-views",
            f"only {len(stack)} views; how well the lens is known is itself poorly known",
            "film 15 to 30 views, tilted to all sides",
        )
    sigma = worst_focal_sigma(camera)
    if sigma > _FOCAL_SIGMA:
        yield DataWarning(
            "weak-focal-length",
            f"the focal length is known to {100.0 * sigma:.1f} % only",
            "film views in which the board is turned by 30 to 45 deg to the left, right, up and down",
        )


def _about_numbers(camera: Camera, rms_px: float) -> Iterator[DataWarning]:
    fx, fy, cx, cy = camera.parameters[:4]
    off = np.abs([cx / (camera.width_px - 1) - 0.5, cy / (camera.height_px - 1) - 0.5])
    if off.max() > _FAR_PRINCIPAL_POINT:
        yield DataWarning(
            "principal-point-far",
            f"the principal point ({cx:.0f}, {cy:.0f}) is far from the middle of the picture "
            f"({(camera.width_px - 1) / 2:.0f}, {(camera.height_px - 1) / 2:.0f})",
            "check whether the pictures are cropped; if not, film more tilted views all over the picture",
        )
    if abs(fx / fy - 1.0) > _UNEQUAL_FOCAL_LENGTHS:
        yield DataWarning(
            "unequal-focal-lengths",
            f"the focal lengths differ by {100.0 * abs(fx / fy - 1.0):.1f} %: {fx:.1f} px along rows, {fy:.1f} px along columns",
            "check whether the pictures were resized with other proportions, and whether the board's squares are square",
        )
    if rms_px > _LARGE_RMS_PX:
        yield DataWarning(
            "large-residuals",
            f"the corners fit to {rms_px:.2f} px; 0.1 to 0.5 px is usual",
            "check the number of corners of the board, the focus and the lens model, and hold the board still",
        )


def _covered_share(stack: ViewStack) -> float:
    """Return which share of the picture lies in the convex hull of all corners."""
    found = np.moveaxis(stack.pixels_px, 1, 2)[stack.weights > 0]
    try:
        return float(ConvexHull(found).volume / (stack.size_px[0] * stack.size_px[1]))
    except QhullError:
        return 0.0


def shape_warnings(test: ShapeTest, amounts: Values, sigmas: Values, *, modelled: bool) -> Iterator[DataWarning]:
    """Say how the board is bent or stretched.

    Args:
        test: of the board's shape.
        amounts: (s,) of the warps that were found.
        sigmas: (s,) of the same.
        modelled: whether the lens was calibrated with the board's shape as found.
    """
    done = "it was taken into account" if modelled else "it was not taken into account, because board_shape is flat"
    bends = [
        f"{abs(1e3 * amount):.2f} ± {1e3 * sigma:.2f} mm {_BENDS[name]}"
        for name, amount, sigma in zip(test.found.names, amounts, sigmas, strict=True)
        if name in _BENDS and abs(amount) > 2.0 * sigma
    ]
    if bends:
        yield DataWarning(
            "bent-board",
            f"the board is bent by {' and '.join(bends)}; {done}",
            "fix the board to glass or a stiff plate" + ("" if modelled else ", or set board_shape to auto"),
        )
    for name, amount, sigma in zip(test.found.names, amounts, sigmas, strict=True):
        if name not in _BENDS:
            yield DataWarning(
                "unequal-squares",
                f"the squares are {100.0 * abs(amount):.2f} ± {100.0 * sigma:.2f} % {'wider' if amount > 0 else 'narrower'} "
                f"than high; {done}",
                "measure ten squares along a row and along a column, and print without scaling to the page",
            )


def skew_warnings(skew: RowSkew) -> Iterator[DataWarning]:
    """Say that views are skewed as by motion under a rolling shutter."""
    if skew.shows:
        yield DataWarning(
            "skewed-views",
            f"views are skewed by {np.median(skew.skews_px):.1f} px (median) from the first row of the picture to the last, "
            f"which explains {100.0 * skew.share:.0f} % of the squared residuals: a board that moved under a rolling shutter "
            "does that, or a lens model that does not fit",
            "hold board and camera still for each view, or lean the board on something and move the camera between views",
        )


_BENDS = {
    "bend along the rows": "in the middle of its rows",
    "bend along the columns": "in the middle of its columns",
    "twist": "at its corners (twisted)",
}
