"""A check finds and names the slip that turned a right calibration into a wrong file."""

import dataclasses
import io
import json
import os
import re
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.cameras.files import read_camera
from calib_core.interchange.check.agreement import compare
from calib_core.interchange.check.report import CheckedFile, check, check_json
from calib_core.interchange.exporting import contents_text, export
from calib_core.interchange.format import imported
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import adoption, read_any, read_any_file
from calib_core.interchange.own.calibration_json import calibration_file, write_calibration
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.syntax.mat_file import load_mat
from calib_core.interchange.syntax.zip_archives import pack, unpack


def text_of(file: CalibrationFile, name: str) -> str:
    return export(file, name, rectified=format_named(name).is_for_rectified).data.decode()


def without_comments(text: str) -> str:
    return "".join(line for line in text.splitlines(keepends=True) if not line.startswith("#"))


def npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def codes(text: str | bytes, against: CalibrationFile | None = None) -> list[str]:
    report = check(read_any(text), against=imported(against) if against else None)
    assert report.ok == (not any(result.level == "error" for result in report.results))
    return [result.code for result in report.results if result.level == "error"]


@pytest.mark.parametrize("name", ["json", "kalibr", "opencv", "kitti", "matrix", "matlab", "numpy"])
def test_a_left_handed_rotation_is_refused_in_every_format_of_matrices(file, name):
    first_row = file.calibration.camera_from_radar.rotation[0]
    if name == "numpy":
        matrix = file.calibration.camera_from_radar.as_matrix()
        data = npz(camera_from_radar=np.diag([-1.0, 1.0, 1.0, 1.0]) @ matrix)
    elif name == "matlab":
        data = export(file, name).data
        for number in first_row.tolist():
            data = data.replace(np.float64(number).tobytes(), np.float64(-number).tobytes())
    else:
        head, start, body = text_of(file, name).partition(repr(float(first_row[0])))
        for number in first_row.tolist():
            body = (start + body).replace(repr(number), repr(-number), 1)
            start = ""
        data = (head + body).encode()

    with pytest.raises(InputError, match=r"file: .*left-handed.*an axis is mirrored"):
        read_any(data, "file")


def test_numbers_changed_without_a_known_slip_are_reported_as_such(file):
    text = text_of(file, "matrix").replace("-0.0608874", "0.4391126")

    report = check(read_any(text))

    assert [result.code for result in report.results if result.level == "error"] == ["check-point-missed"]
    assert not report.ok
    assert any(line.startswith("WRONG: ") and "(5, 1, -0.5) m" in line for line in report.lines())


def test_pairs_that_were_changed_after_solving_are_found(file):
    content = json.loads(write_calibration(file))
    content["pairs"][2]["radar_m"][1] += 0.1
    assert codes(json.dumps(content)) == ["pairs-disagree"]

    content = json.loads(write_calibration(file))
    content["metrics"]["aed_px"] = 0.1
    assert codes(json.dumps(content)) == ["metrics-disagree"]


def test_a_camera_that_lies_on_its_side_is_doubtful_where_its_axes_are_assumed():
    optical_in_radar = rotation_exp(np.array([0, 0, np.radians(95)])) @ np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    x, y, z, w = quaternion_xyzw_from_matrix(optical_in_radar)
    text = f"static_transform_publisher 1 0 0 {x} {y} {z} {w} radar camera_left"

    report = check(read_any(text, "file"))

    assert [result.code for result in report.results if result.level == "warning"] == ["on-its-side"]
    assert report.verdict == "doubtful"
    assert check(read_any(text.replace("camera_left", "camera_left_optical"))).results[0].code == "looks-elsewhere"


@pytest.mark.parametrize(
    "text",
    [
        "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
        '<robot name="car"><link name="radar"/><link name="camera_link"/><joint name="j" type="fixed"><parent link="radar"/>'
        '<child link="camera_link"/><origin xyz="0 0 0" rpy="0 0 0"/></joint></robot>',
    ],
    ids=["matrix", "urdf"],
)
def test_the_identity_of_a_template_is_doubtful(text):
    report = check(read_any(text, "file"))

    assert "placeholder" in [result.code for result in report.results if result.level == "warning"]
    assert report.verdict == "doubtful"


