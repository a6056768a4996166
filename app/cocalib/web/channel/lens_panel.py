"""What the tab Lens shows of a camera and of a calibrated lens: pure functions from values to messages."""

import numpy as np

from calib_core.camera import Camera
from calib_core.intrinsics import (
    MODEL_ERRORS_UNSEEN,
    CalibratedLens,
    LensView,
    ModelTrial,
    projection_uncertainty,
    residual_field,
)
from cocalib.intrinsics import LensSnapshot, field_of_view_text
from cocalib.view import sentence, warning_in_sentences
from cocalib.view.wording import plain, with_sigma
from cocalib.web.messages import (
    LensCamera,
    LensCoverage,
    LensGrid,
    LensLeftOut,
    LensParameter,
    LensResult,
    LensTally,
    LensTrial,
    LensViewRow,
)

_MOST_RESIDUALS = 3000
_GRID = (24, 16)


def camera_table(camera: Camera, about: str) -> LensCamera:
    """Return a camera's intrinsics as a table, with where they come from."""
    known = camera.covariance
    rows = []
    for name, value in zip(camera.parameter_names, camera.parameters.tolist(), strict=True):
        sigma = known.sigma(name) if known is not None else 0.0
        text = with_sigma(value, sigma) if sigma > 0 else plain(value, 6)
        rows.append(LensParameter(name.removesuffix("_px"), text, "px" if name.endswith("_px") else ""))
    size = f"{camera.width_px} × {camera.height_px} px"
    return LensCamera(about, camera.model, size, field_of_view_text(camera), tuple(rows), known is not None)


def lens_result(number: int, lens: CalibratedLens, about: str) -> LensResult:
    """Return what the page shows of a calibrated lens.

    Args:
        number: of the result.
        lens: as calibrated.
        about: where it comes from.
    """
    views = sorted(lens.views, key=lambda view: -view.rms_px)
    return LensResult(
        number=number,
        camera=camera_table(lens.camera, about),
        board=f"{lens.board.text}, squares of {lens.board.square_m * 1e3:g} mm",
        choice=f"{lens.choice.removesuffix('.')}." if lens.choice else "",
        rms_px=lens.rms_px,
        held_out_rms_px=lens.held_out_rms_px,
        views=tuple(
            LensViewRow(view.corners.index, view.corners.name, view.rms_px, view.held_out_rms_px) for view in views
        ),
        left_out=tuple(LensLeftOut(one.index, one.name, one.reason) for one in lens.left_out),
        trials=tuple(_trial(one, lens.camera.model) for one in lens.trials),
        warnings=tuple(map(warning_in_sentences, lens.warnings)),
        residuals=_residuals(lens.views),
        pattern=_pattern(lens),
        uncertainty=_uncertainty(lens),
        unseen=MODEL_ERRORS_UNSEEN,
    )


def view_corners(lens: CalibratedLens, frame: int) -> tuple[tuple[float, float, float, float, bool], ...]:
    """Return the corners found in a frame: column, row, residual in both, and whether it was used; none if it is no view."""
    view = next((one for one in lens.views if one.corners.index == frame), None)
    if view is None:
        return ()
    pixels, residuals = view.corners.pixels_px, view.residuals_px
    return tuple(
        (round(u, 2), round(v, 2), round(du, 3), round(dv, 3), bool(used))
        for (u, v), (du, dv), used in zip(pixels.tolist(), residuals.tolist(), view.used, strict=True)
    )


def _trial(trial: ModelTrial, chosen: str) -> LensTrial:
    note = trial.fault
    if not note and trial.model != chosen:
        note = f"{with_sigma(trial.worse_by, trial.standard_error)} px² worse" if trial.worse_by else ""
    return LensTrial(trial.model, trial.rms_px, trial.held_out_rms_px, note, trial.model == chosen)


def _residuals(views: tuple[LensView, ...]) -> tuple[tuple[float, float, float, float], ...]:
    """Return the residuals of the corners used; of so many corners, evenly over all views."""
    if not views:
        return ()
    found = np.concatenate(
        [np.column_stack([view.corners.pixels_px, view.residuals_px])[view.used] for view in views], axis=0
    )
    every = max(1, -(-len(found) // _MOST_RESIDUALS))
    return tuple((round(u, 1), round(v, 1), round(du, 3), round(dv, 3)) for u, v, du, dv in found[::every].tolist())


def _pattern(lens: CalibratedLens) -> str:
    """Say whether the residuals have a pattern that the views share."""
    if not lens.views:
        return ""
    field = residual_field(lens)
    if field.systematic:
        return (
            f"All views share a pattern of {plain(field.systematic_px, 2)} px: the lens model leaves that unexplained."
        )
    return "The views share no pattern: the lens model explains what they show."


def _uncertainty(lens: CalibratedLens) -> LensGrid | None:
    """Return how uncertain a projection is over the picture; None if the covariance is not known."""
    if lens.camera.covariance is None:
        return None
    columns, rows = _GRID
    grid = projection_uncertainty(lens, columns=columns, rows=rows)
    return LensGrid(columns, rows, tuple(round(value, 5) for value in grid.sigma_px.ravel().tolist()))


def coverage_of(now: LensSnapshot) -> LensCoverage | None:
    """Return where the board has been so far; None before the first view."""
    coverage = now.progress.coverage if now.progress else None
    if coverage is None:
        return None
    rows, columns = coverage.counts.shape
    return LensCoverage(
        columns,
        rows,
        tuple(coverage.counts.ravel().tolist()),
        float(coverage.share),
        tuple(LensTally(name, count) for name, count in coverage.tilts.items()),
        tuple(LensTally(name, count) for name, count in coverage.distances.items()),
        tuple(map(sentence, coverage.missing)),
    )
