"""Readers refuse what a format's own stack would misread, and take rounding for what it is."""

import dataclasses
import io
import json
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from scipy.io import savemat

from calib_core import parsing
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile, choose_check_point
from calib_core.interchange.check.report import check
from calib_core.interchange.exporting import export
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import read_calibration, write_calibration


def with_camera(file: CalibrationFile, model: str, distortion: list[float]) -> CalibrationFile:
    camera = Camera(model, 640, 480, file.calibration.camera.matrix_px, np.array(distortion))
    calibration = dataclasses.replace(file.calibration, camera=camera, pairs=())
    return dataclasses.replace(
        file, calibration=calibration, check_point=choose_check_point(calibration), evidence="clicked"
    )


def in_npz(matrix: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, camera_from_radar=matrix)
    return buffer.getvalue()


def in_mat(matrix: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, {"camera_from_radar": matrix})
    return buffer.getvalue()


def in_chain(matrix: np.ndarray) -> bytes:
    return yaml.safe_dump({"cam0": {"T_cam_radar": matrix.tolist()}}).encode()


def in_text(matrix: np.ndarray) -> bytes:
    return "\n".join(" ".join(map(repr, row)) for row in matrix.tolist()).encode()


@pytest.mark.parametrize("written", [in_npz, in_mat, in_chain, in_text])
def test_a_matrix_whose_last_row_is_wrong_is_refused_and_a_transposed_one_is_named(file, written):
    matrix = file.calibration.camera_from_radar.as_matrix()

    np.testing.assert_array_equal(read_any(written(matrix)).camera_from_radar.as_matrix(), matrix)
    with pytest.raises(InputError, match=r"the matrix is transposed: its last row is -0\.0011577"):
        read_any(written(matrix.T))
    with pytest.raises(InputError, match="the last row of the matrix is 0 0 0 2, not 0 0 0 1"):
        read_any(written(np.vstack([matrix[:3], [0, 0, 0, 2]])))


def test_a_kitti_file_that_gives_a_pose_twice_is_refused(file):
    text = export(file, "kitti", rectified=True).data.decode()
    pose = next(line for line in text.splitlines() if line.startswith("Tr_velo_to_cam"))

    with pytest.raises(InputError, match="Tr_velo_to_cam appears twice"):
        read_any(text + pose + "\n")
    with pytest.raises(InputError, match="both Tr_velo_to_cam and Tr_radar_to_cam are in it; keep only the radar's"):
        read_any(text + pose.replace("velo", "radar") + "\n")


def rounded(value: Any, rule: Callable[[float], float]) -> Any:
    if isinstance(value, float):
        return rule(value)
    if isinstance(value, list):
        return [rounded(item, rule) for item in value]
    return {key: rounded(item, rule) for key, item in value.items()} if isinstance(value, dict) else value


def decimals(count: int) -> Callable[[float], float]:
    return lambda value: round(value, count)


def significant(count: int) -> Callable[[float], float]:
    return lambda value: float(f"{value:.{count}g}")


def at(file: CalibrationFile, translation_m: list[float]) -> CalibrationFile:
    """Return the calibration with its sensors apart, without pairs, so that its pose alone is checked."""
    pose = RigidTransform(file.calibration.camera_from_radar.rotation, np.array(translation_m))
    calibration = dataclasses.replace(file.calibration, camera_from_radar=pose, pairs=())
    return dataclasses.replace(file, calibration=calibration, check_point=choose_check_point(calibration))


@pytest.mark.parametrize("rule", [decimals(4), decimals(5), decimals(6), significant(6)], ids=["4", "5", "6", "6g"])
@pytest.mark.parametrize("translation_m", [[0.01, -0.06, 0.02], [12.345678, -3.456789, 1.234567]])
def test_a_calibration_rounded_as_a_whole_contradicts_nothing(file, rule, translation_m):
    content = rounded(json.loads(write_calibration(at(file, translation_m))), rule)
    del content["check_point"]  # whose pixel is another matter
    text = json.dumps(content)

    assert read_any(text).faults == ()
    pose = read_calibration(text).calibration.camera_from_radar
    np.testing.assert_allclose(pose.translation_m, translation_m, rtol=0, atol=1e-4)