def test_a_check_point_in_pixels_without_a_camera_is_reported_as_unused(file):
    text = text_of(file, "opencv").replace("image_width: 640\n", "")
    text = without_comments(text)

    without = check(read_any(text))
    with_camera = check(read_any(text), camera=file.calibration.camera)

    assert [result.code for result in without.results] == ["check-point-unused"]
    assert [result.code for result in with_camera.results] == ["check-point"]


def test_a_fresh_file_with_two_clicks_of_one_placement_states_the_aed_of_its_placements(file):
    drawn = simulate_pairs(12, rng=np.random.default_rng(3), noise="imaging", camera=file.calibration.camera)
    again = [
        dataclasses.replace(pair, id=f"{pair.id}-again", pixel_px=pair.pixel_px + np.array([3.0, -2.0]))
        for pair in drawn.pairs[:3]
    ]
    solved = calibrate_pairs([*drawn.pairs, *again], drawn.camera).unwrap()
    assert solved.metrics.n == 12
    fresh = calibration_file(solved)
    edited = dataclasses.replace(
        solved, metrics=dataclasses.replace(solved.metrics, aed_px=solved.metrics.aed_px + 0.2)
    )

    assert check(imported(fresh)).verdict == "right"
    (wrong,) = (one for one in check(imported(calibration_file(edited))).results if one.level == "error")
    assert wrong.code == "metrics-disagree"
    assert "placements that agree average" in wrong.message


def test_two_calibrations_are_compared_in_degrees_centimetres_and_pixels(file):
    moved = file.calibration.camera_from_radar.perturbed(np.array([0, 0, 0, 0, np.radians(1.0), 0]))
    shifted = RigidTransform(
        file.calibration.camera_from_radar.rotation,
        file.calibration.camera_from_radar.translation_m + np.array([0.1, 0, 0]),
    )

    def with_pose(pose: RigidTransform) -> CalibrationFile:
        return dataclasses.replace(file, calibration=dataclasses.replace(file.calibration, camera_from_radar=pose))

    turned = compare(imported(file), imported(with_pose(moved)))
    aside = compare(imported(file), imported(with_pose(shifted)))

    assert turned.rotation_deg == pytest.approx(1.0)
    # sqrt(2) for two covariances of a standard deviation of sqrt(2e-6) rad about y
    assert turned.rotation_sigma_deg == pytest.approx(np.degrees(np.sqrt(2 * 2e-6)))
    assert turned.pixels[2].rms_px == pytest.approx(turned.pixels[0].rms_px, rel=0.01)
    assert aside.rotation_deg == pytest.approx(0.0, abs=1e-9)
    assert aside.position_cm == pytest.approx(10.0)
    assert aside.position_sigma_cm == pytest.approx(100 * np.sqrt(2e-4), rel=0.01)
    at_5, at_20, at_60 = aside.pixels
    assert at_5.rms_px == pytest.approx(12 * at_60.rms_px, rel=0.05)
    assert (at_5.distance_m, at_20.distance_m, at_60.distance_m) == (5.0, 20.0, 60.0)
    assert aside.change.squared == pytest.approx(0.1**2 * np.linalg.inv(2 * file.calibration.covariance)[0, 0])


