"""calibration-1: a solved calibration as a file, and back."""

import dataclasses
from collections.abc import Iterable
from typing import Any

import msgspec
import numpy as np

from calib_core.advice.angle_map import learn_angle_map
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz, quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import (
    EQUATION,
    CalibrationFile,
    FrameNames,
    Provenance,
    UnknownResult,
    choose_check_point,
)
from calib_core.interchange.own import documents
from calib_core.interchange.own.angle_map_document import angle_map_document, angle_map_of
from calib_core.interchange.own.camera_document import camera_document, camera_of
from calib_core.interchange.own.provenance_document import provenance_document, provenance_of
from calib_core.interchange.own.unknown_results import unknown_results, with_unknown
from calib_core.interchange.syntax.content import decoded
from calib_core.interchange.syntax.json_text import json_text
from calib_core.interchange.syntax.strict_json import json_object, parse_document
from calib_core.measurements import ReflectorClick, TimeNs, Unpaired, time_from_parts, time_parts
from calib_core.results import Calibration, CheckPoint, DataWarning, Metrics, PairResult

__all__ = [
    "AGREEMENT",
    "COVARIANCE_CONVENTION",
    "calibration_file_of",
    "calibration_text",
    "kept_results",
    "read_calibration",
    "transform_of",
    "write_calibration",
]

COVARIANCE_CONVENTION = (
    "6x6, row-major, order (x, y, z, rotX, rotY, rotZ) [m, rad], of the error (dt, dtheta) of camera_from_radar "
    "in camera axes: t = t_hat + dt, R = Exp(dtheta) R_hat"
)
_NAN = float("nan")
AGREEMENT = 1e-5
"""How far two statements of one transform may be apart, in any entry of their matrices."""


def calibration_text(
    calibration: Calibration,
    frames: FrameNames | None = None,
    provenance: Provenance | None = None,
    *,
    clicks: Iterable[ReflectorClick] = (),
) -> str:
    """Write a solved calibration as calibration-1 text: the same input gives the same bytes, and never NaN.

    Args:
        calibration: what the solver returned.
        frames: the names of the two frames; None takes "radar" and "camera_optical".
        provenance: where it comes from.
        clicks: where the pairs carry no stamp of their frame, it is taken from the click of the same id.
    """
    times = {click.id: click.image_time for click in clicks}
    pairs = tuple(
        pair if pair.image_time is not None else dataclasses.replace(pair, image_time=times.get(pair.id))
        for pair in calibration.pairs
    )
    stamped = dataclasses.replace(calibration, pairs=pairs)
    learnt = learn_angle_map(stamped)
    file = CalibrationFile(
        calibration=stamped,
        frames=frames or FrameNames(),
        check_point=choose_check_point(stamped),
        provenance=provenance or Provenance(),
        angle_map=learnt if learnt is not None and learnt.pays else None,
    )
    return write_calibration(file)


def write_calibration(file: CalibrationFile) -> str:
    """Write the content of a calibration-1 file; reading it back and writing it again gives the same bytes."""
    calibration = file.calibration
    sigma = np.sqrt(np.where(np.diag(calibration.covariance) >= 0, np.diag(calibration.covariance), np.nan)).tolist()
    check = file.check_point
    document = documents.CalibrationDocument(
        schema=documents.CALIBRATION_SCHEMA,
        camera_from_radar=_transform_document(calibration.camera_from_radar),
        radar_from_camera=_transform_document(calibration.camera_from_radar.inverse()),
        frames=documents.FramesDocument(file.frames.radar, file.frames.camera),
        equation=EQUATION,
        covariance=_nested(calibration.covariance),
        covariance_convention=COVARIANCE_CONVENTION,
        covariance_quantile=_known(calibration.covariance_quantile),
        sigma=documents.SigmaDocument(*map(_known, sigma)),
        check_point=documents.CheckPointDocument(_nested(check.radar_m), _nested(check.pixel_px)) if check else None,
        metrics=_metrics_document(calibration.metrics),
        noise_scale=documents.NoiseScaleDocument(*calibration.noise_scale),
        radar_angle_map=angle_map_document(file.angle_map),
        paper=documents.PaperDocument(_known(calibration.iterative_px), _known(calibration.sqpnp_px)),
        warnings=[documents.WarningDocument(c.code, c.message, c.hint) for c in calibration.warnings],
        unpaired=[documents.UnpairedDocument(u.id, u.code, u.reason, u.hint) for u in calibration.unpaired],
        pairs=[_pair_document(pair) for pair in calibration.pairs],
        camera=camera_document(calibration.camera),
        options=calibration.options,
        provenance=provenance_document(file.provenance),
    )
    content = msgspec.to_builtins(document)
    known = {key: content[key] for key in _KEY_ORDER if key != "radar_angle_map" or file.angle_map is not None}
    return json_text(with_unknown(known, file.unknown))


