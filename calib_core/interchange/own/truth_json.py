"""The ground truth of a simulation (truth-1), read for comparison with a calibration; only the simulator writes it."""

from collections.abc import Mapping

from calib_core.interchange.format import TRUTH_FORMAT, Format, ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.own.documents import CameraDocument, TransformDocument, camera_of, transform_of
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.strict_json import checked

_SCHEMA = "cocalib/truth-1"


def _recognizes(content: Content) -> bool:
    return content.json_mapping.get("schema") == _SCHEMA


def _read(content: Content, source: str) -> ImportedCalibration:
    truth = content.mapping
    stated = checked(truth.get("camera_from_radar") or {}, TransformDocument, source=source, place="camera_from_radar")
    pose = transform_of(stated, source=source, place="camera_from_radar")
    camera = truth.get("camera")
    return ImportedCalibration(
        TRUTH_FORMAT,
        WrittenPose("matrix", pose.rotation, pose.translation_m, "camera_from_radar"),
        camera=camera_of(checked(camera, CameraDocument, source=source, place="camera"), source=source)
        if isinstance(camera, Mapping)
        else None,
    )


TRUTH = Format(
    name=TRUTH_FORMAT,
    title="ground truth of a simulation (truth-1)",
    numbers="camera_from_radar as matrix, translation and quaternion w x y z",
    file_name="truth.json",
    camera="lens",
    comment="keys",
    write=None,
    reads=Reads(_recognizes, _read),
)
