"""calibration-1, the file of a solved calibration: written, read, and as a format of the registry.

Below are the parts that differ from their types: what is said of the vehicle, the radar's errors and angle map, the covariance's
parts, the provenance, and the solved pairs with the data to solve them again.

Some results stay as they were read when a file is written again: those of a later version are unknown to this one, and those that
follow from others are computed with the last digit that this processor gives, which need not be the one in the file.
"""

import dataclasses
import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from msgspec import UNSET, UnsetType

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.input_files import encodable
from calib_core.interchange.calibration_file import (
    EQUATION,
    CalibrationFile,
    FrameNames,
    KeptResult,
    Provenance,
    VehicleNote,
    choose_check_point,
)
from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose, imported
from calib_core.interchange.own import documents
from calib_core.interchange.own.documents import (
    AngleMapDocument,
    CovariancePartsDocument,
    are_inverse,
    camera_document,
    camera_of,
    finite_or_none,
    nan_if_none,
    nested,
    refuse_repeated_ids,
    transform_document,
    transform_of,
    unconfirmed_of,
)
from calib_core.interchange.own.documents import Matrix66 as StatedMatrix
from calib_core.interchange.syntax.content import Content, decoded
from calib_core.interchange.syntax.strict_json import (
    builtins_of,
    document_in,
    fields_of,
    item_type,
    json_object,
    json_text,
)
from calib_core.measurements import Candidate, Pair
from calib_core.options import CalibrationOptions
from calib_core.parsing import json_value
from calib_core.radar import AngleMap, RadarErrors, covariance_from_sigma_polar
from calib_core.results import Calibration, CheckPoint, PairResult
from calib_core.results.calibration import CovarianceParts
from calib_core.results.verdict import verdict_on
from calib_core.words.outcomes import unpaired_text, warning_text
from calib_core.words.verdict import stated_verdict

_SHOWN = 200
"""Characters of unknown keys."""
COVARIANCE_CONVENTION = (
    "6x6, row-major, order (x, y, z, rotX, rotY, rotZ) [m, rad], of the error (dt, dtheta) of camera_from_radar "
    "in camera axes: t = t_hat + dt, R = Exp(dtheta) R_hat"
)


def calibration_text(
    calibration: Calibration,
    frames: FrameNames | None = None,
    provenance: Provenance | None = None,
    *,
    vehicle: VehicleNote | None = None,
) -> str:
    """Write a solved calibration as calibration-1 text; the same input gives the same bytes, never NaN.

    Args:
        calibration: what the solver returned.
        frames: the names of the two frames; None uses "radar" and "camera_optical".
        provenance: where it comes from.
        vehicle: which vehicle it is of; None if nobody said.
    """
    return write_calibration(calibration_file(calibration, frames, provenance, vehicle=vehicle))


def calibration_file(
    calibration: Calibration,
    frames: FrameNames | None = None,
    provenance: Provenance | None = None,
    *,
    vehicle: VehicleNote | None = None,
) -> CalibrationFile:
    """Return the content of a calibration-1 file: the calibration with its frames, a check point and its provenance."""
    unconfirmed = sum(not assumption.confirmed for assumption in provenance.assumptions) if provenance else 0
    return CalibrationFile(
        calibration=calibration,
        frames=frames or FrameNames(),
        check_point=choose_check_point(calibration),
        provenance=provenance or Provenance(),
        verdict=stated_verdict(verdict_on(calibration, unconfirmed=unconfirmed)),
        evidence="automatic" if provenance is not None and provenance.unconfirmed is not None else "clicked",
        vehicle=vehicle or VehicleNote(),
    )


def calibration_sha256(file: CalibrationFile) -> str:
    """Return the SHA-256 of a calibration's file, in hexadecimal: what exports name as their origin."""
    return file.made_from_sha256 or hashlib.sha256(write_calibration(file).encode()).hexdigest()