@pytest.mark.parametrize("rule", [decimals(5), significant(6), decimals(17)], ids=["5", "6g", "all"])
def test_numbers_that_differ_by_more_than_their_digits_are_a_contradiction(file, rule):
    content = rounded(json.loads(write_calibration(at(file, [0.412345, -0.06, 0.02]))), rule)
    del content["check_point"]

    def faults(change: Callable[[dict[str, Any]], None]) -> tuple[str, ...]:
        changed = json.loads(json.dumps(content))
        change(changed)
        return read_any(json.dumps(changed)).faults

    def moved(one: dict[str, Any]) -> None:
        one["radar_from_camera"]["translation_m"][0] += 2e-4

    def turned(one: dict[str, Any]) -> None:
        w, x, y, z = one["camera_from_radar"]["quaternion_wxyz"]
        one["camera_from_radar"]["quaternion_wxyz"] = [w + 2e-4, x, y, z]

    assert faults(lambda _: None) == ()
    assert any("not the inverse" in fault for fault in faults(moved))
    assert any("different rotations" in fault for fault in faults(turned))


def test_a_short_pose_is_not_taken_for_a_rounded_one(file):
    axes = RigidTransform(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]), np.array([0.1, 0.2, 0.3]))
    calibration = dataclasses.replace(file.calibration, camera_from_radar=axes, pairs=())
    content = json.loads(write_calibration(dataclasses.replace(file, calibration=calibration, check_point=None)))
    assert content["radar_from_camera"]["translation_m"] == [-0.3, 0.1, 0.2]
    assert read_any(json.dumps(content)).faults == ()

    content["radar_from_camera"]["translation_m"][0] = -0.31

    assert [fault.split()[0] for fault in read_any(json.dumps(content)).faults] == ["radar_from_camera"]


def test_a_camera_without_distortion_is_written_for_kalibr_with_the_model_that_it_loads(file):
    text = export(with_camera(file, "pinhole", []), "kalibr").data.decode()

    chain = yaml.safe_load(text)["cam0"]
    assert (chain["distortion_model"], chain["distortion_coeffs"]) == ("radtan", [0.0, 0.0, 0.0, 0.0])
    assert check(read_any(text)).verdict == "right"


def test_a_fisheye_file_for_opencv_names_the_function_that_projects_with_it(file, tmp_path):
    fisheye = with_camera(file, "equidistant", [-0.02, 0.01, 0.003, -0.001])
    path = tmp_path / "radar_camera.yml"
    path.write_bytes(export(fisheye, "opencv").data)

    assert "cv::fisheye::projectPoints" in path.read_text()
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert storage.getNode("projection_function").string() == "cv::fisheye::projectPoints"
    matrix, lens, rvec, position, point, pixel = (
        storage.getNode(key).mat()
        for key in (
            "camera_matrix",
            "distortion_coefficients",
            "rvec",
            "T",
            "check_point_radar_m",
            "check_point_pixel_px",
        )
    )
    projected, _ = cv2.fisheye.projectPoints(point.reshape(1, 1, 3), rvec, position, matrix, lens)
    np.testing.assert_allclose(projected.ravel(), pixel.ravel(), rtol=0, atol=1e-6)
    assert "cv::fisheye" not in export(file, "opencv").data.decode()


def test_text_that_takes_long_to_parse_is_refused_unread():
    """256 kB of YAML take seconds; transforms in JSON are located by the same parser."""
    transform = {"frame_id": "a"}, {"translation": dict.fromkeys("xyz", 1), "rotation": dict.fromkeys("xyzw", 0.5)}
    stamped = [{"header": transform[0], "child_frame_id": f"f{n}", "transform": transform[1]} for n in range(2000)]
    for text in ("numbers: 1\n" * 30_000, json.dumps({"transforms": stamped})):
        with pytest.raises(InputError, match="at most 262,144 are read of YAML"):
            read_any(text.encode(), "big")


def test_a_repeated_key_is_found_without_comparing_all_keys():
    compared = []

    class Key(str):
        __slots__ = ()

        def __eq__(self, other: object) -> bool:
            compared.append(other)
            return str.__eq__(self, other)

        __hash__ = str.__hash__

    keys = [Key(f"k{number}") for number in range(2000)]
    with pytest.raises(ValueError, match="'k1999' appears twice"):
        parsing._without_repeats([(key, 1) for key in (*keys, Key("k1999"))])
    assert len(compared) < 100


@pytest.mark.parametrize(("source", "begins"), [("notes.md", "is in no format"), ("rig.yaml", "line 1: not YAML")])
def test_a_text_that_is_no_calibration_is_not_told_to_become_yaml(source, begins):
    with pytest.raises(InputError, match=f"^{source}: {begins}"):
        read_any("note: a: b\n", source)
