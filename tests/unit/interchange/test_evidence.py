"""What a pose rests on is said in every file, and reading a file never raises it."""

import dataclasses
import json

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import (
    CalibrationFile,
    adopt,
    adoption,
    export,
    format_named,
    imported,
    read_any,
    read_calibration,
    read_check_pairs,
    write_calibration,
)
from calib_core.interchange.origin import stated_origin
from calib_core.interchange.own.calibration_json import calibration_sha256


def text_of(file: CalibrationFile, name: str) -> str:
    return export(file, name, rectified=format_named(name).is_for_rectified).data.decode()


def bare(file: CalibrationFile, *, inverse: bool = False) -> str:
    pose = file.calibration.camera_from_radar
    rows = (pose.inverse() if inverse else pose).as_matrix()
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())


def test_a_file_without_the_key_was_clicked_if_it_has_solved_pairs_and_assumed_if_not(golden_text, file):
    assert "evidence" not in json.loads(golden_text)
    assert file.rests_on == "clicked"
    content = json.loads(golden_text)
    content["pairs"] = []
    assert read_calibration(json.dumps(content)).rests_on == "imported_assumed"


@pytest.mark.parametrize("level", ["clicked", "imported_proven", "imported_assumed"])
def test_the_level_is_kept_in_calibration_1(file, level):
    text = write_calibration(dataclasses.replace(file, evidence=level))
    assert json.loads(text)["evidence"] == level
    assert read_calibration(text).rests_on == level


def test_an_unknown_level_is_refused(golden_text):
    content = json.loads(golden_text) | {"evidence": "certain"}
    with pytest.raises(InputError, match="evidence"):
        read_calibration(json.dumps(content))


def test_an_export_states_figures_verdict_and_warnings(file):
    text = text_of(file, "tf2")
    metrics = file.calibration.metrics
    assert f"AED {metrics.aed_px:.3g} px over {metrics.n} pairs" in text
    assert "sigma of camera_from_radar in camera axes: x, y, z" in text
    assert all(warning.code in text for warning in file.calibration.warnings)


def test_what_a_text_states_in_other_words_is_no_origin():
    assert stated_origin("evidence: clicked") == stated_origin("")


@pytest.mark.parametrize("level", ["certain", "imported-assumed"])
def test_a_level_that_is_not_known_counts_as_the_weakest(level):
    text = f"evidence: {level}; from the calibration with sha256 {'0' * 64}"
    assert stated_origin(text).evidence == "imported_assumed"


def test_opencvs_storage_keeps_the_evidence_where_a_program_writes_it_again_without_comments(file):
    assumed = dataclasses.replace(file, evidence="imported_assumed")
    rewritten = "".join(line for line in text_of(assumed, "opencv").splitlines(keepends=True) if line[0] != "#")
    found = read_any(rewritten)
    assert (found.evidence, found.calibration_sha256) == ("imported_assumed", calibration_sha256(assumed))
    assert found.check_point is not None
    assert adopt(found, "t.yml", camera=file.calibration.camera).rests_on == "imported_assumed"


def test_a_bare_matrix_is_assumed_and_a_check_point_proves_a_file(file):
    camera = file.calibration.camera
    assert adopt(read_any(bare(file)), "m.txt", camera=camera).rests_on == "imported_assumed"
    assert adopt(read_any(text_of(file, "tf2")), "t.sh", camera=camera).rests_on == "imported_proven"


def test_an_inverted_matrix_is_doubtful_and_assumed(file):
    adopted = adoption(read_any(bare(file, inverse=True)), "m.txt", camera=file.calibration.camera)
    assert (adopted.report.verdict, adopted.file.rests_on) == ("doubtful", "imported_assumed")


def test_what_was_assumed_stays_assumed_through_a_check_point_of_its_own(file):
    assumed = adopt(read_any(bare(file)), "m.txt", camera=file.calibration.camera)
    again = adopt(read_any(text_of(assumed, "tf2")), "t.sh", camera=file.calibration.camera)
    assert again.rests_on == "imported_assumed"
    assert adopt(read_any(write_calibration(assumed)), "c.json").rests_on == "imported_assumed"


def test_pairs_or_a_calibration_prove_what_a_file_means(golden_text, file):
    found, camera = read_any(bare(file)), file.calibration.camera
    pairs = read_check_pairs(golden_text)
    for proof in ({"pairs": pairs}, {"against": imported(file)}):
        assert adoption(found, "m.txt", camera=camera, **proof).file.rests_on == "imported_proven"
    assumed = adopt(found, "m.txt", camera=camera)
    proven = adoption(imported(assumed), "c.json", pairs=pairs).file
    assert proven.rests_on == "imported_proven"
    wrong = read_any(bare(file, inverse=True))
    with pytest.raises(InputError, match="direction is swapped"):
        adoption(wrong, "m.txt", camera=camera, pairs=pairs)


@pytest.mark.parametrize("name", ["kitti", "nuscenes", "opencv"])
def test_another_camera_than_the_files_is_refused(file, name):
    camera = file.calibration.camera
    found = read_any(export(file, name, rectified=format_named(name).is_for_rectified).data)
    moved_px = np.array([[0.0, 0.0, 8.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    other = Camera(camera.model, camera.width_px, camera.height_px, camera.matrix_px + moved_px, camera.distortion)
    assert adopt(found, "f", camera=camera).calibration.camera.matrix_px.tolist() == camera.matrix_px.tolist()
    with pytest.raises(InputError, match=r"states a camera .* other than the given one .* --replace-camera"):
        adopt(found, "f", camera=other)
    assert adoption(found, "f", camera=other, replace_camera=True).file.calibration.camera is other


def command(child: str, pose: str) -> str:
    return f"ros2 run tf2_ros static_transform_publisher {pose} --frame-id radar --child-frame-id {child}\n"


IDENTITY = "--x 0.1 --qw 1"
OPTICAL = "--x 0.1 --qx -0.5 --qy 0.5 --qz -0.5 --qw 0.5"


@pytest.mark.parametrize(
    ("child", "pose", "axes", "optical_frame"),
    [
        ("camera_color_frame", IDENTITY, "link", "camera_color_optical_frame"),
        ("camera_link", IDENTITY, "link", "camera_optical"),
        ("camera", IDENTITY, "link", "camera_optical"),
        ("camera", OPTICAL, "optical", "camera"),
        ("camera_link", OPTICAL, "optical", "camera_link"),
        ("camera_optical_frame", IDENTITY, "optical", "camera_optical_frame"),
    ],
)
def test_a_frame_without_optical_has_body_axes_unless_its_numbers_fit_optical_ones_alone(
    child, pose, axes, optical_frame
):
    found = read_any(command(child, pose))
    assert found.pose.axes == axes
    assert found.frames is not None
    assert found.frames.camera == optical_frame
    assert bool(found.assumptions) == ("optical" not in child)


def test_the_file_that_was_imported_is_named_without_its_folder(file):
    made = adopt(read_any(bare(file)), "secret/m.txt", camera=file.calibration.camera)
    said = next(one.message for one in made.calibration.warnings if one.code == "imported")
    assert "imported from m.txt" in said
    assert "secret" not in said
