"""Write intrinsics-1: a calibrated lens with all that is known about it, for programs."""

import numpy as np
from msgspec import structs

from calib_core.arrays import Values
from calib_core.camera import Camera
from calib_core.interchange.own.documents import camera_document, finite_or_none
from calib_core.interchange.own.lens_documents import (
    INTRINSICS_SCHEMA,
    CoverageDocument,
    ImageSource,
    IntrinsicsDocument,
    LensParameterDocument,
    LensPoseDocument,
    LensViewDocument,
    ModelTrialDocument,
    ResidualFieldDocument,
    UncertaintyDocument,
)
from calib_core.interchange.syntax.strict_json import document_text
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView
from calib_core.intrinsics.coverage import Coverage
from calib_core.intrinsics.image_maps import MODEL_ERRORS_UNSEEN, projection_uncertainty, residual_field
from calib_core.intrinsics.split_difference import split_difference
from calib_core.words.intrinsics import halves_text, residuals_text
from calib_core.words.outcomes import warning_text

_LONGEST_NAME = 200


def write_intrinsics(
    lens: CalibratedLens,
    source: ImageSource,
    *,
    searched: int,
    field_of_view_deg: tuple[float, float],
    coverage: Coverage | None = None,
) -> str:
    """Write intrinsics-1 text; the same lens gives the same bytes.

    Args:
        lens: with its views.
        source: of the images.
        searched: how many of them were looked at.
        field_of_view_deg: along the middle row and the middle column [deg].
        coverage: of the used views.
    """
    document = IntrinsicsDocument(
        schema=INTRINSICS_SCHEMA,
        camera=camera_document(lens.camera),
        board=lens.board,
        source=structs.replace(source, name=source.name[:_LONGEST_NAME] or "images"),
        parameters=_parameters(lens.camera),
        field_of_view_deg=(finite_or_none(field_of_view_deg[0]), finite_or_none(field_of_view_deg[1])),
        rms_px=finite_or_none(lens.rms_px),
        held_out_rms_px=finite_or_none(lens.held_out_rms_px),
        choice=lens.choice,
        models=[
            ModelTrialDocument(
                trial.model,
                finite_or_none(trial.rms_px),
                finite_or_none(trial.held_out_rms_px),
                finite_or_none(trial.worse_by),
                finite_or_none(trial.standard_error),
                trial.fault,
            )
            for trial in lens.trials
        ],
        searched=searched,
        views=[_view(view) for view in lens.views],
        left_out=[structs.replace(image, name=image.name[:_LONGEST_NAME]) for image in lens.left_out],
        projection_uncertainty=_uncertainty(lens),
        residual_field=_field(lens),
        coverage=None if coverage is None else _coverage(coverage),
        halves_apart=halves_text(split_difference(lens)),
        warnings=[warning_text(warning) for warning in lens.warnings],
        board_shape_m=[(x, y, z) for x, y, z in lens.board_shape_m.tolist()],
    )
    return document_text(document)


def _parameters(camera: Camera) -> list[LensParameterDocument]:
    known = camera.covariance
    return [
        LensParameterDocument(name, value, None if known is None else known.sigma(name))
        for name, value in zip(camera.parameter_names, camera.parameters.tolist(), strict=True)
    ]


def _view(view: LensView) -> LensViewDocument:
    corners = view.corners
    pose = view.camera_from_board
    return LensViewDocument(
        corners.index,
        corners.name,
        len(corners.corner_ids),
        int(view.used.sum()),
        finite_or_none(view.rms_px),
        finite_or_none(view.held_out_rms_px),
        finite_or_none(corners.blur_px),
        LensPoseDocument(pose.rotation.tolist(), pose.translation_m.tolist()),
    )


def _uncertainty(lens: CalibratedLens) -> UncertaintyDocument:
    grid = projection_uncertainty(lens)
    sigmas = [_numbers(row) for row in grid.sigma_px]
    return UncertaintyDocument(grid.x_px.tolist(), grid.y_px.tolist(), sigmas, MODEL_ERRORS_UNSEEN)


def _field(lens: CalibratedLens) -> ResidualFieldDocument:
    field = residual_field(lens)
    return ResidualFieldDocument(
        field.x_px.tolist(),
        field.y_px.tolist(),
        [[(finite_or_none(u), finite_or_none(v)) for u, v in row] for row in field.means_px],
        [_numbers(row) for row in field.errors_px],
        field.counts.tolist(),
        finite_or_none(field.systematic_px),
        residuals_text(field),
    )


def _coverage(coverage: Coverage) -> CoverageDocument:
    return CoverageDocument(
        coverage.counts.tolist(),
        coverage.share,
        dict(coverage.tilts),
        dict(coverage.distances),
        list(coverage.missing),
    )


def _numbers(row: Values) -> list[float | None]:
    return [finite_or_none(value) for value in np.asarray(row)]
