"""calibration-1 as a format of the registry, read so that a check can report which part of a file is wrong."""

from dataclasses import replace

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.imported import ImportedCalibration, WrittenPose, imported
from calib_core.interchange.own.calibration_json import (
    calibration_file_of,
    kept_results_of,
    write_calibration,
)
from calib_core.interchange.own.documents import CalibrationDocument, TransformDocument
from calib_core.interchange.own.transform_document import are_inverse, transform_of
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.strict_json import parse_document


def _recognizes(content: Content) -> bool:
    return str(content.json_mapping.get("schema", "")).startswith("cocalib/calibration-")


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read calibration-1 and return its contradictions as faults."""
    document = parse_document(content.text, CalibrationDocument, source=source)
    stated = document.camera_from_radar
    bare = TransformDocument(stated.rotation, stated.translation_m)
    pose = transform_of(bare, source=source, place="camera_from_radar")
    faults = []
    try:
        transform_of(stated, source=source, place="camera_from_radar")
    except InputError:
        faults.append("camera_from_radar.quaternion_wxyz and camera_from_radar.rotation are different rotations")
    if document.radar_from_camera is not None:
        try:
            if not are_inverse(stated, document.radar_from_camera, source=source, place="radar_from_camera"):
                faults.append("radar_from_camera is not the inverse of camera_from_radar")
        except InputError:
            faults.append("radar_from_camera has contradictory rotations, or an invalid one")
    file = calibration_file_of(document, pose, source=source)
    kept = kept_results_of(content.text, source=source)
    as_written = WrittenPose("matrix", np.array(stated.rotation), np.array(stated.translation_m), "camera_from_radar")
    return replace(imported(replace(file, kept=kept)), pose=as_written, faults=tuple(faults))


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
    holds_angle_map=True,
)
