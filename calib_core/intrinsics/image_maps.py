"""Maps of a calibrated lens over the image: residuals, and whether they are more than noise; how uncertain a projection is."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Grid, Points2, Values, freeze
from calib_core.camera import Camera
from calib_core.geometry import larger_eigenvalues, rotation_jacobian
from calib_core.intrinsics.calibrated_lens import CalibratedLens

_COLUMNS, _ROWS = 12, 8
_SIGMAS = 3.0
_CORRELATED = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class ResidualField:
    """Means of the residuals of all used corners, projected minus found, over cells of the image.

    Attributes:
        x_px: (c,) middles of the cells' columns.
        y_px: (r,) middles of their rows.
        means_px: (r, c, 2) of the residuals in a cell; NaN in an empty one.
        errors_px: (r, c) standard error of a mean along either axis, as the views differ; NaN if fewer than two are there.
        counts: (r, c) corners in a cell.
        systematic_px: the part that all views share, as a root mean square over the corners; 0 if none shows.
        systematic: whether that is more than noise.
        neighbour_correlation: of the residuals of corners that are next to each other on the board; about 0 for noise.
    """

    x_px: Values
    y_px: Values
    means_px: np.ndarray
    errors_px: np.ndarray
    counts: np.ndarray
    systematic_px: float
    systematic: bool
    neighbour_correlation: float = 0.0

    def __post_init__(self) -> None:
        grid = (len(self.y_px), len(self.x_px))
        freeze(self, x_px=(None,), y_px=(None,))
        freeze(self, means_px=(*grid, 2), errors_px=grid)
        freeze(self, np.int64, counts=grid)

    @property
    def neighbours_alike(self) -> bool:
        """Whether neighboring corners of a view err alike."""
        return self.neighbour_correlation > _CORRELATED


def residual_field(lens: CalibratedLens, columns: int = _COLUMNS, rows: int = _ROWS) -> ResidualField:
    """Return the residuals over the image.

    Args:
        lens: with its views.
        columns: of cells.
        rows: of cells.
    """
    pixels = np.concatenate([view.corners.pixels_px[view.used] for view in lens.views])
    residuals = np.concatenate([view.residuals_px[view.used] for view in lens.views])
    owners = np.repeat(np.arange(len(lens.views)), [int(view.used.sum()) for view in lens.views])
    size = np.array([lens.camera.width_px, lens.camera.height_px])
    column, row = np.clip(((pixels + 0.5) / size * [columns, rows]).astype(int), 0, [columns - 1, rows - 1]).T
    sums = np.zeros((len(lens.views), rows, columns, 2))
    counts = np.zeros((len(lens.views), rows, columns))
    np.add.at(sums, (owners, row, column), residuals)
    np.add.at(counts, (owners, row, column), 1.0)
    total = counts.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        means = sums.sum(axis=0) / total[:, :, None]
        apart = sums - counts[:, :, :, None] * means
        there = (counts > 0).sum(axis=0)
        errors = np.sqrt(np.square(apart).sum(axis=(0, 3)) / 2.0 * there / (there - 1.0)) / total
    energy, sigmas = _shared_energy(sums, counts)
    return ResidualField(
        (np.arange(columns) + 0.5) * size[0] / columns - 0.5,
        (np.arange(rows) + 0.5) * size[1] / rows - 0.5,
        means,
        np.where(there > 1, errors, np.nan),
        total,
        float(np.sqrt(max(energy, 0.0))),
        sigmas > _SIGMAS,
        _neighbour_correlation(lens),
    )


def _shared_energy(sums: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    """Return the mean square [px^2] of what different views have in common in the same cells, and in how many sigmas it shows.

    Products of residuals of two views have a mean of zero if the views share nothing, whatever a view's own errors have in
    common; their squares then give the variance of the sum.

    Args:
        sums: (v, r, c, 2) of residuals in each cell.
        counts: (v, r, c) of corners there.
    """
    flat, weights = sums.reshape(len(sums), -1), counts.reshape(len(counts), -1)
    upper = np.triu_indices(len(sums), 1)
    products, pairs = (flat @ flat.T)[upper], (weights @ weights.T)[upper]
    if not pairs.any():
        return 0.0, 0.0
    return float(products.sum() / pairs.sum()), float(products.sum() / max(np.sqrt(np.square(products).sum()), 1e-300))


def _neighbour_correlation(lens: CalibratedLens) -> float:
    """Return the correlation of the residuals of corners that are next to each other on the board, within views."""
    products, squares = 0.0, 0.0
    for view in lens.views:
        places_m = lens.board.corners_m[view.corners.corner_ids[view.used]]
        apart_m = np.linalg.norm(places_m[:, None] - places_m, axis=2)
        first, second = np.nonzero(np.triu(apart_m < 1.01 * lens.board.square_m, 1))
        residuals = view.residuals_px[view.used]
        products += float((residuals[first] * residuals[second]).sum())
        squares += 0.5 * float((np.square(residuals[first]) + np.square(residuals[second])).sum())
    return products / squares if squares > 0.0 else 0.0


MODEL_ERRORS_UNSEEN = (
    "The projection uncertainty follows from the scatter of the corners. It cannot see what the lens model itself gets wrong, "
    "which may be larger; calibrating halves of the views separately shows some of that."
)

_COLUMNS_OF_POINTS, _ROWS_OF_POINTS = 32, 20


@dataclass(frozen=True, slots=True, eq=False)
class ImageGrid:
    """Standard deviations over the image.

    Attributes:
        x_px: (c,) columns of the grid.
        y_px: (r,) its rows.
        sigma_px: (r, c) in the direction in which it is largest; NaN where the lens sees nothing.
    """

    x_px: Values
    y_px: Values
    sigma_px: Grid

    def __post_init__(self) -> None:
        freeze(self, x_px=(None,), y_px=(None,), sigma_px=(len(self.y_px), len(self.x_px)))


def projection_uncertainty(
    lens: CalibratedLens, columns: int = _COLUMNS_OF_POINTS, rows: int = _ROWS_OF_POINTS
) -> ImageGrid:
    """Return how far the pixel of a fixed, far point is uncertain.

    Other intrinsics would have given the views other poses, so that a change of all pixels which a rotation of the camera
    undoes is no uncertainty of the lens: it is taken out, as it appears where corners were found.

    Args:
        lens: with the covariance of its camera.
        columns: of the grid.
        rows: of the grid.
    """
    x_px, y_px, places = image_grid(lens.camera, columns, rows)
    covariance = lens.camera.covariance
    matrix = np.zeros((len(lens.camera.parameters),) * 2) if covariance is None else covariance.matrix
    spread = grid_covariance(lens.camera, matrix, places, found_pixels(lens))
    return ImageGrid(x_px, y_px, np.sqrt(np.maximum(larger_eigenvalues(spread), 0.0)).reshape(rows, columns))


def image_grid(camera: Camera, columns: int, rows: int) -> tuple[Values, Values, Points2]:
    """Return columns, rows and pixels (rows * columns, 2) of a grid over the whole image [px]."""
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