def write_calibration(file: CalibrationFile) -> str:
    """Write the content of a calibration-1 file; reading and writing it again gives the same bytes."""
    calibration = file.calibration
    sigma = np.sqrt(np.where(np.diag(calibration.covariance) >= 0, np.diag(calibration.covariance), np.nan)).tolist()
    check = file.check_point
    corrected = bool(calibration.systematic_errors) or calibration.radar_errors != RadarErrors()
    document = documents.CalibrationDocument(
        schema=documents.CALIBRATION_SCHEMA,
        camera_from_radar=transform_document(calibration.camera_from_radar),
        radar_from_camera=transform_document(calibration.camera_from_radar.inverse()),
        frames=documents.FramesDocument(file.frames.radar, file.frames.camera),
        equation=EQUATION,
        covariance=nested(calibration.covariance),
        covariance_convention=COVARIANCE_CONVENTION,
        covariance_quantile=finite_or_none(calibration.covariance_quantile),
        covariance_parts=covariance_parts_document(calibration.covariance_parts),
        sigma=documents.SigmaDocument(*map(finite_or_none, sigma)),
        check_point=documents.CheckPointDocument(nested(check.radar_m), nested(check.pixel_px)) if check else None,
        metrics=calibration.metrics,
        noise_scale=documents.NoiseScaleDocument(*calibration.noise_scale),
        radar_errors=calibration.radar_errors if corrected else UNSET,
        systematic_errors=list(calibration.systematic_errors) if corrected else UNSET,
        radar_angle_map=angle_map_document(calibration.angle_map),
        paper=documents.PaperDocument(finite_or_none(calibration.iterative_px), finite_or_none(calibration.sqpnp_px)),
        verdict=file.verdict or UNSET,
        evidence=file.evidence or UNSET,
        carried_from=file.carried_from or UNSET,
        warnings=[warning_text(warning) for warning in calibration.warnings],
        unpaired=[unpaired_text(click) for click in calibration.unpaired],
        pairs=[solved_pair_document(pair) for pair in calibration.pairs],
        camera=camera_document(calibration.camera),
        given_camera=camera_document(calibration.given_camera) if calibration.given_camera is not None else UNSET,
        vehicle=_stated_vehicle(file),
        options=calibration.options,
        provenance=provenance_document(file.provenance),
    )
    content = encodable(builtins_of(document))
    if not np.isfinite(calibration.metrics.picture_sigma_px):
        del content["metrics"]["picture_sigma_px"]
    unset = CalibrationOptions()
    for group in ("mounting", "refining"):
        if getattr(calibration.options, group) == getattr(unset, group):
            del content["options"][group]
    return json_text(with_kept(content, file.kept))


def read_calibration(content: str | bytes, source: str = "calibration") -> CalibrationFile:
    """Read calibration-1. Results may contain unknown keys; the camera and the options may not.

    Raises:
        InputError: invalid content, or transforms that disagree; the message names the file, the place and what to do.
    """
    text = decoded(content, source=source)
    return consistent_file(_imported(json_object(text, source=source), source), source)


def consistent_file(found: ImportedCalibration, source: str) -> CalibrationFile:
    """Return the content of one of our calibrations; `read_any` reads one that contradicts itself, too.

    Raises:
        InputError: it contradicts itself, or is of another format.
    """
    if found.file is None:
        raise InputError(
            f"{source}: is {found.format}, not calibration-1; convert it first: "
            f"cocalib import {PurePath(source).name} --out calibration.json"
        )
    for fault in found.faults:
        raise InputError(f"{source}: {fault}; cocalib check finds which is wrong; correct it")
    return found.file


def _recognizes(content: Content) -> bool:
    return str(content.json_mapping.get("schema", "")).startswith("cocalib/calibration-")


def _read(content: Content, source: str) -> ImportedCalibration:
    return _imported(content.mapping, source)


