"""What a fleet's prior did to a calibration, in a calibration-1 file."""

from typing import get_args

import numpy as np

from calib_core.fleet_prior import DataAlone, FleetAnswer, FleetPrior
from calib_core.interchange.own.documents import DataAloneDocument, FleetAnswerDocument
from calib_core.interchange.own.numbers import finite_or_none, nan_if_none, nested
from calib_core.interchange.own.stated_covariance import stated_covariance
from calib_core.interchange.own.transform_document import transform_document, transform_of
from calib_core.verdict import VerdictLevel

__all__ = ["fleet_answer_document", "fleet_answer_of"]

_PLACE = "fleet_prior"


def fleet_answer_document(fleet: FleetAnswer | None) -> FleetAnswerDocument | None:
    """Return the document of what a fleet's prior did."""
    if fleet is None:
        return None
    prior, alone = fleet.prior, fleet.data_alone
    return FleetAnswerDocument(
        vehicle_type=prior.vehicle_type,
        used=fleet.used,
        camera_from_radar=transform_document(prior.camera_from_radar),
        covariance=nested(prior.covariance + 0.0),
        vehicles=list(prior.vehicles),
        left_out=list(prior.left_out),
        widened=prior.widened if prior.widened != 1.0 else None,
        freedom=finite_or_none(prior.freedom),
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
    prior = FleetPrior(
        vehicle_type=document.vehicle_type,
        camera_from_radar=transform_of(document.camera_from_radar, source=source, place=f"{_PLACE}.camera_from_radar"),
        covariance=stated_covariance(document.covariance, source=source, place=f"{_PLACE}.covariance"),
        vehicles=tuple(document.vehicles),
        left_out=tuple(document.left_out),
        widened=1.0 if document.widened is None else document.widened,
        freedom=np.inf if document.freedom is None else document.freedom,
    )
    alone = None if document.data_alone is None else _alone_of(document.data_alone, source=source)
    return FleetAnswer(prior, document.used, alone, nan_if_none(document.squared_distance), nan_if_none(document.limit))


def _alone_document(alone: DataAlone) -> DataAloneDocument:
    return DataAloneDocument(
        camera_from_radar=transform_document(alone.camera_from_radar),
        covariance=nested(alone.covariance + 0.0),
        covariance_quantile=finite_or_none(alone.covariance_quantile),
        verdict=_level(alone.verdict),
    )


def _alone_of(document: DataAloneDocument, *, source: str) -> DataAlone:
    place = f"{_PLACE}.data_alone"
    return DataAlone(
        transform_of(document.camera_from_radar, source=source, place=f"{place}.camera_from_radar"),
        stated_covariance(document.covariance, source=source, place=f"{place}.covariance"),
        nan_if_none(document.covariance_quantile),
        document.verdict or "",
    )


def _level(verdict: str) -> VerdictLevel | None:
    return next((level for level in get_args(VerdictLevel) if level == verdict), None)
