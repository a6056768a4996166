"""The errors that all pairs share in a calibration-1 file: those of the radar, and the part of each in the uncertainty."""

from calib_core.interchange.own.documents import RadarErrorsDocument, SystematicErrorDocument
from calib_core.interchange.own.numbers import finite_or_none
from calib_core.radar import RadarErrors
from calib_core.results.shared_errors import SystematicErrorResult


def radar_errors_document(errors: RadarErrors) -> RadarErrorsDocument:
    """Return the document of the radar's errors."""
    return RadarErrorsDocument(
        errors.azimuth_scale, errors.elevation_scale, errors.range_bias_m, errors.squared_height_m2
    )


def radar_errors_of(document: RadarErrorsDocument) -> RadarErrors:
    """Return the radar's errors in a document."""
    return RadarErrors(
        document.azimuth_scale, document.elevation_scale, document.range_bias_m, document.squared_height_m2
    )


def systematic_error_document(error: SystematicErrorResult) -> SystematicErrorDocument:
    """Return the document of one error; its text is left out, because its name says the same."""
    return SystematicErrorDocument(
        name=error.name,
        value=error.value,
        sigma=error.sigma,
        prior_sigma=error.prior_sigma,
        estimated=error.estimated,
        position_share=finite_or_none(error.position_share) or 0.0,
        rotation_share=finite_or_none(error.rotation_share) or 0.0,
    )


def systematic_error_of(document: SystematicErrorDocument) -> SystematicErrorResult:
    """Return the error in a document."""
    return SystematicErrorResult(
        name=document.name,
        value=document.value,
        sigma=document.sigma,
        prior_sigma=document.prior_sigma,
        estimated=document.estimated,
        position_share=document.position_share,
        rotation_share=document.rotation_share,
    )
