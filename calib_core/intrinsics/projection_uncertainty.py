"""How far the projection of a far point is uncertain, all over the picture."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Grid, Points2, Values, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import larger_eigenvalues, rotation_jacobian
from calib_core.intrinsics.calibrated_lens import CalibratedLens

MODEL_ERRORS_UNSEEN = (
    "The projection uncertainty follows from the scatter of the corners. It cannot see what the lens model itself gets wrong, "
    "which may be larger; calibrating halves of the views separately shows some of that."
)

_COLUMNS, _ROWS = 32, 20


@dataclass(frozen=True, slots=True, eq=False)
class PictureGrid:
    """Standard deviations over the picture.

    Attributes:
        x_px: (c,) columns of the grid.
        y_px: (r,) its rows.
        sigma_px: (r, c) in the direction in which it is largest; NaN where the lens sees nothing.
    """

    x_px: Values
    y_px: Values
    sigma_px: Grid

    def __post_init__(self) -> None:
        object.__setattr__(self, "x_px", frozen_array(self.x_px, (None,)))
        object.__setattr__(self, "y_px", frozen_array(self.y_px, (None,)))
        object.__setattr__(self, "sigma_px", frozen_array(self.sigma_px, (len(self.y_px), len(self.x_px))))


def projection_uncertainty(lens: CalibratedLens, columns: int = _COLUMNS, rows: int = _ROWS) -> PictureGrid:
    """Return how far the pixel of a fixed, far point is uncertain.

    Other intrinsics would have given the views other poses, so that a change of all pixels which a rotation of the camera
    undoes is no uncertainty of the lens: it is taken out, as it appears where corners were found.

    Args:
        lens: with the covariance of its camera.
        columns: of the grid.
        rows: of the grid.
    """
    x_px, y_px, places = picture_grid(lens.camera, columns, rows)
    covariance = lens.camera.covariance
    matrix = np.zeros((len(lens.camera.parameters),) * 2) if covariance is None else covariance.matrix
    spread = grid_covariance(lens.camera, matrix, places, found_pixels(lens))
    return PictureGrid(x_px, y_px, np.sqrt(np.maximum(larger_eigenvalues(spread), 0.0)).reshape(rows, columns))


def picture_grid(camera: Camera, columns: int, rows: int) -> tuple[Values, Values, Points2]:
    """Return columns, rows and pixels (rows * columns, 2) of a grid over the whole picture [px]."""
    x_px, y_px = np.linspace(0.0, camera.width_px - 1.0, columns), np.linspace(0.0, camera.height_px - 1.0, rows)
    return x_px, y_px, np.stack([axis.ravel() for axis in np.meshgrid(x_px, y_px)], axis=1)


def found_pixels(lens: CalibratedLens) -> Points2:
    """Return where the used corners were found, in all views: (n, 2) [px]."""
    return np.concatenate([view.corners.pixels_px[view.used] for view in lens.views])


def grid_covariance(camera: Camera, matrix: np.ndarray, places_px: Points2, found_px: Points2) -> np.ndarray:
    """Return the covariance (n, 2, 2) of the pixels of far points, without what a rotation of the camera does [px^2].

    Args:
        camera: the intrinsics.
        matrix: (p, p) their covariance.
        places_px: (n, 2) the pixels of the points.
        found_px: (m, 2) the pixels at which the rotation is fitted.
    """
    lens_at_found, turn_at_found = far_point_slopes(camera, found_px)
    seen = np.isfinite(lens_at_found).all(axis=(1, 2)) & np.isfinite(turn_at_found).all(axis=(1, 2))
    count = lens_at_found.shape[2]
    turns = np.linalg.lstsq(turn_at_found[seen].reshape(-1, 3), lens_at_found[seen].reshape(-1, count), rcond=None)[0]
    lens_slopes, turn_slopes = far_point_slopes(camera, places_px)
    slopes = lens_slopes - turn_slopes @ turns
    return np.asarray(slopes @ matrix @ np.swapaxes(slopes, 1, 2))


def far_point_slopes(camera: Camera, pixels_px: Points2) -> tuple[np.ndarray, np.ndarray]:
    """Return how pixels of far points move with the intrinsics (n, 2, p) and with a rotation of the camera (n, 2, 3) [px/rad].

    Both are NaN where the lens has no ray.

    Args:
        camera: the intrinsics.
        pixels_px: (n, 2).
    """
    rays = np.ascontiguousarray(camera.rays(pixels_px).T)
    with np.errstate(all="ignore"):
        turned = np.empty((3, 2, len(pixels_px)))
        rotation_jacobian(rays, camera.project_planes(rays)[1], out=turned)
        return np.moveaxis(camera.parameter_planes(rays), 2, 0).swapaxes(1, 2), np.moveaxis(turned, 2, 0).swapaxes(1, 2)
