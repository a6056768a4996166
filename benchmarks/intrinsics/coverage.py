"""Whether the stated sigmas hold: Monte Carlo with corners instead of images."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.boards import BoardFilm, true_corners
from benchmarks.intrinsics.draws import CHECKERBOARD, LENSES, Images, Series, drawn_camera, moved
from benchmarks.intrinsics.rendered import scaled_errors
from benchmarks.intrinsics.tables import Table
from calib_core.arrays import Points2
from calib_core.camera import Camera, CameraModel
from calib_core.intrinsics.board_images import BoardCorners
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch
from calib_core.intrinsics.image_maps import far_point_slopes, found_pixels, grid_covariance
from calib_core.synthetic.boards import waved_poses

__all__ = ["CASES", "Case", "coverage", "drawn_search", "sigma_table"]

_CHI2_95 = 5.991
"""With two degrees of freedom."""
_SHARED_OVER = 0.3
"""Distance over which neighbours share an error, as a share of the board's diagonal in the image."""
_GROSS_PX = 10.0


@dataclass(frozen=True, slots=True)
class CornerErrors:
    """How found corners differ from the true ones.

    Attributes:
        sigma_px: standard deviation of independent errors, per axis.
        shared_px: standard deviation of errors that neighbouring corners of a view share, per axis.
        gross_share: share of the corners with a gross error.
    """

    sigma_px: float = 0.1
    shared_px: float = 0.0
    gross_share: float = 0.0

    def drawn(self, rng: np.random.Generator, pixels_px: Points2) -> Points2:
        """Draw the errors of corners (n, 2)."""
        drawn = self.sigma_px * rng.standard_normal(pixels_px.shape)
        if self.shared_px:
            apart = np.linalg.norm(pixels_px[:, None] - pixels_px[None], axis=2)
            reach = _SHARED_OVER * float(np.linalg.norm(np.ptp(pixels_px, axis=0)))
            values, vectors = np.linalg.eigh(np.exp(-0.5 * (apart / reach) ** 2))
            mixed = vectors * np.sqrt(np.maximum(values, 0.0))
            drawn += self.shared_px * mixed @ rng.standard_normal(pixels_px.shape)
        gross = rng.uniform(size=len(pixels_px)) < self.gross_share
        drawn[gross] += _GROSS_PX * rng.standard_normal((int(gross.sum()), 2))
        return drawn


_INDEPENDENT, _IDEAL = CornerErrors(), BoardFilm()


@dataclass(frozen=True, slots=True)
class Case:
    """How the corners of a row are drawn."""

    errors: CornerErrors = _INDEPENDENT
    film: BoardFilm = _IDEAL
    chosen: bool = False
    """Whether the lens model is chosen; otherwise it is told."""


CASES = {
    "independent 0.1 px": Case(),
    "independent 0.1 px, model chosen": Case(chosen=True),
    "and 0.05 px shared by neighbors": Case(CornerErrors(shared_px=0.05)),
    "and 0.5 % gross errors": Case(CornerErrors(gross_share=0.005)),
    "bent by 1.5 mm": Case(film=BoardFilm(bend_m=(0.0015, 0.0007))),
    "rolling shutter of 20 ms": Case(film=BoardFilm(rolling_shutter_s=0.02)),
}


def drawn_search(seed: Sequence[int], model: CameraModel, case: Case, views: int = 20) -> tuple[Series, BoardSearch]:
    """Draw the corners of a board in several views."""
    rng = np.random.default_rng(list(seed))
    camera = drawn_camera(rng, model)
    poses = waved_poses(rng, CHECKERBOARD, camera, views)
    size_px = camera.width_px, camera.height_px
    found = []
    for index, pose in enumerate(poses):
        pixels = true_corners(CHECKERBOARD, camera, pose, moved(rng, case.film))
        pixels = pixels + case.errors.drawn(rng, pixels)
        ids = np.flatnonzero(camera.in_image(pixels))
        found.append(BoardCorners(index, f"view {index + 1}", None, size_px, ids, pixels[ids]))
    search = BoardSearch(CHECKERBOARD, size_px, tuple(found), (), views)
    return Series(camera, CHECKERBOARD, Images((), ()), ()), search


