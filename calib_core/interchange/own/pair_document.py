"""Convert a solved pair to and from its document in calibration-1, including the data to solve it again."""

import numpy as np
from msgspec import UNSET, UnsetType

from calib_core.errors import InputError
from calib_core.interchange.own import documents
from calib_core.interchange.own.transform_document import finite_or_none, nan_if_none, nested
from calib_core.measurements import Candidate, Pair
from calib_core.radar import covariance_from_sigma_polar
from calib_core.results import PairResult

_AGREEMENT_M = 1e-6

SOLVED_FROM_KEYS = ("sigma_px", "radar_time", "candidates")
"""The data a pair was solved from; omitted if unknown, as in files from other tools."""


def solved_pair_document(pair: PairResult) -> documents.SolvedPairDocument:
    """Return the document of a solved pair."""
    measured = pair.measured
    return documents.SolvedPairDocument(
        id=pair.id,
        image_time=pair.image_time,
        radar_m=nested(pair.point_radar_m),
        pixel_px=nested(pair.pixel_px),
        projected_px=nested(pair.projected_px),
        residual_px=nested(pair.residual_px),
        distance_px=finite_or_none(pair.distance_px),
        inlier=bool(pair.inlier),
        excluded=bool(pair.excluded),
        outlier_probability=finite_or_none(pair.outlier_probability),
        influence=finite_or_none(pair.influence),
        candidate=int(pair.candidate),
        expected_covariance_px2=nested(pair.expected_covariance_px2),
        sigma_px=measured.sigma_px if measured else None,
        radar_time=measured.radar_time if measured else None,
        candidates=[_candidate_document(candidate) for candidate in measured.candidates] if measured else [],
        mark=measured.mark if measured and measured.mark != "clicked" else UNSET,
        chosen=measured.chosen or UNSET if measured else UNSET,
    )


def solved_pair_of(document: documents.SolvedPairDocument, *, source: str, place: str) -> PairResult:
    """Return the solved pair of a JSON object.

    Raises:
        InputError: a candidate is at the radar's origin, or radar_m is not the position of the chosen candidate.
    """
    _check_candidates(document, source=source, place=place)
    return PairResult(
        id=document.id,
        pixel_px=np.array(document.pixel_px),
        projected_px=np.array(document.projected_px or (np.nan, np.nan)),
        point_radar_m=np.array(document.radar_m),
        inlier=document.inlier,
        excluded=document.excluded,
        outlier_probability=nan_if_none(document.outlier_probability),
        influence=nan_if_none(document.influence),
        candidate=document.candidate,
        expected_covariance_px2=np.array(document.expected_covariance_px2 or [[np.nan] * 2] * 2),
        image_time=document.image_time,
        measured=_measured(document) if document.candidates else None,
    )


def _measured(document: documents.SolvedPairDocument) -> Pair:
    return Pair(
        id=document.id,
        pixel_px=np.array(document.pixel_px),
        candidates=tuple(_candidate(candidate) for candidate in document.candidates),
        sigma_px=document.sigma_px,
        image_time=document.image_time,
        radar_time=document.radar_time,
        mark=document.mark or "clicked",
        chosen=document.chosen or None,
    )


def _candidate_document(candidate: Candidate) -> documents.CandidateDocument:
    return documents.CandidateDocument(
        radar_m=nested(candidate.position_radar_m),
        sigma_polar=nested(candidate.sigma_polar),
        score=candidate.score,
        returns=candidate.returns,
        scans=candidate.scans,
        snr_db=finite_or_none(candidate.snr_db),
        alternative_of=candidate.alternative_of if candidate.alternative_of >= 0 else UNSET,
    )


def _candidate(document: documents.CandidateDocument) -> Candidate:
    position, sigma_polar = np.array(document.radar_m), np.array(document.sigma_polar or (np.nan,) * 3)
    return Candidate(
        position_radar_m=position,
        sigma_polar=sigma_polar,
        covariance_m2=covariance_from_sigma_polar(position, sigma_polar),
        score=document.score,
        returns=document.returns,
        scans=document.scans,
        snr_db=nan_if_none(document.snr_db),
        alternative_of=-1 if isinstance(document.alternative_of, UnsetType) else document.alternative_of,
    )


def _check_candidates(document: documents.SolvedPairDocument, *, source: str, place: str) -> None:
    for i, candidate in enumerate(document.candidates):
        if not any(candidate.radar_m):
            raise InputError(
                f"{source}: {place}.candidates[{i}].radar_m: is at the radar's origin; remove the candidate"
            )
    if not document.candidates:
        return
    chosen = document.candidates[document.candidate] if document.candidate < len(document.candidates) else None
    if chosen is None or max(abs(a - b) for a, b in zip(chosen.radar_m, document.radar_m, strict=True)) > _AGREEMENT_M:
        raise InputError(
            f"{source}: {place}.radar_m: is not the position of candidate {document.candidate}; correct one of the two, "
            "or remove the candidates"
        )