@pytest.mark.slow
def test_the_pixel_uncertainty_is_what_scattered_poses_show(file):
    rng = np.random.default_rng(4)
    calibration = file.calibration
    expected = compare(imported(file), read_any(text_of(file, "tf2"))).pixels
    squares = []
    for _ in range(60):
        error = rng.multivariate_normal(np.zeros(6), calibration.covariance)
        pose = dataclasses.replace(calibration, camera_from_radar=calibration.camera_from_radar.perturbed(error))
        other = compare(imported(file), imported(dataclasses.replace(file, calibration=pose)))
        squares.append([at.rms_px**2 for at in other.pixels])

    np.testing.assert_allclose(np.sqrt(np.mean(squares, axis=0)), [at.sigma_px for at in expected], rtol=0.15)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "the file is empty"),
        ("no pose at all", "found text"),
        ("Größe: 1".encode("latin-1"), "save it as UTF-8"),
        ("hello: world", "no pose of a camera and a radar in it .*found hello"),
        ("{}", "no pose of a camera and a radar in it"),
        ("[]", "no pose of a camera and a radar"),
        (b"\xff\xfe\x00", "not a text file in UTF-8; give a calibration"),
        (b"PK\x03\x04broken", "a damaged zip archive"),
        (b"MATLAB 5.0 MAT-file", "not a mat file of level 5; save it with -v7 or -v6"),
        ("1 0 0 0\n0 1 0 0\n", "expected 12 or 16 finite numbers, found 8"),
        ("1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 2\n", "the last row of the matrix is 0 0 0 2, not 0 0 0 1"),
        ("1 0 0 0\n0 2 0 0\n0 0 1 0\n", "not orthonormal"),
        ("ros2 run tf2_ros static_transform_publisher --x 1\n", "a frame's name is missing"),
        ("ros2 run tf2_ros static_transform_publisher 1 2 3\n", "expected 6 or 7 numbers and two frames"),
        ("static_transform_publisher --qx 1 --qy 1 --frame-id radar --child-frame-id cam", "has length 1.732, not 1"),
        ("static_transform_publisher --x inf --frame-id radar --child-frame-id cam", "'inf' is not a number"),
        ("<launch/>", "it runs no static_transform_publisher"),
        ("<robot/>", "no joint in it that can be read"),
        ("<html/>", "expected OpenCV's <opencv_storage>"),
        ("def generate_launch_description(): return [", "not Python"),
        ("def generate_launch_description(): return []", "it runs no static_transform_publisher"),
        ("Tr_velo_to_cam: 1 2 3\n", "Tr_velo_to_cam: expected 12 numbers, found 3"),
        ('{"parent_frame_id": "radar"}', "parent_frame_id or child_frame_id is missing"),
        ('{"FrameTransform": 3}', "found FrameTransform"),
        ("child_frame_id: camera\nheader: {}\n", "a stamped transform needs header.frame_id"),
        ("R: [1, 0, 0]\nT: [0, 0, 0]\n", "R: expected 9 numbers, found 3"),
    ],
)
def test_content_without_a_valid_calibration_is_refused_in_one_line(content, words):
    with pytest.raises(InputError, match=words) as refusal:
        read_any(content, "file")

    assert str(refusal.value).startswith("file:")
    assert "\n" not in str(refusal.value)


def test_a_launch_file_is_read_without_running_it(tmp_path):
    marker = tmp_path / "was_run"
    text = (
        f"open({str(marker)!r}, 'w')\n"
        "def generate_launch_description():\n    Node(arguments=['--x', '1', '--frame-id', 'radar', '--child-frame-id', 'cam'])\n"
    )

    assert read_any(text).pose.translation_m[0] == 1.0
    assert not marker.exists()


def test_a_known_pose_in_the_vehicle_changes_the_exports_and_is_removed_when_they_are_read(file):
    parent_from_radar = RigidTransform.identity().perturbed(np.array([3.5, 0.1, 0.6, 0.0, 0.02, 0.3]))
    for name in ("autoware", "nuscenes"):
        rectified = format_named(name).is_for_rectified
        moved = export(file, name, parent_from_radar=parent_from_radar, rectified=rectified)

        assert moved.data != export(file, name, rectified=rectified).data
        pose = read_any(moved.data).camera_from_radar
        np.testing.assert_allclose(pose.as_matrix(), file.calibration.camera_from_radar.as_matrix(), atol=1e-12)

    with pytest.raises(
        InputError, match=r"the format tf2 has no third frame .*; formats that have one: autoware, nuscenes"
    ):
        export(file, "tf2", parent_from_radar=parent_from_radar)


def test_an_unknown_format_is_refused_with_a_suggestion(file):
    with pytest.raises(InputError, match=r"unknown format 'autowear'; did you mean autoware\?"):
        export(file, "autowear")