_KEY_ORDER = (
    *("schema", "equation", "frames", "camera_from_radar", "radar_from_camera", "check_point", "sigma", "covariance"),
    *("covariance_convention", "covariance_quantile", "metrics", "noise_scale", "radar_angle_map", "paper", "warnings"),
    *("unpaired", "pairs", "camera", "options", "provenance"),
)


def read_calibration(content: str | bytes, source: str = "calibration") -> CalibrationFile:
    """Read calibration-1. Results may carry more keys than we know; the camera and the options may not.

    Raises:
        InputError: the file, the place in it and what to do; also when its two transforms or a quaternion disagree.
    """
    text = decoded(content, source=source)
    document = parse_document(text, documents.CalibrationDocument, source=source)
    camera_from_radar = transform_of(document.camera_from_radar, source=source, place="camera_from_radar")
    if document.radar_from_camera is not None:
        inverse = transform_of(document.radar_from_camera, source=source, place="radar_from_camera").inverse()
        if np.abs(inverse.as_matrix() - camera_from_radar.as_matrix()).max() > AGREEMENT:
            raise InputError(
                f"{source}: radar_from_camera: is not the inverse of camera_from_radar; "
                "cocalib check tells which is wrong: correct it or remove radar_from_camera"
            )
    file = calibration_file_of(document, camera_from_radar, source=source)
    return dataclasses.replace(file, unknown=kept_results(text, source=source))


def kept_results(text: str, *, source: str) -> tuple[UnknownResult, ...]:
    """Return what a calibration-1 file says beyond what this version knows."""
    return unknown_results(json_object(text, source=source), documents.CalibrationDocument)


def calibration_file_of(
    document: documents.CalibrationDocument, camera_from_radar: RigidTransform, *, source: str
) -> CalibrationFile:
    """Return what a parsed calibration-1 file says, under a given pose.

    Raises:
        InputError: the camera or a frame's name cannot be like that.
    """
    check = document.check_point
    scale = document.noise_scale
    calibration = Calibration(
        camera_from_radar=camera_from_radar,
        covariance=np.array(document.covariance or np.full((6, 6), np.nan)),
        camera=camera_of(document.camera, source=source),
        metrics=_metrics(document.metrics),
        pairs=tuple(_pair(pair) for pair in document.pairs),
        unpaired=tuple(Unpaired(u.id, u.code, u.reason, u.hint) for u in document.unpaired),
        warnings=tuple(DataWarning(c.code, c.message, c.hint) for c in document.warnings),
        options=document.options,
        noise_scale=(scale.click, scale.range, scale.azimuth, scale.elevation),
        covariance_quantile=_number(document.covariance_quantile),
        iterative_px=_number(document.paper.iterative_px),
        sqpnp_px=_number(document.paper.sqpnp_px),
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
        angle_map=angle_map_of(document.radar_angle_map, source=source),
    )


