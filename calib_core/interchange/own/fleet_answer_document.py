"""What a fleet's prior did to a calibration, in a calibration-1 file."""

from calib_core.fleet_prior import DataAlone, FleetAnswer
from calib_core.interchange.own.covariance_parts_document import covariance_parts_document, covariance_parts_of
from calib_core.interchange.own.documents import DataAloneDocument, FleetAnswerDocument
from calib_core.interchange.own.fleet_prior_fields import fleet_prior_fields, fleet_prior_of_fields
from calib_core.interchange.own.numbers import finite_or_none, nan_if_none, nested
from calib_core.interchange.own.stated_covariance import stated_covariance
from calib_core.interchange.own.transform_document import transform_document, transform_of
from calib_core.verdict import level_named

_PLACE = "fleet_prior"


def fleet_answer_document(fleet: FleetAnswer | None) -> FleetAnswerDocument | None:
    """Return the document of what a fleet's prior did."""
    if fleet is None:
        return None
    alone = fleet.data_alone
    return FleetAnswerDocument(
        **fleet_prior_fields(fleet.prior),
        used=fleet.used,
        squared_distance=finite_or_none(fleet.squared),
        limit=finite_or_none(fleet.limit),
        data_alone=None if alone is None else _alone_document(alone),
    )


def fleet_answer_of(document: FleetAnswerDocument | None, *, source: str) -> FleetAnswer | None:
    """Return what a fleet's prior did, as a document says.

    Raises:
        InputError: a transform or a covariance is none.
    """
    if document is None:
        return None
    prior = fleet_prior_of_fields(document, source=source, place=f"{_PLACE}.")
    alone = None if document.data_alone is None else _alone_of(document.data_alone, source=source)
    return FleetAnswer(prior, document.used, alone, nan_if_none(document.squared_distance), nan_if_none(document.limit))


def _alone_document(alone: DataAlone) -> DataAloneDocument:
    return DataAloneDocument(
        camera_from_radar=transform_document(alone.camera_from_radar),
        covariance=nested(alone.covariance + 0.0),
        covariance_quantile=finite_or_none(alone.covariance_quantile),
        verdict=level_named(alone.verdict),
        reason=alone.reason or None,
        covariance_parts=covariance_parts_document(alone.covariance_parts),
    )


def _alone_of(document: DataAloneDocument, *, source: str) -> DataAlone:
    place = f"{_PLACE}.data_alone"
    return DataAlone(
        transform_of(document.camera_from_radar, source=source, place=f"{place}.camera_from_radar"),
        stated_covariance(document.covariance, source=source, place=f"{place}.covariance"),
        nan_if_none(document.covariance_quantile),
        document.verdict or "",
        document.reason or "",
        covariance_parts_of(document.covariance_parts, source=source, place=f"{place}.covariance_parts"),
    )