def test_formats_that_cannot_store_the_lens_refuse_it(file):
    rational = read_camera(
        json.dumps(
            {
                "model": "rational_polynomial",
                "width_px": 64,
                "height_px": 48,
                "matrix_px": [[50, 0, 32], [0, 50, 24], [0, 0, 1]],
                "distortion": [0.1] * 8,
            }
        )
    )
    with_k3 = dataclasses.replace(file.calibration.camera, distortion=np.array([-0.3, 0.1, 0, 0, 0.05]))
    skewed = dataclasses.replace(rational, matrix_px=np.array([[50, 0.5, 32], [0, 50, 24], [0, 0, 1.0]]))
    cases = [
        (rational, "kalibr", "Kalibr's radtan model has no k3 to k6, which this camera uses; export with --to opencv"),
        (with_k3, "kalibr", "Kalibr's radtan model has no k3, which this camera uses"),
        (skewed, "kalibr", "Kalibr's pinhole model has no skew"),
        (skewed, "colmap", "COLMAP's models have no skew"),
        (
            skewed,
            "opencv",
            "OpenCV's camera models have no skew, but this camera has; export with --to json",
        ),
    ]
    for camera, name, words in cases:
        other = dataclasses.replace(file, calibration=dataclasses.replace(file.calibration, camera=camera))
        with pytest.raises(InputError, match=words):
            export(other, name)


def test_a_file_is_read_by_its_path(file, tmp_path):
    for known in FORMATS:
        written = export(file, known.name, rectified=known.is_for_rectified)
        (tmp_path / written.file_name).write_bytes(written.data)
        assert read_any_file(tmp_path / written.file_name).format == known.name
    with pytest.raises(InputError, match="no such file or folder"):
        read_any_file(tmp_path / "absent")


def test_an_unknown_covariance_is_left_out_of_binary_files_not_written_as_nan(file):
    unknown = dataclasses.replace(file.calibration, covariance=np.full((6, 6), np.nan))

    known, left_out = (
        contents_text(export(dataclasses.replace(file, calibration=calibration), "matlab"))
        for calibration in (file.calibration, unknown)
    )
    assert "covariance" in known
    assert "covariance" not in left_out
    assert "nan" not in left_out


def test_an_npz_with_python_objects_is_refused(tmp_path):
    np.savez(tmp_path / "objects.npz", camera_from_radar=np.array([{"a": 1}], dtype=object), allow_pickle=True)

    with pytest.raises(InputError, match="save plain arrays"):
        read_any_file(tmp_path / "objects.npz")


