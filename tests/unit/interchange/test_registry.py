"""The table of formats: every writer has a reader, and the readers are tried in one order."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, choose_check_point
from calib_core.interchange.exporting import export, export_all
from calib_core.interchange.formats.registry import FORMATS, format_named, readers, written_formats
from calib_core.interchange.importing import read_any
from calib_core.interchange.syntax.content import Content, readings
from calib_core.interchange.syntax.zip_archives import pack


def test_every_reader_is_tried():
    assert {known.reads for known in FORMATS} < set(readers())


@pytest.mark.parametrize(
    ("content", "syntaxes"),
    [
        (pack({"a.txt": b""}), ["archive"]),
        (b"\xff\xff\x80", ["bytes"]),
        (b'\xef\xbb\xbf{"a": 1}', ["json"]),
        ("[]", ["json"]),
        (" <robot/>", ["xml"]),
        ("a: 1\r\n", ["lines", "yaml"]),
        ("a: 1".encode("utf-16"), ["lines", "yaml"]),
        ("", ["lines", "yaml"]),
    ],
)
def test_the_syntax_is_determined_by_the_first_bytes(content, syntaxes):
    assert [reading.syntax for reading in readings(content, source="file")] == syntaxes


def test_what_a_syntax_does_not_have_is_empty():
    (xml,) = readings("<robot/>", source="file")
    lines, yaml = readings("# words\n\na: 1\n", source="file")

    assert (xml.root.tag, dict(xml.mapping), xml.lines) == ("robot", {}, ())
    assert (lines.lines, dict(lines.mapping), lines.root.tag) == (("a: 1",), {}, "")
    assert (dict(yaml.mapping), dict(yaml.json_mapping)) == ({"a": 1}, {})
    assert dict(Content("json", value=[1]).mapping) == {}


@pytest.mark.parametrize(
    ("content", "name"),
    [
        ("# generate_launch_description\narguments=['0','0','0','0','0','0','radar','camera']", "tf2-launch-py"),
        (
            '{"parent_frame_id": "radar", "child_frame_id": "camera", "translation": {"x": 0, "y": 0, "z": 0}, '
            '"rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}',
            "foxglove",
        ),
        ("R: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [0, 0, 0]\nchild_frame_id: camera\n", "opencv"),
    ],
)
def test_content_that_fits_two_formats_is_read_as_the_more_specific_one(content, name):
    if name == "tf2-launch-py":
        content = content.replace("arguments", "static_transform_publisher(arguments") + ")"

    assert read_any(content).format == name


@pytest.mark.parametrize("name", ["tf2", "tf2-launch-py", "urdf"])
def test_a_frame_that_a_driver_publishes_gets_a_note_on_its_second_parent(file, name):
    def notes(camera: str) -> list[str]:
        written = export(dataclasses.replace(file, frames=FrameNames("radar", camera)), name)
        return [note for note in written.notes if "two parents" in note]

    assert notes("camera_optical") == []
    (note,) = notes("camera_color_optical_frame")
    assert "camera_color_optical_frame under its camera_link" in note
    assert "--tree" in note


# Every format at once: those that can represent a calibration are written, the others say why not.


@pytest.fixture
def with_k3(file: CalibrationFile) -> CalibrationFile:
    """Return a calibration whose camera uses k3, which Kalibr cannot store."""
    camera = replace(file.calibration.camera, distortion=np.array([-0.39, 0.17, -0.004, 0.002, 0.05]))
    calibration = replace(file.calibration, camera=camera, pairs=())
    return replace(file, calibration=calibration, check_point=choose_check_point(calibration))


@pytest.mark.parametrize("rectified", [False, True])
def test_each_format_is_written_as_alone_or_refused_as_alone(with_k3, rectified):
    written, refused = export_all(with_k3, rectified=rectified)

    assert {*written, *(one.name for one in refused)} == {known.name for known in written_formats()}
    assert "kalibr" in {one.name for one in refused}
    for name, made in written.items():
        assert made == export(with_k3, name, rectified=rectified and format_named(name).is_for_rectified)
        assert format_named(name).reads is None or read_any(made.data).format == name
    for one in refused:
        with pytest.raises(InputError) as alone:
            export(with_k3, one.name, rectified=rectified and format_named(one.name).is_for_rectified)
        assert one.reason == str(alone.value)