def coverage(first: int, draws: int, lens: CameraModel, case: Case, number: int) -> tuple[str, ...]:
    """Return the cells of a row: the share of the errors within 1.96 sigma, by parameter."""
    rows, focal, projected = [], [], []
    for i in range(draws):
        series, search = drawn_search([first + i, 50, number], lens, case)
        found = calibrate_lens(search, "auto" if case.chosen else lens)  # type: ignore[arg-type]
        if not isinstance(found, CalibratedLens):
            continue
        focal.append(100.0 * abs(found.camera.matrix_px[0, 0] / series.camera.matrix_px[0, 0] - 1.0))
        projected.append(_projected_within(found, series.camera))
        if scaled := scaled_errors(found, series):
            rows.append(scaled)
    seen = f"{np.mean(projected):.1%}" if projected else "-"
    if not rows:
        return str(draws), "0", f"{np.median(focal):.3f}" if focal else "-", "-", "-", "-", "-", seen
    within = np.abs(np.array(rows)) < 1.96
    names = series.camera.parameter_names[: within.shape[1]]
    low, high = int(within.mean(axis=0).argmin()), int(within.mean(axis=0).argmax())
    spread = np.sqrt(0.95 * 0.05 / within.shape[0])
    return (
        str(draws),
        str(len(rows)),
        f"{np.median(focal):.3f}",
        f"{within.mean():.1%}",
        f"{within[:, low].mean():.1%} ({names[low]})",
        f"{within[:, high].mean():.1%} ({names[high]})",
        f"{spread:.1%}",
        seen,
    )


def _projected_within(lens: CalibratedLens, true: Camera) -> float:
    """Return the share of places of the image where the projection of a far point is within its 95 % ellipse."""
    camera, found = lens.camera, found_pixels(lens)
    u, v = np.meshgrid(*(np.linspace(0.25, 0.75, 3) * size for size in (camera.width_px, camera.height_px)))
    places = np.stack([u.ravel(), v.ravel()], axis=1)
    assert camera.covariance is not None
    spread = grid_covariance(camera, camera.covariance.matrix, places, found)
    wrong, turned = (camera.project(true.rays(pixels)) - pixels for pixels in (places, found))
    _, turns = far_point_slopes(camera, found)
    _, turns_there = far_point_slopes(camera, places)
    wrong = wrong - turns_there @ np.linalg.lstsq(turns.reshape(-1, 3), turned.ravel(), rcond=None)[0]
    return float(np.mean(np.einsum("ni,ni->n", wrong, np.linalg.solve(spread, wrong[..., None])[..., 0]) < _CHI2_95))


def sigma_table(first: int, draws: int, corners: str | None = None) -> Table:
    """Measure how often the truth is within 1.96 stated sigmas, with all kinds of drawn corners or with one."""
    cells = tuple(
        (f"{lens}, {name}", *coverage(first, draws, lens, case, 10 * row + number))
        for number, lens in enumerate(LENSES)
        for row, (name, case) in enumerate(CASES.items())
        if corners in (None, name)
    )
    head = (
        "lens, corners",
        "draws",
        "with the true model",
        "focal error, median [%]",
        "within 1.96 sigma, all parameters",
    )
    head = (*head, "worst parameter", "best parameter", "standard error of one", "projection within its 95 % ellipse")
    note = (
        "Corners without images: 20 views, another lens, other poses and other errors in each draw. The aim is 93 to 97 % "
        "for each parameter; a right sigma gives 95 %. The model is told except where the row says that it is chosen. The last "
        "column looks at nine places in the inner half of the image; the coefficients of a rational lens compensate each "
        "other, so that its projection is known where they are not."
    )
    return Table("Stated sigmas", head, cells, note)
