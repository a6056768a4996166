"""Lenses calibrated from rendered images: how far off corners and focal length are, and which model is chosen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.intrinsics.draws import BOARDS, FILMS, LENSES, Series, drawn_series
from benchmarks.intrinsics.tables import Table
from calib_core.intrinsics.board_search import search_boards
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch

__all__ = ["Rendered", "boards", "films", "measured"]

_HEAD = (
    "draws",
    "views used",
    "image covered",
    "corner error, rms per axis [px]",
    "95 % below [px]",
    "focal error, median [%]",
    "worst [%]",
    "within 1.96 sigma",
    "model chosen",
)


@dataclass(frozen=True, slots=True)
class Rendered:
    """What one series of images gives.

    Attributes:
        views: that were used; 0 if there is no calibration.
        covered: share of the image in the hull of all corners.
        errors_px: of all corners found, per axis, against the truth.
        focal_error: estimated over true focal length, less 1.
        scaled: errors of the parameters over their stated sigma, if the model is the true one.
        model: that was chosen, or the code of why there is none.
    """

    views: int
    covered: float
    errors_px: tuple[float, ...]
    focal_error: float
    scaled: tuple[float, ...]
    model: str


def measured(series: Series) -> Rendered:
    """Search and calibrate one series of images."""
    search = search_boards(series.images, series.board)
    if not isinstance(search, BoardSearch):
        return Rendered(0, 0.0, (), float("nan"), (), search.code)
    errors, found = [], []
    for view in search.views:
        true = series.corners_px[view.index]
        apart = np.linalg.norm(view.pixels_px[:, None] - true[None], axis=2)
        errors.append(view.pixels_px - true[apart.argmin(axis=1)])
        found.append(view.pixels_px)
    wrong = tuple(np.concatenate(errors).ravel().tolist())
    covered = _hull_share(np.concatenate(found), series)
    lens = calibrate_lens(search)
    if not isinstance(lens, CalibratedLens):
        return Rendered(0, covered, wrong, float("nan"), (), lens.code)
    focal = float(lens.camera.matrix_px[0, 0] / series.camera.matrix_px[0, 0] - 1.0)
    return Rendered(len(lens.views), covered, wrong, focal, scaled_errors(lens, series), lens.camera.model)


def scaled_errors(lens: CalibratedLens, series: Series) -> tuple[float, ...]:
    """Return the errors of the parameters over their sigma; none if the model is another one than the true one."""
    camera = lens.camera
    if camera.model != series.camera.model or camera.covariance is None:
        return ()
    true = dict(zip(series.camera.parameter_names, series.camera.parameters.tolist(), strict=True))
    found = dict(zip(camera.parameter_names, camera.parameters.tolist(), strict=True))
    sigma = {name: camera.covariance.sigma(name) for name in found}
    return tuple((found[name] - true.get(name, 0.0)) / sigma[name] for name in found if sigma[name] > 0.0)


def _hull_share(pixels: np.ndarray, series: Series) -> float:
    import cv2

    hull = cv2.convexHull(pixels.astype(np.float32))
    return float(cv2.contourArea(hull)) / (series.camera.width_px * series.camera.height_px)


def films(first: int, draws: int) -> Table:
    """Measure every lens in every way of filming."""
    rows = [
        (
            f"{lens}, {name}",
            _cells([measured(drawn_series([first + i, number, row], lens, film)) for i in range(draws)]),
        )
        for number, lens in enumerate(LENSES)
        for row, (name, film) in enumerate(FILMS.items())
    ]
    return Table("Rendered boards", ("lens, film", *_HEAD), tuple((name, *cells) for name, cells in rows))


def boards(first: int, draws: int) -> Table:
    """Measure every kind of board, through one lens, blurred and noisy."""
    film = FILMS["blur and noise"]
    rows = [
        (
            name,
            *_cells(
                [measured(drawn_series([first + i, 9, row], "plumb_bob", film, board=board)) for i in range(draws)]
            ),
        )
        for row, (name, board) in enumerate(BOARDS.items())
    ]
    return Table("Kinds of boards", ("board", *_HEAD), tuple(rows))


def _cells(results: Sequence[Rendered]) -> tuple[str, ...]:
    errors = np.concatenate([np.array(one.errors_px) for one in results])
    focal = 100.0 * np.abs([one.focal_error for one in results])
    scaled = np.concatenate([np.array(one.scaled) for one in results])
    within = f"{np.mean(np.abs(scaled) < 1.96):.0%} of {len(scaled)}" if len(scaled) else "-"
    models = [one.model for one in results]
    named = ", ".join(f"{model} {models.count(model)}" for model in dict.fromkeys(models))
    return (
        str(len(results)),
        f"{np.mean([one.views for one in results]):.1f}",
        f"{np.mean([one.covered for one in results]):.0%}",
        f"{np.sqrt(np.mean(np.square(errors))):.3f}" if len(errors) else "-",
        f"{np.quantile(np.abs(errors), 0.95):.3f}" if len(errors) else "-",
        f"{np.median(focal):.3f}",
        f"{np.max(focal):.3f}",
        within,
        named,
    )