@pytest.mark.parametrize("compressed", [False, True])
def test_what_scipy_writes_for_matlab_is_read(tmp_path, compressed):
    from scipy.io import savemat

    matrix = np.eye(4)[[1, 2, 0, 3]]
    content = {
        "camera_from_radar": matrix,
        "frames": {"radar": "rädar", "camera": "cam"},
        "whole": np.arange(6, dtype=np.int16).reshape(2, 3),
        "cells": np.array([1, "a"], dtype=object),
    }
    savemat(tmp_path / "a.mat", content, do_compression=compressed)

    read = load_mat((tmp_path / "a.mat").read_bytes(), source="a.mat")

    assert read["camera_from_radar"].tolist() == matrix.tolist()
    assert read["whole"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert read["frames"] == {"radar": "rädar", "camera": "cam"}
    assert read_any_file(tmp_path / "a.mat").camera_from_radar.rotation.tolist() == matrix[:3, :3].tolist()


def test_the_shell_gets_a_strange_frame_name_as_one_word(file, tmp_path):
    strange = FrameNames("radar; touch was_run #", "camera *|=(x) optical")
    (tmp_path / "static_transform.sh").write_bytes(export(dataclasses.replace(file, frames=strange), "tf2").data)
    (tmp_path / "ros2").write_text("#!/bin/sh\nprintf '%s\\n' \"$@\" > words\n", encoding="utf-8")
    (tmp_path / "ros2").chmod(0o755)

    path = f"{tmp_path}:{os.environ['PATH']}"
    subprocess.run(["sh", "static_transform.sh"], cwd=tmp_path, env={**os.environ, "PATH": path}, check=True)

    words = (tmp_path / "words").read_text(encoding="utf-8").splitlines()
    assert words[words.index("--frame-id") + 1] == strange.radar
    assert words[words.index("--child-frame-id") + 1] == strange.camera
    assert not (tmp_path / "was_run").exists()


def test_a_comparison_says_how_many_covariances_it_includes(file):
    both = compare(imported(file), imported(file))
    one = compare(imported(file), read_any(text_of(file, "tf2")))
    none = compare(read_any(text_of(file, "tf2")), read_any(text_of(file, "tf2")))

    assert (both.covariances, one.covariances, none.covariances) == (2, 1, 0)
    assert both.rotation_sigma_deg == pytest.approx(np.sqrt(2) * one.rotation_sigma_deg)
    assert "from that one alone" in one.lines()[-1]
    assert not any("alone" in line for line in (*both.lines(), *none.lines()))
    assert not any("standard deviation" in line for line in none.lines())


@pytest.mark.parametrize(
    ("radar", "camera"), [("ti_mmwave_0", "camera_optical_frame"), ("front_ars540", "rgb_optical")]
)
@pytest.mark.parametrize("name", ["autoware", "urdf", "tf2", "apollo"])
def test_without_comments_sensors_are_recognized_by_common_frame_names(file, name, radar, camera):
    text = text_of(dataclasses.replace(file, frames=FrameNames(radar, camera)), name)
    bare = re.sub(r"<!--.*?-->", "", without_comments(text), flags=re.DOTALL)

    assert "check point" not in bare
    assert check(read_any(bare.lstrip()), against=imported(file)).verdict == "right"


BINARY = ("colmap", "matlab", "nuscenes")


@pytest.mark.parametrize("name", [known.name for known in FORMATS if known.name not in BINARY])
def test_text_saved_on_windows_is_read_the_same(file, name):
    data = export(file, name, rectified=format_named(name).is_for_rectified).data
    right = read_any(data).camera_from_radar.as_matrix()

    for changed in (data.replace(b"\n", b"\r\n"), b"\xef\xbb\xbf" + data, data.decode().encode("utf-16")):
        again = read_any(changed)
        assert again.format == name
        assert check(again, against=imported(file)).verdict == "right"
        np.testing.assert_array_equal(again.camera_from_radar.as_matrix(), right)


TWO_MORE = {
    "tf2": "ros2 run tf2_ros static_transform_publisher --x 1 --frame-id base_link --child-frame-id lidar\n"
    "ros2 run tf2_ros static_transform_publisher 1 0 0 0 0 0 base_link imu\n",
    "tf2-launch-xml": '<node pkg="tf2_ros" exec="static_transform_publisher" args="--frame-id base_link --child-frame-id lidar"/>'
    '<node pkg="tf2_ros" exec="static_transform_publisher" args="1 0 0 0 0 0 1 base_link imu"/>',
    "tf1-launch": '<node pkg="tf" type="static_transform_publisher" args="1 0 0 0 0 0 base_link lidar 100"/>',
    "tf2-launch-py": "Node(arguments=['--frame-id', 'base_link', '--child-frame-id', 'lidar'])\n",
    "urdf": '<joint name="a" type="fixed"><parent link="base_link"/><child link="radar"/></joint>',
}


LAUNCH = {"tf2-launch-xml": 'pkg="tf2_ros" exec', "tf1-launch": 'pkg="tf" type'}


def launch_of(file: CalibrationFile, name: str) -> str:
    """Return a launch file in XML that publishes the pose, without and with names of the arguments."""
    arguments = text_of(file, "tf2").partition("static_transform_publisher ")[2].replace("\\\n", " ").split()
    if name == "tf1-launch":
        arguments = arguments[1::2]
    return f'<launch><node {LAUNCH[name]}="static_transform_publisher" args="{" ".join(arguments)}"/></launch>'


@pytest.mark.parametrize("with_comments", [True, False])
@pytest.mark.parametrize("name", TWO_MORE)
def test_among_other_transforms_the_one_between_radar_and_camera_is_read(file, name, with_comments):
    text = launch_of(file, name) if name in LAUNCH else text_of(file, name)
    if not with_comments:
        text = re.sub(r"<!--.*?-->", "", without_comments(text), flags=re.DOTALL)
    for start in ("ros2 run", "<launch>", '<robot name="radar_camera">', "def generate"):
        if start in text:
            opening = start if start.startswith("<") else ""
            text = text.replace(start, opening + TWO_MORE[name] + start.removeprefix(opening), 1)

    assert check(read_any(text.lstrip()), against=imported(file)).verdict == "right"


def test_several_possible_transforms_are_refused_with_their_names(file):
    text = without_comments(text_of(file, "tf2"))
    left, right = text.replace("camera_optical", "cam_left"), text.replace("camera_optical", "cam_right")

    with pytest.raises(InputError, match=r"2 camera frames: cam_left, cam_right; choose with --camera-frame NAME"):
        read_any(left + right, "file")
    joint = '<joint name="j" type="fixed"><parent link="radar"/><child link="cam_{}"/></joint>'
    with pytest.raises(InputError, match="2 camera frames: cam_1, cam_2"):
        read_any(f"<robot>{joint.format(1)}{joint.format(2)}</robot>", "file")
    chain = text_of(file, "kalibr")
    with pytest.raises(InputError, match="T_cam_radar appears in cam0, cam1; keep only the intended camera"):
        read_any(chain + chain[chain.index("cam0:") :].replace("cam0", "cam1"))
    members = unpack(export(file, "colmap").data, source="")
    members["images.txt"] += b"2 1 0 0 0 0 0 0 1 other\n\n"
    with pytest.raises(InputError, match="contains 2 images"):
        read_any(pack(members))
    with pytest.raises(InputError, match=r"file:2: a stamped transform needs header.frame_id"):
        read_any("transforms:\n- {child_frame_id: a}\n- {child_frame_id: b}\n", "file")


# Slips beside the pose: a guess that proves a guess, another camera matrix, numbers stated twice, swapped frame names.


@pytest.fixture(scope="module")
def clicked(file: CalibrationFile) -> CalibrationFile:
    return dataclasses.replace(file, evidence="clicked")


@pytest.fixture(scope="module")
def guessed(clicked) -> CalibrationFile:
    """Made from a bare matrix of the inverse pose, which was taken for camera_from_radar."""
    return adoption(read_any(inverse_of(clicked)), "bare.txt", camera=clicked.calibration.camera).file


def inverse_of(clicked: CalibrationFile) -> str:
    rows = clicked.calibration.camera_from_radar.inverse().as_matrix()
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())


