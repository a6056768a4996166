"""The sheet Lens: the intrinsics in use, a calibration of the lens in the background, and what all pages show of its result."""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import HASH_TAG
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.intrinsics.board import Board, board_of_size
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView, ModelTrial
from calib_core.intrinsics.coverage import Coverage
from calib_core.intrinsics.image_maps import MODEL_ERRORS_UNSEEN, ImageGrid, projection_uncertainty, residual_field
from calib_core.recordings import Recording
from calib_core.words.intrinsics import residuals_text
from cocalib.intrinsics import LensJob, LensSnapshot, RecordedImages, field_of_view_text
from cocalib.platform.error_boundary import error_boundary
from cocalib.session.events import IntrinsicsChosen
from cocalib.session.state import ChosenIntrinsics
from cocalib.view.model import Figure, warning_row
from cocalib.view.wording import plain, sentence, with_sigma
from cocalib.web.channel.outbox import Notice, Outbox
from cocalib.web.messages.lens_messages import (
    LensCalibrate,
    LensCamera,
    LensCancel,
    LensResult,
    LensState,
    LensTrial,
    LensUse,
    LensViewRow,
)
from cocalib.web.messages.outgoing import Outgoing, encode
from cocalib.workspace import Workspace

_log = logging.getLogger(__name__)
_MOST_RESIDUALS = 3000
_GRID = (24, 16)


class LensService:
    """Calibrates the lens for the pages of a recording. Runs on the event loop, except where it says otherwise."""

    def __init__(self, workspace: Workspace, recording: Recording, tell: Callable[[Outgoing, str], None]) -> None:
        """Set up the service.

        Args:
            workspace: has the intrinsics in use.
            recording: has the images.
            tell: sends a message of a kind to all pages.
        """
        self._workspace = workspace
        self._images = RecordedImages(recording)
        self._tell = tell
        self._notice = Notice(lambda: asyncio.create_task(self._show_all()))
        self._job = LensJob(self._notice.give)
        self._result: LensResult | None = None
        self._result_of: CalibratedLens | None = None
        self._number = 0
        self._shown_camera: Camera | None = None

    def start(self) -> None:
        """Begin to tell the pages, on the running loop."""
        self._notice.start()

    def greet(self, outbox: Outbox) -> None:
        """Send the present state to a page that has just opened."""
        outbox.put(encode(self._present()), kind="lens")
        if self._result is not None:
            outbox.put(encode(self._result), kind="lens_result")

    def follow(self) -> None:
        """Tell the pages if other intrinsics are in use."""
        if self._workspace.camera is not self._shown_camera:
            self._tell(self._present(), "lens")

    def calibrate(self, wanted: LensCalibrate) -> None:
        """Begin to calibrate the lens.

        Raises:
            InputError: there is no such board.
        """
        self._job.start(self._images, _board(wanted), wanted.model)

    def cancel(self, _wanted: LensCancel) -> None:
        """Stop calibrating."""
        self._job.cancel()

    async def use(self, _wanted: LensUse) -> None:
        """Solve with the calibrated lens.

        Raises:
            InputError: there is none yet.
        """
        lens = self._job.snapshot.lens
        if lens is None:
            raise InputError("there is no calibrated lens to use yet; calibrate it first")
        step = IntrinsicsChosen(ChosenIntrinsics.of(lens.camera, _lens_source(lens)))
        await asyncio.get_running_loop().run_in_executor(None, partial(self._workspace.dispatch, step))

    async def close(self) -> None:
        """Stop the calibration, and tell the pages nothing more."""
        self._notice.stop()
        await asyncio.to_thread(self._job.close)

    def corners(self, frame: int) -> tuple[tuple[float, float, float, float, bool], ...]:
        """Return the corners found in a frame, with their residuals. May be called from any thread."""
        lens = self._job.snapshot.lens
        return () if lens is None else view_corners(lens, frame)

    def camera_yaml(self, *, calibrated: bool) -> str:
        """Return the calibrated lens, or the intrinsics in use, as a ROS camera_info file. May be called from any thread.

        Raises:
            InputError: there are none.
        """
        lens = self._job.snapshot.lens
        camera = (lens.camera if lens else None) if calibrated else self._workspace.camera
        if camera is None:
            raise InputError("there are no intrinsics to save yet; calibrate the lens first")
        return camera_info_text(camera, "camera") + HASH_TAG

    async def _show_all(self) -> None:
        """Tell the pages the state, after the result that it speaks of."""
        with error_boundary("showing the calibrated lens", _log.error):
            lens = self._job.snapshot.lens
            if lens is not None and lens is not self._result_of:
                self._result_of = lens
                self._number += 1
                work = partial(lens_result, self._number, lens, _lens_source(lens))
                self._result = await asyncio.to_thread(work)
                self._tell(self._result, "lens_result")
            if self._notice.is_on:
                self._tell(self._present(), "lens")

    def _present(self) -> LensState:
        now, workspace = self._job.snapshot, self._workspace
        camera = self._shown_camera = workspace.camera
        chosen = workspace.session.intrinsics
        return LensState(
            intrinsics=None if camera is None else camera_table(camera, workspace.intrinsics),
            chosen=chosen is not None,
            images=len(self._images),
            stage=now.stage,
            searched=now.progress.searched if now.progress else 0,
            total=now.progress.total if now.progress else 0,
            views=len(now.progress.views) if now.progress else 0,
            left_out=len(now.progress.left_out) if now.progress else 0,
            doing=now.doing,
            problem=sentence(now.problem),
            hint=sentence(now.hint),
            can_resume=now.can_resume,
            coverage=_coverage(now),
            result=self._result.number if self._result else 0,
            in_use=now.lens is not None and chosen == ChosenIntrinsics.of(now.lens.camera, _lens_source(now.lens)),
        )


