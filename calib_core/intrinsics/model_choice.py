"""Fit lens models to the same views, and choose the simplest that predicts left-out views as well as any.

A model whose distortion folds back, so that two directions share a pixel, is not chosen.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Values
from calib_core.camera import Camera
from calib_core.intrinsics.adjustment import adjust, start, weighted_cost
from calib_core.intrinsics.calibrated_lens import ModelTrial
from calib_core.intrinsics.linearization import FLAT, BoardWarp, Freedom, LensState, ViewStack, residuals_of, warped

MODELS = ("pinhole", "plumb_bob", "equidistant", "rational_polynomial")
"""From the simplest to the most flexible."""

_WORDS = {
    "pinhole": "pinhole without distortion",
    "plumb_bob": "plumb_bob (5 coefficients)",
    "equidistant": "equidistant (fisheye, 4 coefficients)",
    "rational_polynomial": "rational_polynomial (8 coefficients)",
}
_FOLDS = 10
_LEAST_GAIN = 0.02  # of the squared distance


@dataclass(frozen=True, slots=True, eq=False)
class LensFit:
    """A lens model fitted to views.

    Attributes:
        state: lens, poses and shape of the board.
        freedom: what was estimated besides the poses.
        mean_squares: (v,) mean squared residual of each view [px^2].
    """

    state: LensState
    freedom: Freedom
    mean_squares: Values

    @property
    def model(self) -> str:
        """The lens model's name."""
        return self.state.camera.model


@dataclass(frozen=True, slots=True, eq=False)
class ChosenModel:
    """The lens model to use, and those it was compared with."""

    fit: LensFit
    trials: tuple[ModelTrial, ...]
    choice: str


def fit_model(model: str, stack: ViewStack, *, warp: BoardWarp = FLAT, near: LensState | None = None) -> LensFit | str:
    """Fit a lens model by least squares; a sentence if that is not possible.

    Args:
        model: its name.
        stack: the views.
        warp: how the board may be warped.
        near: a fit of the same model to start from.
    """
    first = near if near is not None else start(model, stack)
    if first is None:
        return "no focal length explains the views"
    freedom = Freedom.of(first.camera, warp=warp)
    if not np.isfinite(weighted_cost(residuals_of(first, stack, warp if len(first.amounts) else FLAT), stack)):
        return "it cannot have seen all corners"
    state = adjust(first, stack, freedom)
    fault = folds_where_seen(state.camera, stack)
    return fault or LensFit(state, freedom, stack.mean_square(residuals_of(state, stack, warp)))


def choose_model(
    models: Sequence[str],
    stack: ViewStack,
    fit: Callable[[str], LensFit | str],
) -> ChosenModel | str:
    """Choose a lens model by its error in views that it was not calibrated with.

    Args:
        models: to choose from, the simplest first.
        stack: the views.
        fit: returns the fit of a model, or why there is none.

    Returns:
        The choice; if no model fits, why not.
    """
    fits = {model: fit(model) for model in models}
    folds = view_folds(len(stack), _FOLDS)
    squares = {
        model: held_out_squares(one.state, stack, one.freedom, folds)
        for model, one in fits.items()
        if isinstance(one, LensFit)
    }
    squares = {model: values for model, values in squares.items() if np.isfinite(values).all()}
    if not squares:
        return "; ".join(f"{model}: {one}" for model, one in fits.items() if isinstance(one, str)) or "no model fits"
    chosen = _simplest(squares)
    trials = tuple(_trial(model, fits[model], stack, squares, chosen) for model in models)
    best = fits[chosen]
    assert isinstance(best, LensFit)
    return ChosenModel(best, trials, _sentence(chosen, trials))


def _simplest(squares: dict[str, Values]) -> str:
    """Return the simplest model that no more flexible one beats by more than the standard error and by 1 % of the distance.

    One that is better in every view is taken too.
    """
    names = list(squares)
    chosen = names[0]
    for other in names[1:]:
        gain, error = _paired(squares[chosen], squares[other])
        always = bool(
            (squares[chosen] > squares[other]).all()
        )  # a few views with very different gains have a large error
        if gain > _LEAST_GAIN * float(squares[chosen].mean()) and (gain > error or always):
            chosen = other
    return chosen


def _paired(first: Values, second: Values) -> tuple[float, float]:
    """Return the mean of first minus second over views, and its standard error."""
    apart = first - second
    return float(apart.mean()), float(apart.std(ddof=1) / np.sqrt(len(apart)))


