"""The fields of the export panel: frame names are written and checked, and a refusal names its field."""

from dataclasses import replace

import pytest

from calib_core.interchange import FrameNames, export, read_any
from calib_core.interchange.own.calibration_json import calibration_sha256
from cocalib.web.channel.export_preview import export_preview, exported
from cocalib.web.exports.query import FieldError, fields_in


@pytest.mark.parametrize("key", ["json", "tf2", "urdf", "autoware", "opencv", "matlab", "pjlab"])
def test_the_names_of_the_query_are_those_in_the_file(file, key):
    written = exported(file, key, "radar_frame=front_radar&camera_frame=%2Ffront%2Fcamera_optical")
    assert read_any(written.data).frames == FrameNames("front_radar", "front/camera_optical")
    assert written.data == export(file, key, frames=FrameNames("front_radar", "front/camera_optical")).data
    if key != "json":
        assert read_any(written.data).calibration_sha256 == calibration_sha256(file), "its origin keeps its own names"
    made = export_preview(file, key, "radar_frame=front_radar", "drive")
    assert made.check_is_good
    assert "front_radar" in made.pose.words
    assert (made.radar_frame, made.camera_frame) == (file.frames.radar, file.frames.camera)


@pytest.mark.parametrize(
    ("query", "field", "words"),
    [
        ("radar_frame=", "frames", "radar frame has no name"),
        ("camera_frame=a%24b", "frames", "camera frame is called"),
        ("radar_frame=same&camera_frame=same", "frames", "different names"),
        ("radar_frame=..", "frames", "is a path"),
        ("parent_from_radar=1,2", "parent", "seven"),
        ("parent_from_radar=x,0,0,0,0,0,1", "parent", "seven numbers"),
        ("rectified=yes", "rectified", "neither 0 nor 1"),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_name_of_its_field(query, field, words):
    with pytest.raises(FieldError, match=words) as refused:
        fields_in(query, FrameNames())
    assert refused.value.field == field


def test_a_lens_that_no_maps_can_rectify_asks_whether_the_pictures_are_rectified(file):
    camera = replace(file.calibration.camera, model="plumb_bob", distortion=[-5000.0, 0, 0, 0, 0])
    distorted = replace(file, calibration=replace(file.calibration, camera=camera))
    with pytest.raises(FieldError, match="no rectified picture") as refused:
        exported(distorted, "kitti", "")
    assert refused.value.field == "rectified"


def test_no_query_leaves_the_calibration_s_own_names():
    usual = FrameNames("r", "c")
    fields = fields_in("", usual)
    assert (fields.frames, fields.parent_from_radar, fields.rectified) == (usual, None, False)