def test_agreeing_with_a_guess_proves_nothing(clicked, guessed):
    found, other = read_any(inverse_of(clicked)), imported(guessed)

    assert check(found, against=other).verdict == "doubtful"
    made = adoption(found, "bare.txt", camera=clicked.calibration.camera, against=other)
    assert made.file.evidence == "imported_assumed"
    proven = imported(dataclasses.replace(guessed, evidence="imported_proven"))
    assert check(found, against=proven).verdict == "right"


def test_being_the_file_of_a_guess_proves_nothing(guessed):
    found = read_any(export(guessed, "tf2").data)
    report = check(found, of=imported(guessed))
    assert report.verdict == "doubtful"
    assert {"same-pose", "assumed-reference"} <= {result.code for result in report.results}


@pytest.mark.parametrize("name", ["kitti", "nuscenes"])
@pytest.mark.parametrize("rectified", [True, False])
def test_another_matrix_in_a_file_of_rectified_images_misses_its_check_point(clicked, name, rectified):
    exported = export(clicked, name, rectified=rectified)
    found = read_any(exported.data)
    assert found.matrix_px is not None
    other = dataclasses.replace(found, matrix_px=found.matrix_px * np.array([[1.01, 1, 1], [1, 1.01, 1], [1, 1, 1]]))

    assert check(found).verdict == "right"
    assert [result.code for result in check(other).results if result.level == "error"] == ["other-lens"]


