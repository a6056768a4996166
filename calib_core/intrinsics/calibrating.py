"""Calibrate a lens from views of a board (Zhang's method), and say in warnings what a person must know about it."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from calib_core.arrays import Points3, Values
from calib_core.camera import Camera, CameraCovariance
from calib_core.intrinsics.adjustment import SharedCovariance, reduced, shared_covariance, start, typical_sigma
from calib_core.intrinsics.bad_views import JudgedViews, judge_views
from calib_core.intrinsics.board_images import BoardCorners, LeftOutImage
from calib_core.intrinsics.board_shape import RowSkew, ShapeTest, row_skew, try_shapes
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView
from calib_core.intrinsics.coverage import BoardSearch
from calib_core.intrinsics.linearization import (
    FLAT,
    STRETCH,
    BoardWarp,
    LensState,
    ViewStack,
    linearize,
    possible_warps,
    residuals_of,
    stack_views,
)
from calib_core.intrinsics.model_choice import (
    MODELS,
    ChosenModel,
    LensFit,
    choose_model,
    fit_model,
    folds_back,
    held_out_squares,
    image_places,
    view_folds,
)
from calib_core.measurements import Unsolvable
from calib_core.options import LensChoice
from calib_core.results import DataWarning

_LEAST_VIEWS = 3
_LEAST_CORNERS = 6
_LINE_SHARE = 0.01
_UNKNOWN_FOCAL = 0.15
_PARALLEL_DEG = 20.0
_SAME_DEG = 4.0
_AS_GOOD = 1.3
_SHAPE_SHARE = 0.5  # all would cover a bend that stays just unseen twice; none would cover it in 9 of 10 cases


@dataclass(frozen=True, slots=True, eq=False)
class _Used:
    """The views that are used, and what the board is."""

    views: tuple[BoardCorners, ...]
    stack: ViewStack
    board_m: Points3
    model: LensChoice
    left_out: tuple[LeftOutImage, ...]
    starts: Mapping[str, LensState]

    def choose(self, warp: BoardWarp) -> ChosenModel | str:
        """Choose a lens model for the board with a shape."""
        models = MODELS if self.model == "auto" else (self.model,)
        return choose_model(
            models,
            self.stack,
            lambda model: fit_model(model, self.stack, warp=warp, near=self.starts.get(model)),
        )


def calibrate_lens(
    search: BoardSearch,
    model: LensChoice = "auto",
    *,
    progress: Callable[[str], None] | None = None,
    stopped: Callable[[], bool] | None = None,
) -> CalibratedLens | Unsolvable:
    """Calibrate a lens from the views that a search has chosen.

    Args:
        search: with the views.
        model: of the lens.
        progress: called with what is done next.
        stopped: asked between the parts; once it is true there is no calibration.
    """
    steps = _steps(search, model)
    while True:
        try:
            step = next(steps)
        except StopIteration as done:
            return done.value
        if progress is not None:
            progress(step)
        if stopped is not None and stopped():
            return Unsolvable("stopped")


def _steps(search: BoardSearch, model: LensChoice) -> Generator[str, None, CalibratedLens | Unsolvable]:
    """Calibrate in steps; what each of them does is yielded before it."""
    yield "comparing the views"
    used = _views_to_use(search, model)
    if isinstance(used, Unsolvable):
        return used
    yield "choosing a lens model"
    chosen = used.choose(FLAT)
    if isinstance(chosen, str):
        return Unsolvable("no-lens", {"views": len(used.views), "why": chosen, "model": model})
    yield "looking at the shape of the board"
    shape = try_shapes(chosen.fit, used.stack, possible_warps(used.board_m))
    modelled = False
    if len(shape.found):
        warped = used.choose(shape.found)
        if isinstance(warped, ChosenModel):
            chosen, modelled = warped, True
    yield "leaving out one view after the other"
    return _calibrated(search, used, chosen, shape, modelled=modelled)


def _views_to_use(search: BoardSearch, model: LensChoice) -> _Used | Unsolvable:
    """Find the views to use; too few are no calibration."""
    board_m = search.board.corners_m
    faults = [_fault(view, board_m, search.size_px) for view in search.views]
    views = [view for view, fault in zip(search.views, faults, strict=True) if not fault]
    left_out = [
        LeftOutImage(view.index, view.name, fault) for view, fault in zip(search.views, faults, strict=True) if fault
    ]
    if len(views) < _LEAST_VIEWS:
        return _too_few(len(views), left_out)
    stack = stack_views(views, board_m, search.size_px)
    models = MODELS[1:] if model == "auto" else (model,)
    # each fitted robustly to all views, those that are wrong included
    states = [state for one in models if (state := start(one, stack)) is not None]
    if not states:
        return Unsolvable("no-lens", {"views": len(views), "why": "no focal length explains them", "model": model})
    judged = _judge_by_best_lens(views, stack, states, may_be_mirrored=search.board.kind == "checkerboard")
    reasons = zip(views, judged.reasons, strict=True)
    left_out += [LeftOutImage(view.index, view.name, reason) for view, reason in reasons if reason]
    views = [view for view, reason in zip(views, judged.reasons, strict=True) if not reason]
    if len(views) < _LEAST_VIEWS:
        return _too_few(len(views), left_out)
    stack = judged.stack.of(judged.kept)
    starts = {state.camera.model: state.of(judged.kept) for state in states}
    every = sorted((*search.left_out, *left_out), key=lambda image: image.index)
    return _Used(tuple(views), stack, board_m, model, tuple(every), starts)


def _fault(view: BoardCorners, board_m: Points3, size_px: tuple[int, int]) -> str:
    """Say why a view cannot be posed at all; nothing if it can."""
    if view.size_px != size_px:
        return f"it has {view.size_px[0]} x {view.size_px[1]} pixels, not {size_px[0]} x {size_px[1]}"
    if len(view.corner_ids) < _LEAST_CORNERS:
        return f"only {len(view.corner_ids)} corners of the board; a view needs {_LEAST_CORNERS}"
    if not np.isfinite(view.pixels_px).all():
        return "some of its corners are nowhere"
    for places, where in ((board_m[view.corner_ids, :2], "of the board"), (view.pixels_px, "in the image")):
        spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
        if spread[1] <= _LINE_SHARE * spread[0]:
            return f"its corners are on one line {where}"
    return ""


def _too_few(count: int, left_out: Sequence[LeftOutImage]) -> Unsolvable:
    return Unsolvable("few-views", {"views": count, "needed": _LEAST_VIEWS, "left_out": tuple(left_out)})


def _judge_by_best_lens(
    views: Sequence[BoardCorners], stack: ViewStack, states: Sequence[LensState], *, may_be_mirrored: bool
) -> JudgedViews:
    """Judge the views by the lens that most corners fit: a lens that is too simple makes good views look bad."""
    sigmas = [typical_sigma(residuals_of(state, stack), stack) for state in states]
    fitting = [state for state, sigma in zip(states, sigmas, strict=True) if sigma <= _AS_GOOD * min(sigmas)]
    judged = (judge_views(views, stack, state, may_be_mirrored=may_be_mirrored) for state in fitting)
    return max(judged, key=lambda one: int(one.stack.corner_counts.sum()))


def _calibrated(
    search: BoardSearch, used: _Used, chosen: ChosenModel, shape: ShapeTest, *, modelled: bool
) -> CalibratedLens | Unsolvable:
    """Put the result together."""
    fit, stack = chosen.fit, used.stack
    covariance = shared_covariance(reduced(linearize(fit.state, stack, fit.freedom)))
    camera = _with_covariance(fit, covariance, np.zeros(0) if modelled else shape.lens_change)
    if unknown := _unknown_focal(camera, fit):
        return unknown
    counts = stack.corner_counts
    held_out = held_out_squares(fit.state, stack, fit.freedom, view_folds(len(stack), len(stack)))
    rms_px = float(np.sqrt(np.average(fit.mean_squares, weights=counts)))
    amounts, sigmas = fit.state.amounts, np.sqrt(np.diag(covariance.matrix)[fit.freedom.lens.shape[1] :])
    if not modelled:
        among = [name in shape.found.names for name in possible_warps(used.board_m).names]
        amounts, sigmas = shape.amounts[among], shape.sigmas[among]
    said = (
        *shape_warnings(shape, amounts, sigmas, modelled=modelled),
        *skew_warnings(row_skew(fit, stack)),
        *lens_warnings(camera, stack, rms_px),
    )
    return CalibratedLens(
        camera,
        search.board,
        fit.freedom.warp.shape_m(used.board_m, fit.state.amounts),
        _lens_views(used, fit, held_out),
        used.left_out,
        rms_px,
        float(np.sqrt(np.average(held_out, weights=counts))),
        chosen.trials,
        chosen.choice,
        said,
    )


def _with_covariance(fit: LensFit, shared: SharedCovariance, change: Values) -> Camera:
    """Return the camera with the covariance of its parameters.

    Args:
        fit: of the lens.
        shared: covariance of lens and warp.
        change: (p,) how a shape of the board that the views cannot exclude would change the parameters; or empty.
    """
    count = fit.freedom.lens.shape[1]
    lens = fit.freedom.lens
    matrix = lens @ shared.matrix[:count, :count] @ lens.T
    if len(change):
        matrix = matrix + _SHAPE_SHARE * np.outer(change, change)
    camera = fit.state.camera
    return camera.with_parameters(
        camera.parameters, CameraCovariance(camera.parameter_names, (matrix + matrix.T) / 2.0)
    )


def _unknown_focal(camera: Camera, fit: LensFit) -> Unsolvable | None:
    """Say that the views leave the focal length open; None if they do not."""
    normals = fit.state.rotations[:, :, 2]
    apart_deg = np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1.0, 1.0)))
    sigma = worst_focal_sigma(camera)
    known = {"focal_px": float(camera.matrix_px[0, 0]), "sigma": sigma}
    if apart_deg < _SAME_DEG or (sigma > _UNKNOWN_FOCAL and apart_deg < _PARALLEL_DEG):
        return Unsolvable("parallel-views", {**known, "turned_deg": float(apart_deg)})
    if sigma > _UNKNOWN_FOCAL:
        rms_px = float(np.sqrt(fit.mean_squares.mean()))
        return Unsolvable("unknown-focal-length", {**known, "rms_px": rms_px, "model": camera.model})
    return None


def _lens_views(used: _Used, fit: LensFit, held_out: Values) -> tuple[LensView, ...]:
    """Return each view as the camera explains it."""
    residuals = residuals_of(fit.state, used.stack, fit.freedom.warp)
    views = []
    for row, view in enumerate(used.views):
        count = len(view.corner_ids)
        views.append(
            LensView(
                view,
                fit.state.pose(row),
                residuals[row, :, :count].T,
                used.stack.weights[row, :count] > 0,
                float(np.sqrt(fit.mean_squares[row])),
                float(np.sqrt(held_out[row])),
            )
        )
    return tuple(views)


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
    yield from _view_warnings(camera, stack)
    yield from _number_warnings(camera, rms_px)
    outside = folds_back(camera, image_places(stack.size_px))
    if outside.any() and camera.lens.is_perspective:
        yield DataWarning("lens-folds-back", {"share": float(outside.mean())})


def _view_warnings(camera: Camera, stack: ViewStack) -> Iterator[DataWarning]:
    found = np.moveaxis(stack.pixels_px, 1, 2)[stack.weights > 0]
    hull = cv2.convexHull(found.astype(np.float32))
    covered = float(cv2.contourArea(hull) / (stack.size_px[0] * stack.size_px[1]))
    if covered < _LEAST_COVERED:
        yield DataWarning("little-covered", {"share": covered})
    if len(stack) < _FEW_VIEWS:
        yield DataWarning("few-views", {"views": len(stack)})
    sigma = worst_focal_sigma(camera)
    if sigma > _FOCAL_SIGMA:
        yield DataWarning("weak-focal-length", {"sigma": sigma})


def _number_warnings(camera: Camera, rms_px: float) -> Iterator[DataWarning]:
    fx, fy, cx, cy = camera.parameters[:4].tolist()
    off = np.abs([cx / (camera.width_px - 1) - 0.5, cy / (camera.height_px - 1) - 0.5])
    if off.max() > _FAR_PRINCIPAL_POINT:
        middle_px = ((camera.width_px - 1) / 2, (camera.height_px - 1) / 2)
        yield DataWarning("principal-point-far", {"point_px": (cx, cy), "middle_px": middle_px})
    if abs(fx / fy - 1.0) > _UNEQUAL_FOCAL_LENGTHS:
        yield DataWarning("unequal-focal-lengths", {"fx_px": fx, "fy_px": fy})
    if rms_px > _LARGE_RMS_PX:
        yield DataWarning("large-residuals", {"rms_px": rms_px})


def shape_warnings(test: ShapeTest, amounts: Values, sigmas: Values, *, modelled: bool) -> Iterator[DataWarning]:
    """Say how the board is bent or stretched.

    Args:
        test: of the board's shape.
        amounts: (s,) of the warps that were found.
        sigmas: (s,) of the same.
        modeled: whether the lens was calibrated with the board's shape as found.
    """
    shapes = dict(zip(test.found.names, zip(amounts.tolist(), sigmas.tolist(), strict=True), strict=True))
    stretched = shapes.pop(STRETCH, None)
    bends_mm = {name: (1e3 * bend, 1e3 * sigma) for name, (bend, sigma) in shapes.items() if abs(bend) > 2.0 * sigma}
    if bends_mm:
        yield DataWarning("bent-board", {"bends_mm": bends_mm, "modelled": modelled})
    if stretched is not None:
        stretch, sigma = stretched
        yield DataWarning("unequal-squares", {"stretch": stretch, "sigma": sigma, "modelled": modelled})


def skew_warnings(skew: RowSkew) -> Iterator[DataWarning]:
    """Say that views are skewed as by motion under a rolling shutter."""
    if skew.shows:
        yield DataWarning("skewed-views", {"skew_px": float(np.median(skew.skews_px)), "share": skew.share})