def transform_of(document: documents.TransformDocument, *, source: str, place: str) -> RigidTransform:
    """Return the transform an object carries.

    Raises:
        InputError: the rotation is none (mirrored, or not orthonormal), or the quaternion is another one.
    """
    try:
        transform = RigidTransform(np.array(document.rotation), np.array(document.translation_m))
    except ValueError as error:
        raise InputError(f"{source}: {place}.rotation: {error}; a rotation is needed") from None
    if document.quaternion_wxyz is not None and not _same_rotation(document.quaternion_wxyz, transform):
        raise InputError(
            f"{source}: {place}.quaternion_wxyz: is another rotation than {place}.rotation; "
            "the order is w, x, y, z: correct one of the two"
        )
    return transform


def _same_rotation(quaternion_wxyz: tuple[float, ...], transform: RigidTransform) -> bool:
    quaternion = np.array(quaternion_wxyz)
    if not quaternion.any():
        return False
    return bool(np.abs(matrix_from_quaternion_wxyz(quaternion) - transform.rotation).max() <= AGREEMENT)


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _number(value: float | None) -> float:
    return _NAN if value is None else value


def _nested(array: np.ndarray) -> Any:
    """Return an array as nested tuples; None when any of it is unknown."""
    if not np.isfinite(array).all():
        return None
    return tuple(map(tuple, array.tolist())) if array.ndim == 2 else tuple(array.tolist())


def _transform_document(transform: RigidTransform) -> documents.TransformDocument:
    return documents.TransformDocument(
        rotation=_nested(transform.rotation + 0.0),
        translation_m=_nested(transform.translation_m + 0.0),
        quaternion_wxyz=_nested(quaternion_wxyz_from_matrix(transform.rotation) + 0.0),
    )


def _metrics_document(metrics: Metrics) -> documents.MetricsDocument:
    return documents.MetricsDocument(
        aed_px=_known(metrics.aed_px),
        cdsd_px=_known(metrics.cdsd_px),
        rms_px=_known(metrics.rms_px),
        held_out_aed_px=_known(metrics.held_out_aed_px),
        acc=None if metrics.acc is None else _known(metrics.acc),
        n=metrics.n,
        chi2=_known(metrics.chi2),
        degrees_of_freedom=metrics.degrees_of_freedom,
    )


def _metrics(document: documents.MetricsDocument) -> Metrics:
    return Metrics(
        aed_px=_number(document.aed_px),
        cdsd_px=_number(document.cdsd_px),
        rms_px=_number(document.rms_px),
        n=document.n,
        held_out_aed_px=_number(document.held_out_aed_px),
        acc=document.acc,
        chi2=_number(document.chi2),
        degrees_of_freedom=document.degrees_of_freedom,
    )


def _pair_document(pair: PairResult) -> documents.SolvedPairDocument:
    return documents.SolvedPairDocument(
        id=pair.id,
        image_time=None if pair.image_time is None else documents.TimeDocument(*time_parts(pair.image_time)),
        radar_m=_nested(pair.point_radar_m),
        pixel_px=_nested(pair.pixel_px),
        projected_px=_nested(pair.projected_px),
        residual_px=_nested(pair.residual_px),
        distance_px=_known(pair.distance_px),
        inlier=bool(pair.inlier),
        excluded=bool(pair.excluded),
        outlier_probability=_known(pair.outlier_probability),
        influence=_known(pair.influence),
        candidate=int(pair.candidate),
        expected_covariance_px2=_nested(pair.expected_covariance_px2),
    )


def _pair(document: documents.SolvedPairDocument) -> PairResult:
    time = document.image_time
    return PairResult(
        id=document.id,
        pixel_px=np.array(document.pixel_px),
        projected_px=np.array(document.projected_px or (_NAN, _NAN)),
        point_radar_m=np.array(document.radar_m),
        inlier=document.inlier,
        excluded=document.excluded,
        outlier_probability=_number(document.outlier_probability),
        influence=_number(document.influence),
        candidate=document.candidate,
        expected_covariance_px2=np.array(document.expected_covariance_px2 or [[_NAN] * 2] * 2),
        image_time=None if time is None else TimeNs(time_from_parts(time.sec, time.nanosec)),
    )