@pytest.mark.parametrize("name", ["kalibr", "colmap"])
def test_another_distortion_is_seen_at_the_check_point(clicked, name):
    found = read_any(export(clicked, name).data)
    other = dataclasses.replace(
        found, camera=dataclasses.replace(found.camera, distortion=found.camera.distortion * 0.9)
    )

    assert check(found).verdict == "right"
    assert [result.code for result in check(other).results if result.level == "error"] == ["other-lens"]


@pytest.mark.parametrize("key", ["R", "t"])
def test_numbers_beside_the_matrix_of_an_npz_must_be_its_own(clicked, key):
    pose = clicked.calibration.camera_from_radar
    beside = {"R": pose.rotation.T, "t": pose.translation_m + 0.01}
    report = check(read_any(npz(camera_from_radar=pose.as_matrix(), **{key: beside[key]})))
    assert report.verdict == "wrong"
    assert any(f"{key} is not that" in result.message for result in report.results)


def test_numbers_beside_the_matrix_of_a_mat_file_must_be_its_own(clicked):
    variables = {
        key: value for key, value in loadmat(io.BytesIO(export(clicked, "matlab").data)).items() if key[0] != "_"
    }
    variables["camera_from_radar"]["Translation"][0, 0] = np.array([[9.0, 9.0, 9.0]])
    buffer = io.BytesIO()
    savemat(buffer, variables)

    assert check(read_any(buffer.getvalue())).verdict == "wrong"


def test_the_rotation_vector_beside_a_matrix_must_be_its_own(clicked):
    text = export(clicked, "opencv").data.decode()
    changed = re.sub(r"(rvec:[^\[]*\[ )[^,]*", r"\g<1>0.1", text)

    assert changed != text
    report = check(read_any(changed))
    assert any("rvec is not" in result.message for result in report.results)


def test_swapped_frame_names_are_an_error_and_renamed_ones_are_not(clicked):
    pose, frames = clicked.calibration.camera_from_radar.as_matrix(), clicked.frames
    data = npz(camera_from_radar=pose, radar_frame=np.array(frames.camera), camera_frame=np.array(frames.radar))
    swapped = check(read_any(data), of=imported(clicked))
    renamed = check(
        read_any(export(clicked, "matlab", frames=FrameNames("front", "eye_optical")).data), of=imported(clicked)
    )

    assert [result.code for result in swapped.results if result.level == "error"] == ["swapped-frames"]
    assert renamed.verdict == "right"


def test_a_file_that_cannot_be_read_has_the_keys_of_the_others(clicked):
    read = CheckedFile("a.json", check(imported(clicked)))
    first, second = json.loads(check_json([read, CheckedFile("b.json", unreadable="b.json: not read")]))["files"]
    assert set(first) == set(second)
    assert second["results"] == []


def test_a_rough_fit_names_no_slip_if_none_explains_the_check_point(clicked):
    """The sign of one number of a quaternion is no known slip, though two slips together come within ten degrees of it."""
    text = export(clicked, "tf2").data.decode()
    changed = re.sub(r"--qx -?", lambda found: "--qx " if found[0].endswith("-") else "--qx -", text)

    report = check(read_any(changed), against=imported(clicked))
    assert [result.code for result in report.results if result.level == "error"] == ["check-point-missed", "disagrees"]


def test_a_stale_file_is_said_to_be_stale_first(clicked):
    pose = clicked.calibration.camera_from_radar
    moved = RigidTransform(pose.rotation, pose.translation_m + np.array([0.03, 0.0, 0.0]))
    newer = dataclasses.replace(
        clicked, calibration=dataclasses.replace(clicked.calibration, camera_from_radar=moved), check_point=None
    )
    report = check(read_any(export(clicked, "tf2").data), of=imported(newer))
    assert [result.code for result in report.results if result.level == "error"] == ["stale", "other-pose"]
