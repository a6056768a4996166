"""What a pose rests on is said in every file, and reading a file never raises it."""

import dataclasses
import io
import json
import zipfile

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import EVIDENCE_LEVELS, CalibrationFile
from calib_core.interchange.check.pair_residuals import read_check_pairs
from calib_core.interchange.check.report import check
from calib_core.interchange.exporting import export
from calib_core.interchange.format import Format, ImportedCalibration, imported
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import adoption, read_any
from calib_core.interchange.own.calibration_json import calibration_sha256, read_calibration, write_calibration
from calib_core.interchange.statement import stated_origin


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


def test_an_unknown_level_is_refused(golden_text):
    content = json.loads(golden_text) | {"evidence": "certain"}
    with pytest.raises(InputError, match="evidence"):
        read_calibration(json.dumps(content))


def test_an_export_states_figures_and_verdict(file):
    text = text_of(file, "tf2")
    metrics = file.calibration.metrics
    assert f"AED {metrics.aed_px:.3g} px over {metrics.n} pairs" in text
    assert "in camera axes: x," in text


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
    assert adoption(found, "t.yml", camera=file.calibration.camera).file.rests_on == "imported_assumed"


def test_a_bare_matrix_is_assumed_and_a_check_point_proves_a_file(file):
    camera = file.calibration.camera
    assert adoption(read_any(bare(file)), "m.txt", camera=camera).file.rests_on == "imported_assumed"
    assert adoption(read_any(text_of(file, "tf2")), "t.sh", camera=camera).file.rests_on == "imported_proven"


def test_what_was_assumed_stays_assumed_through_a_check_point_of_its_own(file):
    assumed = adoption(read_any(bare(file)), "m.txt", camera=file.calibration.camera).file
    again = adoption(read_any(text_of(assumed, "tf2")), "t.sh", camera=file.calibration.camera).file
    assert again.rests_on == "imported_assumed"
    assert adoption(read_any(write_calibration(assumed)), "c.json").file.rests_on == "imported_assumed"


def test_pairs_or_a_calibration_prove_what_a_file_means(golden_text, file):
    found, camera = read_any(bare(file)), file.calibration.camera
    pairs = read_check_pairs(golden_text)
    for proof in ({"pairs": pairs}, {"against": imported(file)}):
        assert adoption(found, "m.txt", camera=camera, **proof).file.rests_on == "imported_proven"
    assumed = adoption(found, "m.txt", camera=camera).file
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
    assert adoption(found, "f", camera=camera).file.calibration.camera.matrix_px.tolist() == camera.matrix_px.tolist()
    with pytest.raises(InputError, match=r"states a camera other than the given one .* --replace-camera"):
        adoption(found, "f", camera=other)
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
    assert found.frames.camera == optical_frame
    assert bool(found.assumptions) == ("optical" not in child)


def test_the_file_that_was_imported_is_named_without_its_folder(file):
    made = adoption(read_any(bare(file)), "secret/m.txt", camera=file.calibration.camera).file
    said = next(one.facts["message"] for one in made.calibration.warnings if one.code == "imported")
    assert "imported from m.txt" in said
    assert "secret" not in said


# Every file states what its pose rests on, which calibration it is made from, and its check point; reading finds them.


OTHERS = [known for known in FORMATS if known.name != "json"]


@pytest.fixture(scope="module")
def proven(file: CalibrationFile) -> CalibrationFile:
    return dataclasses.replace(file, evidence="imported_proven")


def read_back(proven: CalibrationFile, known: Format) -> ImportedCalibration:
    return read_any(export(proven, known.name, rectified=known.is_for_rectified).data)


@pytest.mark.parametrize("known", OTHERS, ids=lambda known: known.name)
def test_a_file_states_its_evidence_its_calibration_and_its_check_point(proven, known):
    found = read_back(proven, known)
    point, check_point = proven.check_point, found.check_point

    assert found.evidence == "imported_proven"
    assert found.calibration_sha256 == calibration_sha256(proven)
    assert found.assumptions == ()
    np.testing.assert_array_equal(check_point.radar_m, point.radar_m)
    if check_point.camera_m is not None:
        seen_m = proven.calibration.camera_from_radar @ point.radar_m[None]
        np.testing.assert_allclose(check_point.camera_m, seen_m[0], rtol=0, atol=1e-12)
    if not known.is_for_rectified:
        assert check_point.pixel_px is not None
        np.testing.assert_array_equal(check_point.pixel_px, point.pixel_px)
    if known.comment != "numbers":
        assert found.frames == proven.frames
    assert check(found, camera=proven.calibration.camera).verdict == "right"


@pytest.mark.parametrize("level", EVIDENCE_LEVELS)
def test_kitti_states_each_level_as_a_number(proven, level):
    one = dataclasses.replace(proven, evidence=level)
    kitti = next(known for known in FORMATS if known.name == "kitti")

    assert read_back(one, kitti).evidence == level


def test_what_is_not_a_number_of_ours_in_a_kitti_file_states_nothing(proven):
    lines = export(proven, "kitti", rectified=True).data.decode().splitlines()

    def with_line(key: str, value: str) -> ImportedCalibration:
        return read_any("\n".join(f"{key}: {value}" if line.startswith(f"{key}:") else line for line in lines))

    assert with_line("cocalib_evidence", "7").evidence is None
    for value in ("1 2 3", " ".join(["256"] * 32), " ".join(["-1"] * 32), " ".join(["1.0"] * 32)):
        assert with_line("cocalib_calibration_sha256", value).calibration_sha256 is None


def test_a_file_of_another_tool_states_nothing(proven):
    archive = zipfile.ZipFile(io.BytesIO(export(proven, "nuscenes", rectified=True).data))
    radar, camera = json.loads(archive.read("calibrated_sensor.json"))
    for key in (None, 3, ["no statement", 4], {"a": 1}):
        found = read_any(json.dumps([radar, {**camera, "cocalib": key}]))
        assert (found.evidence, found.calibration_sha256, found.check_point) == (None,) * 3
        assert found.assumptions


def test_the_covariance_survives_arrays_with_its_order(proven):
    covariance = np.diag([1.0, 2, 3, 4, 5, 6]) * 1e-6
    covariance[0, 4] = covariance[4, 0] = 3e-7
    calibration = dataclasses.replace(proven.calibration, covariance=covariance)
    found = read_any(export(dataclasses.replace(proven, calibration=calibration), "matlab").data)

    assert found.covariance is not None
    np.testing.assert_array_equal(found.covariance, covariance)
    np.testing.assert_array_equal(adoption(found, "file").file.calibration.covariance, covariance)


def test_a_covariance_in_an_unknown_order_is_not_taken_for_ours(proven):
    pose = proven.calibration.camera_from_radar.as_matrix()
    for convention in ({}, {"covariance_convention": np.array("rotX, rotY, rotZ, x, y, z")}):
        buffer = io.BytesIO()
        np.savez(buffer, camera_from_radar=pose, covariance=np.eye(6), **convention)
        assert read_any(buffer.getvalue()).covariance is None