def _lens_source(lens: CalibratedLens) -> str:
    """Say where a calibrated lens comes from."""
    return f"the board in this recording ({lens.board.text}, {len(lens.views)} views)"


def _board(form: LensCalibrate) -> Board:
    """Return the board that a page describes.

    Raises:
        InputError: its size, the side of a square or what its markers are is not valid.
    """
    if form.kind == "checkerboard":
        return board_of_size(form.size, form.square_mm)
    dictionary = form.dictionary or None
    if form.kind == "charuco":
        return board_of_size(form.size, form.square_mm, form.kind, marker_mm=form.marker_mm, dictionary=dictionary)
    spacing = form.marker_mm / form.square_mm if form.square_mm > 0 else 0.0
    return board_of_size(form.size, form.square_mm, form.kind, tag_spacing=spacing, dictionary=dictionary)


def camera_table(camera: Camera, about: str) -> LensCamera:
    """Return a camera's intrinsics as a table, with where they come from."""
    known = camera.covariance
    rows = []
    for name, value in zip(camera.parameter_names, camera.parameters.tolist(), strict=True):
        sigma = known.sigma(name) if known is not None else 0.0
        text = with_sigma(value, sigma) if sigma > 0 else plain(value, 6)
        rows.append(Figure(name, name.removesuffix("_px"), text, "px" if name.endswith("_px") else "", ""))
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
        left_out=lens.left_out,
        trials=tuple(_trial(trial, lens.camera.model) for trial in lens.trials),
        warnings=tuple(map(warning_row, lens.warnings)),
        residuals=_residuals(lens.views),
        pattern=residuals_text(residual_field(lens)) if lens.views else "",
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
    return LensTrial(trial, note, trial.model == chosen)


def _residuals(views: tuple[LensView, ...]) -> tuple[tuple[float, float, float, float], ...]:
    """Return the residuals of the corners used; of so many corners, evenly over all views."""
    if not views:
        return ()
    found = np.concatenate(
        [np.column_stack([view.corners.pixels_px, view.residuals_px])[view.used] for view in views], axis=0
    )
    every = max(1, -(-len(found) // _MOST_RESIDUALS))
    return tuple((round(u, 1), round(v, 1), round(du, 3), round(dv, 3)) for u, v, du, dv in found[::every].tolist())


def _uncertainty(lens: CalibratedLens) -> ImageGrid | None:
    """Return how uncertain a projection is over the image; None if the covariance is not known."""
    if lens.camera.covariance is None:
        return None
    columns, rows = _GRID
    grid = projection_uncertainty(lens, columns=columns, rows=rows)
    return replace(grid, sigma_px=grid.sigma_px.round(5))


def _coverage(now: LensSnapshot) -> Coverage | None:
    """Return where the board has been so far, with what is missing as sentences; None before the first view."""
    coverage = now.progress.coverage if now.progress else None
    return coverage and replace(coverage, missing=tuple(map(sentence, coverage.missing)))