def _imported(content: Mapping[str, Any], source: str) -> ImportedCalibration:
    """Return calibration-1 with its contradictions as faults, so that a check can report which part is wrong.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    document = document_in(content, documents.CalibrationDocument, source=source)
    stated, inverse = document.camera_from_radar, document.radar_from_camera
    bare = documents.TransformDocument(stated.rotation, stated.translation_m)
    pose = transform_of(bare, source=source, place="camera_from_radar")
    faults = []
    try:
        transform_of(stated, source=source, place="camera_from_radar")
    except InputError:
        faults.append("camera_from_radar.quaternion_wxyz and camera_from_radar.rotation are different rotations")
    try:
        if inverse is not None and not are_inverse(stated, inverse, source=source, place="radar_from_camera"):
            faults.append("radar_from_camera is not the inverse of camera_from_radar")
    except InputError:
        faults.append("radar_from_camera has contradictory rotations, or an invalid one")
    file = _file(document, pose, source=source)
    kept = kept_results(content, documents.CalibrationDocument)
    as_written = WrittenPose("matrix", np.array(stated.rotation), np.array(stated.translation_m), "camera_from_radar")
    calibration = imported(dataclasses.replace(file, kept=kept))
    unknown = [key for key in content if key not in (fields_of(documents.CalibrationDocument) or ())]
    notes = (f"unknown keys, kept as they are: {', '.join(unknown)[:_SHOWN]}",) if unknown else ()
    return dataclasses.replace(calibration, pose=as_written, faults=tuple(faults), notes=notes)


def _file(
    document: documents.CalibrationDocument, camera_from_radar: RigidTransform, *, source: str
) -> CalibrationFile:
    """Return the content of a calibration-1 document, with a given pose.

    Raises:
        InputError: the camera, a frame name or what is said of the vehicle is invalid.
    """
    refuse_repeated_ids([pair.id for pair in document.pairs], source=source, place="pairs")
    check = document.check_point
    scale = document.noise_scale
    covariance = np.array(document.covariance or np.full((6, 6), np.nan))
    if (np.diagonal(covariance) < 0.0).any():
        raise InputError(f"{source}: covariance: a variance on the diagonal is negative; solve the session again")
    calibration = Calibration(
        camera_from_radar=camera_from_radar,
        covariance=covariance,
        camera=camera_of(document.camera, source=source),
        given_camera=_given_camera(document, source=source),
        metrics=document.metrics,
        pairs=tuple(solved_pair_of(pair, source=source, place=f"pairs[{i}]") for i, pair in enumerate(document.pairs)),
        unpaired=tuple(click.unpaired for click in document.unpaired),
        warnings=tuple(warning.warning for warning in document.warnings),
        options=document.options,
        noise_scale=(scale.click, scale.range, scale.azimuth, scale.elevation),
        covariance_quantile=nan_if_none(document.covariance_quantile),
        iterative_px=nan_if_none(document.paper.iterative_px),
        sqpnp_px=nan_if_none(document.paper.sqpnp_px),
        angle_map=angle_map_of(document.radar_angle_map, source=source),
        radar_errors=document.radar_errors or RadarErrors(),
        systematic_errors=tuple(document.systematic_errors or ()),
        covariance_parts=covariance_parts_of(document.covariance_parts, source=source),
    )
    try:
        frames = FrameNames(document.frames.radar, document.frames.camera)
    except InputError as error:
        raise InputError(f"{source}: frames: {error}") from None
    return CalibrationFile(
        calibration=calibration,
        frames=frames,
        check_point=CheckPoint(np.array(check.radar_m), np.array(check.pixel_px)) if check else None,
        provenance=provenance_of(document.provenance),
        verdict=document.verdict or None,
        evidence=document.evidence or None,
        carried_from=document.carried_from or None,
        vehicle=document.vehicle or VehicleNote(),
    )


CALIBRATION_1 = Format(
    name="json",
    title="cocalib's own calibration-1",
    used_in="cocalib",
    also="everything: pose, covariance, pairs, camera, angle map",
    numbers="camera_from_radar and its inverse, both as matrix, translation and quaternion w x y z",
    file_name="calibration.json",
    camera="lens",
    comment="keys",
    write=write_calibration,
    reads=Reads(_recognizes, _read),
    pose_for=None,
)
"""calibration-1 as a format of the registry."""


def _given_camera(document: documents.CalibrationDocument, *, source: str) -> Camera | None:
    """Return the intrinsics before they were refined, if they were."""
    given = document.given_camera
    return camera_of(given, source=source, place="given_camera") if given else None


def _stated_vehicle(file: CalibrationFile) -> VehicleNote | UnsetType:
    """Return what is stated; unset if nothing is, and no result goes back into it."""
    has_more = any(result.place[0] == "vehicle" for result in file.kept)
    return file.vehicle if has_more or file.vehicle != VehicleNote() else UNSET


def angle_map_document(angle_map: AngleMap | None) -> AngleMapDocument | UnsetType:
    """Return the document of an angle map."""
    if angle_map is None:
        return UNSET
    add, sigma = angle_map.correction_rad + 0.0, angle_map.sigma_rad
    return AngleMapDocument(
        azimuth_rad=angle_map.azimuth_rad.tolist(),
        elevation_rad=angle_map.elevation_rad.tolist(),
        add_azimuth_rad=add[:, :, 0].tolist(),
        add_elevation_rad=add[:, :, 1].tolist(),
        sigma_azimuth_rad=sigma[:, :, 0].tolist(),
        sigma_elevation_rad=sigma[:, :, 1].tolist(),
        aed_px=angle_map.raw_aed_px,
        corrected_aed_px=angle_map.corrected_aed_px,
    )


def angle_map_of(document: AngleMapDocument | UnsetType | None, *, source: str) -> AngleMap | None:
    """Return the angle map in a document.

    Raises:
        InputError: the tables do not fit the grid lines, or the grid lines do not ascend.
    """
    if not document:
        return None
    try:
        return AngleMap(
            azimuth_rad=np.array(document.azimuth_rad),
            elevation_rad=np.array(document.elevation_rad),
            correction_rad=np.stack([document.add_azimuth_rad, document.add_elevation_rad], axis=-1),
            sigma_rad=np.stack([document.sigma_azimuth_rad, document.sigma_elevation_rad], axis=-1),
            raw_aed_px=np.nan if document.aed_px is None else document.aed_px,
            corrected_aed_px=np.nan if document.corrected_aed_px is None else document.corrected_aed_px,
        )
    except ValueError as error:
        raise InputError(f"{source}: radar_angle_map: {error}; correct it or remove radar_angle_map") from None


def covariance_parts_document(parts: CovarianceParts | None) -> CovariancePartsDocument | UnsetType:
    """Return the document of the parts; without a measured camera position that part is left out."""
    if parts is None or not np.isfinite(parts.systematic).all():
        return UNSET
    measured = nested(parts.camera_position + 0.0) if parts.camera_position.any() else None
    return CovariancePartsDocument(nested(parts.systematic + 0.0), measured)


def covariance_parts_of(
    document: CovariancePartsDocument | UnsetType | None, *, source: str, place: str = "covariance_parts"
) -> CovarianceParts | None:
    """Return the parts in a document.

    Raises:
        InputError: a part is no covariance.
    """
    if not document:
        return None
    measured = document.camera_position
    return CovarianceParts(
        _part(document.systematic, source=source, place=f"{place}.systematic"),
        np.zeros((6, 6)) if measured is None else _part(measured, source=source, place=f"{place}.camera_position"),
    )


def _part(rows: StatedMatrix, *, source: str, place: str) -> Matrix66:
    part = np.array(rows)
    if not np.isfinite(part).all() or (np.diagonal(part) < 0.0).any():
        raise InputError(
            f"{source}: {place}: a variance on the diagonal is negative or no number; solve the session again"
        )
    return np.asarray(0.5 * (part + part.T))


def provenance_document(provenance: Provenance) -> documents.ProvenanceDocument:
    """Return the document of a provenance."""
    return documents.ProvenanceDocument(
        inputs=list(provenance.inputs),
        topics=documents.TopicsDocument(
            provenance.radar_topic,
            provenance.image_topic,
            provenance.camera_info_topic,
            radar_all=list(provenance.radar_topics) if len(provenance.radar_topics) > 1 else UNSET,
            radar_choice=provenance.radar_choice or UNSET,
        ),
        clocks=documents.ClocksDocument(provenance.radar_clock, provenance.image_clock),
        radar_axes=provenance.radar_axes,
        video_start=provenance.video_start,
        version=provenance.version,
        column_map=list(provenance.column_map) or UNSET,
        assumptions=list(provenance.assumptions) or UNSET,
        unconfirmed=provenance.unconfirmed or UNSET,
        damage=list(provenance.damage) or UNSET,
    )


def provenance_of(document: documents.ProvenanceDocument) -> Provenance:
    """Return the provenance in a document."""
    return Provenance(
        inputs=tuple(document.inputs),
        radar_topic=document.topics.radar,
        radar_topics=_radar_topics(document.topics),
        radar_choice=document.topics.radar_choice or "",
        image_topic=document.topics.image,
        camera_info_topic=document.topics.camera_info,
        radar_clock=document.clocks.radar,
        image_clock=document.clocks.image,
        radar_axes=document.radar_axes,
        video_start=document.video_start,
        version=document.version,
        column_map=tuple(document.column_map or ()),
        assumptions=tuple(document.assumptions or ()),
        unconfirmed=unconfirmed_of(document.unconfirmed),
        damage=tuple(document.damage or ()),
    )


def _radar_topics(topics: documents.TopicsDocument) -> tuple[str, ...]:
    if not isinstance(topics.radar_all, UnsetType):
        return tuple(topics.radar_all)
    return () if topics.radar is None else (topics.radar,)


_DERIVED = (
    ("camera_from_radar", "quaternion_wxyz"),
    ("radar_from_camera",),
    ("sigma",),
    ("pairs", "residual_px"),
    ("pairs", "distance_px"),
)
"""The keys of what follows from other results, without the indices of lists."""
_ROUNDING = 1e-9
"""How far rounding moves a derived number of 1 or less, at most; a larger difference means that what it follows from changed."""


def kept_results(content: Any, document: Any) -> tuple[KeptResult, ...]:
    """Return every key of parsed JSON that a document type does not have, at any depth, and every derived number.

    Args:
        content: parsed JSON that the type has accepted.
        document: the type to compare with.
    """
    return tuple(_kept_results(content, document, ()))


def with_kept(content: dict[str, Any], kept: tuple[KeptResult, ...]) -> dict[str, Any]:
    """Put results back in their places; those whose place is gone or whose number has changed are dropped."""
    for result in kept:
        owner: Any = content
        for step in result.place[:-1]:
            owner = _inside(owner, step)
        if isinstance(owner, dict):
            key, value = result.place[-1], json_value(result.json_text, source="")
            if key not in owner or _is_rounding(owner[key], value):
                owner[key] = value
    return content


def _kept_results(value: Any, annotation: Any, place: tuple[str | int, ...]) -> Iterator[KeptResult]:
    if isinstance(value, list):
        for index, item in enumerate(value):
            yield from _kept_results(item, item_type(annotation), (*place, index))
    fields = fields_of(annotation)
    if not isinstance(value, dict) or fields is None:
        return
    for key, item in value.items():
        inner = (*place, key)
        if key not in fields or (not isinstance(item, dict) and _is_derived(inner)):
            yield KeptResult(inner, json.dumps(item))
        else:
            yield from _kept_results(item, fields[key], inner)


def _is_derived(place: tuple[str | int, ...]) -> bool:
    keys = tuple(step for step in place if isinstance(step, str))
    return any(keys[: len(one)] == one for one in _DERIVED)


def _is_rounding(computed: Any, stated: Any) -> bool:
    """Return whether two values are the same numbers but for rounding."""
    if isinstance(computed, list | tuple) and isinstance(stated, list):
        return len(computed) == len(stated) and all(map(_is_rounding, computed, stated))
    both = isinstance(computed, float) and isinstance(stated, int | float)
    return both and math.isclose(computed, stated, rel_tol=_ROUNDING, abs_tol=_ROUNDING)


def _inside(owner: Any, step: str | int) -> Any:
    if isinstance(owner, dict):
        return owner.get(step)
    within = isinstance(owner, list) and isinstance(step, int) and step < len(owner)
    return owner[step] if within else None


_AGREEMENT_M = 1e-6


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
        rival=pair.rival if pair.rival >= 0 else UNSET,
        expected_covariance_px2=nested(pair.expected_covariance_px2),
        sigma_px=measured.sigma_px if measured else UNSET,
        radar_time=measured.radar_time if measured else UNSET,
        candidates=[_candidate_document(candidate) for candidate in measured.candidates] if measured else UNSET,
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
        rival=-1 if document.rival is UNSET else document.rival,
        expected_covariance_px2=np.array(document.expected_covariance_px2 or [[np.nan] * 2] * 2),
        image_time=document.image_time,
        measured=_pair_of(document, document.candidates) if document.candidates else None,
    )


def _pair_of(document: documents.SolvedPairDocument, candidates: Sequence[documents.CandidateDocument]) -> Pair:
    return Pair(
        id=document.id,
        pixel_px=np.array(document.pixel_px),
        candidates=tuple(_candidate(candidate) for candidate in candidates),
        sigma_px=document.sigma_px or None,
        image_time=document.image_time,
        radar_time=None if document.radar_time is UNSET else document.radar_time,
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
    candidates = document.candidates or []
    for i, candidate in enumerate(candidates):
        if not any(candidate.radar_m):
            raise InputError(
                f"{source}: {place}.candidates[{i}].radar_m: is at the radar's origin; remove the candidate"
            )
    if document.rival is not UNSET and document.rival >= len(candidates):
        raise InputError(f"{source}: {place}.rival: there is no candidate {document.rival}; remove the rival")
    if not candidates:
        return
    chosen = candidates[document.candidate] if document.candidate < len(candidates) else None
    if chosen is None or max(abs(a - b) for a, b in zip(chosen.radar_m, document.radar_m, strict=True)) > _AGREEMENT_M:
        raise InputError(
            f"{source}: {place}.radar_m: is not the position of candidate {document.candidate}; correct one of the two, "
            "or remove the candidates"
        )
