"""Views of a board without the distortion, with straight lines through its outer corners to judge it by."""

from collections.abc import Iterator

import numpy as np

from calib_core.camera import Camera
from calib_core.interchange.cameras.rectification import rectification_maps, rectified_camera
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView
from cocalib.hypothesis_sheet import png
from cocalib.intrinsics.image_sources import OpenImages

_COLOUR = (80, 220, 255)


def rectified_images(images: OpenImages, lens: CalibratedLens) -> Iterator[tuple[str, bytes]]:
    """Rectify the images of the used views.

    Args:
        images: where the views were found.
        lens: with the views.

    Yields:
        the name of each image, and a PNG file.

    Raises:
        CalibrationError: an image cannot be read any more, or the lens cannot be rectified.
    """
    import cv2

    straight = rectified_camera(lens.camera)
    maps = rectification_maps(lens.camera, straight)
    for view in lens.views:
        image = images.image(view.corners.index)
        drawn = cv2.remap(image, maps.x_px, maps.y_px, cv2.INTER_LINEAR)
        for begin, end in _guides(lens, view, straight):
            cv2.line(drawn, begin, end, _COLOUR, 1, cv2.LINE_AA)
        yield view.corners.name, png(drawn)


def _guides(
    lens: CalibratedLens, view: LensView, straight: Camera
) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Yield the ends of lines through the first and the last corner of the outer rows and columns of the board."""
    grid = lens.board.corners_m[view.corners.corner_ids]
    with np.errstate(all="ignore"):
        places = straight.project(lens.camera.rays(view.corners.pixels_px))
    for axis in (0, 1):
        for value in (grid[:, axis].min(), grid[:, axis].max()):
            row = np.flatnonzero(np.isclose(grid[:, axis], value))
            ends = places[row[[grid[row, 1 - axis].argmin(), grid[row, 1 - axis].argmax()]]]
            if len(row) > 1 and np.isfinite(ends).all() and np.abs(ends).max() < 1e4:
                (u, v), (other_u, other_v) = np.round(ends).astype(int).tolist()
                yield (u, v), (other_u, other_v)