def _trial(model: str, fit: LensFit | str, stack: ViewStack, squares: dict[str, Values], chosen: str) -> ModelTrial:
    """Say how a model compares with the chosen one."""
    if isinstance(fit, str):
        return ModelTrial(model, float("nan"), float("nan"), fault=fit)
    counts = stack.corner_counts
    rms = float(np.sqrt(np.average(fit.mean_squares, weights=counts)))
    if model not in squares:
        return ModelTrial(model, rms, float("nan"), fault="it cannot see all corners if some views are left out")
    held_out = float(np.sqrt(np.average(squares[model], weights=counts)))
    worse, error = (0.0, 0.0) if model == chosen else _paired(squares[model], squares[chosen])
    return ModelTrial(model, rms, held_out, worse, error)


def _sentence(chosen: str, trials: Sequence[ModelTrial]) -> str:
    """Say in one sentence which model was chosen and why."""
    tried = {trial.model: trial for trial in trials if not trial.fault}
    names = list(tried)
    said = f"{_WORDS[chosen]}: "
    if len(names) == 1:
        faults = "; ".join(f"{trial.model}: {trial.fault}" for trial in trials if trial.fault)
        return said + (f"the only one that fits ({faults})" if faults else "as told")
    own = tried[chosen]
    simpler = [tried[name] for name in names[: names.index(chosen)]]
    flexible = [tried[name] for name in names[names.index(chosen) + 1 :]]
    parts = []
    if simpler:
        best = min(simpler, key=lambda trial: trial.held_out_rms_px)
        parts.append(
            f"it predicts left-out views to {own.held_out_rms_px:.3f} px, {best.model} to {best.held_out_rms_px:.3f} px"
        )
    if flexible:
        best = min(flexible, key=lambda trial: trial.held_out_rms_px)
        how = (
            "does not predict them better"
            if best.worse_by >= 0
            else "is not better by more than the standard error and 1 %"
        )
        begin = "and " if simpler else f"it predicts left-out views to {own.held_out_rms_px:.3f} px, and "
        parts.append(f"{begin}{best.model} {how} ({best.held_out_rms_px:.3f} px)")
    return said + ", ".join(parts)


_REFIT_STEPS = 4  # from the fit with all views
_POSE_STEPS = 6


def view_folds(views: int, most: int) -> Indices:
    """Return the number of the fold of each view: as equal as possible, neighbors in time together."""
    return np.arange(views) * min(views, most) // views


def held_out_squares(state: LensState, stack: ViewStack, freedom: Freedom, folds: Indices) -> Values:
    """Return the mean squared residual (v,) [px^2] of each view, with the lens of all other folds.

    The lens and the shape of the board come from the other folds; the pose of a left-out view is fitted to its own corners.

    Args:
        state: the fit to all views.
        stack: the views.
        freedom: what the fit may change besides the poses.
        folds: (v,) the number of each view's fold.
    """
    squares = np.full(len(stack), np.nan)
    for fold in range(int(folds.max()) + 1):
        out = folds == fold
        others = adjust(state.of(~out), stack.of(~out), freedom, steps=_REFIT_STEPS)
        left = warped(stack.of(out), freedom.warp, others.amounts)
        start = LensState(others.camera, state.rotations[out], state.translations_m[out])
        with np.errstate(all="ignore"):
            posed = adjust(start, left, Freedom.none(others.camera), steps=_POSE_STEPS)
        squares[out] = left.mean_square(residuals_of(posed, left))
    return squares


_PLACES = 24


def image_places(size_px: tuple[int, int], columns: int = _PLACES, rows: int = _PLACES) -> Points2:
    """Return places all over an image, its edges included: (rows * columns, 2) [px]."""
    x, y = np.meshgrid(np.linspace(0, size_px[0] - 1, columns), np.linspace(0, size_px[1] - 1, rows))
    return np.stack([x.ravel(), y.ravel()], axis=1)


def folds_back(camera: Camera, pixels_px: Points2) -> Flags:
    """Return at which pixels (n, 2) the lens has no ray, or one along which the image runs backwards."""
    rays = camera.rays(pixels_px)
    wrong = ~np.isfinite(rays).all(axis=1)
    with np.errstate(all="ignore"):
        slopes = camera.project_with_jacobian(np.where(wrong[:, None], [0.0, 0.0, 1.0], rays))[1]
        turned = np.linalg.det(np.concatenate([slopes, rays[:, None, :]], axis=1))
    return np.asarray(wrong | ~(turned > 0))


def folds_where_seen(camera: Camera, stack: ViewStack) -> str:
    """Say if the distortion folds back within the circle about the principal point that the corners reach; "" if not."""
    found = np.moveaxis(stack.pixels_px, 1, 2)[stack.weights > 0]
    middle = camera.matrix_px[:2, 2]
    places = image_places(stack.size_px)
    reach = np.linalg.norm(found - middle, axis=1).max()
    inside = places[np.linalg.norm(places - middle, axis=1) <= reach]
    if not len(inside):
        return "its principal point is outside the image"
    if folds_back(camera, inside).any():
        return "its distortion folds back where corners were found"
    return ""
