"""Files that state nothing about their pose, in the shapes in which tools and people write them."""

import io
import json
from collections.abc import Callable

import numpy as np
import pytest
from scipy.io import savemat

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix, rotation_exp, rotation_log
from calib_core.interchange.hypotheses.ranking import clear_one, contradicts_names, hypotheses_of
from calib_core.interchange.hypotheses.reading import as_imported, picked, read_clear, read_unstated

POSE = RigidTransform(
    rotation_exp(np.array([0.03, -0.08, 0.02])) @ np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]),
    np.array([0.12, -0.31, 0.07]),
)
MATRIX = POSE.as_matrix()
QUATERNION = quaternion_wxyz_from_matrix(POSE.rotation).tolist()
TRANSLATION = POSE.translation_m.tolist()
RVEC = rotation_log(POSE.rotation)


def _npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def _npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _mat(**arrays: object) -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, arrays)
    return buffer.getvalue()


def _rows(matrix: np.ndarray, separator: str = " ") -> str:
    return "".join(separator.join(f"{number:.9g}" for number in row) + "\n" for row in matrix)


def _opencv_matrix(name: str, matrix: np.ndarray) -> str:
    rows, columns = np.atleast_2d(matrix).shape
    numbers = " ".join(repr(number) for number in np.ravel(matrix).tolist())
    return f'<{name} type_id="opencv-matrix"><rows>{rows}</rows><cols>{columns}</cols><dt>d</dt><data>{numbers}</data></{name}>'


NOT_CERTAIN = {"pose.txt", "rotation-then-translation.txt", "own.xml"}
"""The order of a quaternion, rows or columns, angles or a rotation vector: more than one may be plausible."""

CORPUS: dict[str, str | bytes] = {
    "rvec-tvec.json": json.dumps({"rvec": RVEC.tolist(), "tvec": TRANSLATION, "rms": 0.8}),
    "rvec-tvec-columns.json": json.dumps(
        {"result": {"rvec": RVEC[:, None].tolist(), "tvec": [[t] for t in TRANSLATION]}}
    ),
    "R-t.json": json.dumps({"rotation_matrix": POSE.rotation.tolist(), "translation_vector": TRANSLATION}),
    "R-T-upper.json": json.dumps({"calib": {"R": POSE.rotation.ravel().tolist(), "T": TRANSLATION}}),
    "named-4x4.json": json.dumps({"radar_to_camera": MATRIX.tolist(), "date": "2024-05-01"}),
    "deep.json": json.dumps({"calibration": {"radar": {"front": {"T": MATRIX.tolist()}}}}),
    "flat-16.json": json.dumps({"extrinsics": MATRIX.ravel().tolist()}),
    "transform.json": json.dumps(
        {
            "translation": dict(zip("xyz", TRANSLATION, strict=True)),
            "rotation": dict(zip("wxyz", QUATERNION, strict=True)),
        }
    ),
    "wxyz-list.json": json.dumps({"quaternion_wxyz": QUATERNION, "translation": TRANSLATION}),
    "matrix.npy": _npy(MATRIX),
    "three-by-four-fortran.npy": _npy(np.asfortranarray(MATRIX[:3])),
    "float32.npy": _npy(MATRIX.astype(np.float32)),
    "camera_from_radar.npz": _npz(T_cam_radar=MATRIX, K=np.diag([500.0, 500.0, 1.0])),
    "R-t.npz": _npz(R=POSE.rotation, t=POSE.translation_m, names=np.array(["radar", "camera"])),
    "T.mat": _mat(T=MATRIX, note="from the toolbox"),
    "struct.mat": _mat(extrinsics={"R": POSE.rotation, "t": POSE.translation_m[:, None]}),
    "matrix.txt": _rows(MATRIX),
    "three-rows.txt": "# radar to camera\n" + _rows(MATRIX[:3], ", "),
    "one-line.txt": _rows(MATRIX[:3].reshape(1, 12)),
    "one-per-line.txt": _rows(MATRIX.reshape(16, 1)),
    "rotation-then-translation.txt": _rows(np.vstack([POSE.rotation, POSE.translation_m])),
    "transposed.txt": _rows(MATRIX.T),
    "pose.txt": " ".join(map(str, [*TRANSLATION, *np.roll(QUATERNION, -1).tolist()])) + "\n",
    "nested.yaml": "sensors:\n  radar:\n    T_cam_radar:\n"
    + "".join(f"    - [{', '.join(map(repr, row))}]\n" for row in MATRIX.tolist()),
    "keyed.txt": f"R: {' '.join(map(repr, POSE.rotation.ravel().tolist()))}\nt: {' '.join(map(repr, TRANSLATION))}\n",
    "opencv.xml": "<?xml version='1.0'?>\n<opencv_storage>"
    + _opencv_matrix("rvec", RVEC[:, None])
    + _opencv_matrix("tvec", POSE.translation_m[:, None])
    + "</opencv_storage>",
    "opencv.yml": f"%YAML:1.0\n---\nextrinsic: !!opencv-matrix\n  rows: 4\n  cols: 4\n  data: {MATRIX.ravel().tolist()}\n",
    "own.xml": f"<rig><radar name='front'><rotation>{' '.join(map(repr, RVEC.tolist()))}</rotation>"
    f"<translation>{' '.join(map(repr, TRANSLATION))}</translation></radar></rig>",
}


def _is_pose(found: RigidTransform, tolerance: float = 1e-6) -> bool:
    return bool(np.abs(found.as_matrix() - MATRIX).max() < tolerance)


@pytest.mark.parametrize("name", CORPUS)
def test_a_usual_shape_has_the_pose_as_its_first_hypothesis_and_of_a_usual_mounting_the_meaning_is_clear(name):
    file = read_unstated(CORPUS[name], name)
    pose = file.pose_at(None)
    hypotheses = hypotheses_of(pose)
    assert _is_pose(hypotheses[0].camera_from_radar)
    chosen = clear_one(pose, hypotheses)
    if name in NOT_CERTAIN:
        assert chosen is None or _is_pose(chosen.camera_from_radar)
        return
    found = as_imported(file, pose, chosen, by_hand=False)
    assert _is_pose(found.camera_from_radar)
    assert len(found.assumptions) == 1
    assert chosen.key in found.assumptions[0]


def test_body_axes_in_both_frames_leave_the_direction_open():
    file = read_unstated(json.dumps({"T": {"x": 1.2, "y": 0.1, "z": 0.4, "qw": 1, "qx": 0, "qy": 0, "qz": 0}}))
    pose = file.pose_at(None)
    hypotheses = hypotheses_of(pose)
    assert clear_one(pose, hypotheses) is None
    directions = [one.meanings[0].direction for one in hypotheses[:2]]
    assert sorted(directions) == ["camera_from_radar", "radar_from_camera"]


def test_several_poses_are_listed_by_their_place():
    text = json.dumps({"front": {"T": MATRIX.tolist()}, "rear": {"T": MATRIX.tolist()}})
    file = read_unstated(text, "rig.json")
    with pytest.raises(InputError, match=r"contains 2 poses; choose one with --pose NAME: 'front.T', 'rear.T'"):
        file.pose_at(None)
    with pytest.raises(InputError, match=r"no pose at 'side.T'"):
        file.pose_at("side.T")
    assert file.pose_at("rear.T").place == file.pose_at("rear").place == "rear.T"


def test_of_several_radars_that_with_a_camera_matrix_is_read_and_with_its_camera():
    matrix = {"K": [[900, 0, 640], [0, 900, 360], [0, 0, 1]], "width": 1280, "height": 720}
    sensors = {name: {"T": MATRIX.tolist()} for name in ("lidar_top", "radar_front", "radar_rear")}
    sensors["radar_front"] |= matrix
    file = read_unstated(json.dumps({"sensors": sensors}), "rig.json")
    pose = file.pose_at(None)
    assert pose.place == "sensors.radar_front.T"
    found = as_imported(file, pose, hypotheses_of(pose)[0], by_hand=True)
    assert found.camera.matrix_px[0, 0] == 900.0
    assert as_imported(file, file.pose_at("radar_rear"), hypotheses_of(pose)[0], by_hand=True).camera is None


def test_the_poses_of_radar_and_camera_in_a_third_frame_are_not_taken_for_one_another():
    """As Astyx has them: the radar's is the identity, and the camera's stands with its matrix."""
    matrix = {"K": [[900, 0, 640], [0, 900, 360], [0, 0, 1]]}
    poses = [
        ("camera_front", matrix | {"T_to_ref_COS": MATRIX.tolist()}),
        ("radar", {"T_to_ref_COS": np.eye(4).tolist()}),
    ]
    sensors = [{"sensor_uid": name, "calib_data": data} for name, data in poses]
    file = read_unstated(json.dumps({"sensors": sensors}), "000000.json")
    with pytest.raises(InputError, match="cocalib import composes them"):
        file.pose_at(None)
    camera = file.pose_at("sensors[0].calib_data.T_to_ref_COS")
    assert as_imported(file, camera, hypotheses_of(camera)[0], by_hand=True).matrix_px[0, 0] == 900.0


def test_each_radar_of_a_mapping_is_a_pose_of_its_own():
    text = json.dumps(
        {"R_left": POSE.rotation.tolist(), "t_left": TRANSLATION, "R_right": np.eye(3).tolist(), "t_right": [1, 2, 3]}
    )
    file = read_unstated(text, "rig.json")
    assert [pose.place for pose in file.poses] == ["R_left", "R_right"]
    assert file.poses[1].readings[0].translation.tolist() == [1.0, 2.0, 3.0]


def _mirrored() -> str:
    return json.dumps({"T": (MATRIX @ np.diag([1.0, -1, 1, 1])).tolist()})


def _with(change: Callable[[np.ndarray], None]) -> str:
    matrix = MATRIX.copy()
    change(matrix)
    return json.dumps({"T": matrix.tolist()})


def _set(row: int, column: int, value: float) -> Callable[[np.ndarray], None]:
    def change(matrix: np.ndarray) -> None:
        matrix[row, column] = value

    return change


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (_mirrored(), r"T: the rotation is left-handed .* an axis is mirrored"),
        (_with(_set(3, 3, 2.0)), r"T: the last row of the 4x4 matrix is 0 0 0 2 instead of 0 0 0 1"),
        (_with(_set(3, 0, 0.5)), r"instead of 0 0 0 1"),
        (json.dumps({"T": (2 * MATRIX[:3]).tolist()}), r"not orthonormal .* is it scaled"),
        (
            json.dumps({"T": [[0, 1e-310, 2e-310, 1], [3e-310, 4e-310, 5e-310, 1], [6e-310, 7e-310, 8e-310, 1]]}),
            "orthonormal",
        ),
        (json.dumps({"M": (np.diag([500.0, 500, 1]) @ MATRIX[:3]).tolist()}), r"looks like a projection"),
        (json.dumps({"T": MATRIX.tolist()}).replace("0.12", "NaN"), r"not finite"),
        (json.dumps({"R": POSE.rotation.tolist()}), r"a rotation, and no translation beside it"),
        (json.dumps({"quaternion": [0.5, 0.5, 0.5, 0.9], "t": TRANSLATION}), r"the quaternion has length .* not 1"),
        (json.dumps({"rvec": [10.0, 90.0, 3.0], "tvec": TRANSLATION}), r"is it in degrees\?"),
        (_npy(np.array([{"a": 1}], dtype=object)), "not an array of numbers"),
        (_npy(MATRIX)[:-8], "a damaged npy file"),
    ],
)
def test_what_has_the_shape_of_a_pose_and_is_none_is_refused_with_the_reason(text, fault):
    with pytest.raises(InputError, match=fault):
        read_unstated(text, "file.json")


def test_a_file_that_states_its_frames_is_read_by_its_format():
    text = json.dumps(
        {
            "header": {"frame_id": "radar"},
            "child_frame_id": "camera_optical",
            "transform": {
                "translation": dict(zip("xyz", TRANSLATION, strict=True)),
                "rotation": dict(zip("wxyz", QUATERNION, strict=True)),
            },
        }
    )
    assert read_unstated(text) is None


def test_a_meaning_is_picked_by_as_many_parts_as_are_needed():
    file = read_unstated(json.dumps({"T": np.linalg.inv(MATRIX).tolist()}), "file.json")
    hypotheses = hypotheses_of(file.pose_at(None))
    assert _is_pose(picked(hypotheses, "radar_from_camera,optical,m", "file.json").camera_from_radar)
    assert picked(hypotheses, "mm,camera_from_radar,body,frd", "file.json").meanings[0].unit == "mm"
    with pytest.raises(InputError, match=r"several meanings have the parts 'optical'"):
        picked(hypotheses, "optical", "file.json")
    with pytest.raises(
        InputError, match=r"no meaning has the parts 'inches'; pick one with --as: radar_from_camera,optical,m"
    ):
        picked(hypotheses, "inches", "file.json")


def test_the_camera_in_the_file_comes_along():
    text = json.dumps(
        {"K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]], "D": [], "width": 640, "height": 480, "T": MATRIX.tolist()}
    )
    file = read_unstated(text, "file.json")
    pose = file.pose_at(None)
    found = as_imported(file, pose, hypotheses_of(pose)[0], by_hand=True)
    assert (found.camera.width_px, found.camera.matrix_px[0, 0]) == (640, 500.0)


LEVEL = RigidTransform(np.eye(3), [1.2, 0.1, 0.4]).as_matrix().tolist()
"""Body axes in both frames: either direction is as good."""


@pytest.mark.parametrize(
    ("content", "first"),
    [
        ({"T_cam_radar": LEVEL}, "camera_from_radar"),
        ({"radar_from_cam": LEVEL}, "radar_from_camera"),
        ({"radar2camera": LEVEL}, "camera_from_radar"),
        ({"parent": "radar_front", "child": "camera", "matrix": LEVEL}, "radar_from_camera"),
        ({"parent_frame": "cam0", "child_frame": "radar", "matrix": LEVEL}, "camera_from_radar"),
        ({"from": "radar", "to": "camera", "matrix": LEVEL}, "camera_from_radar"),
        ({"source_frame": "camera", "target_frame": "radar", "matrix": LEVEL}, "radar_from_camera"),
        ({"description": "extrinsics from the camera to the radar", "matrix": LEVEL}, "radar_from_camera"),
    ],
)
def test_names_rank_the_direction_and_decide_nothing(content, first):
    hypotheses = hypotheses_of(read_unstated(json.dumps(content)).pose_at(None))
    assert hypotheses[0].meanings[0].direction == first
    assert {one.meanings[0].direction for one in hypotheses if one.fits} == {"camera_from_radar", "radar_from_camera"}


def test_the_pose_of_another_sensor_is_not_taken_for_the_radars():
    file = read_unstated(json.dumps({"T_cam_lidar": MATRIX.tolist()}), "file.json")
    pose = file.pose_at(None)
    assert clear_one(pose, hypotheses_of(pose)) is None
    assert clear_one(pose, hypotheses_of(pose, against=POSE)) is not None
    with pytest.raises(InputError, match="does not state what its numbers mean"):
        read_clear(json.dumps({"T_cam_lidar": MATRIX.tolist()}), "file.json")


def test_parts_named_by_initials_are_a_lidars_and_its_camera_comes_along():
    numbers = {"rlc": np.eye(3).tolist(), "tlc": [0.1, 0.2, -0.3]}
    file = read_unstated(
        json.dumps({"camera_matrix": [900, 0, 640, 0, 0, 900, 360, 0, 0, 0, 1, 0], **numbers}), "rig.json"
    )
    pose = file.pose_at(None)
    assert (pose.hints.other, pose.readings[0].translation.tolist()) == ("rlc", [0.1, 0.2, -0.3])
    assert clear_one(pose, hypotheses_of(pose)) is None
    assert file.camera is not None


def test_of_several_poses_the_only_one_that_names_a_radar_is_taken():
    text = json.dumps({"T_cam_lidar": np.eye(4).tolist(), "T_cam_radar": MATRIX.tolist()})
    found = read_clear(text, "rig.json")
    assert _is_pose(found.camera_from_radar)
    assert [note.split()[0] for note in found.notes] == ["T_cam_radar"]
    assert "one of 2 poses" in found.notes[0]


def test_what_cannot_be_read_beside_a_pose_is_told():
    mirrored = (MATRIX @ np.diag([1.0, -1, 1, 1])).tolist()
    found = read_clear(json.dumps({"front": mirrored, "rear": MATRIX.tolist()}), "rig.json")
    assert _is_pose(found.camera_from_radar)
    assert "front: the rotation is" in found.notes[0]


def test_intrinsics_are_no_pose():
    projection = [[500.0, 0, 320, 0], [0, 500, 240, 0], [0, 0, 1, 0]]
    text = json.dumps(
        {"projection_matrix": {"rows": 3, "cols": 4, "data": np.ravel(projection).tolist()}, "P2": projection}
    )
    assert read_unstated(text, "camera.json") is None


def test_units_in_names_rank_first():
    file = read_unstated(json.dumps({"R": POSE.rotation.tolist(), "t_mm": [120.0, -310.0, 70.0]}), "file.json")
    first = hypotheses_of(file.pose_at(None))[0]
    assert first.meanings[0].unit == "mm"
    assert _is_pose(first.camera_from_radar)


def test_numbers_that_contradict_their_name_are_left_to_a_person():
    transposed = RigidTransform(POSE.rotation.T, POSE.translation_m)
    file = read_unstated(json.dumps({"T_camera_radar": transposed.as_matrix().tolist()}), "file.json")
    pose = file.pose_at(None)
    hypotheses = hypotheses_of(pose)
    assert hypotheses[0].meanings[0].direction == "radar_from_camera"
    assert contradicts_names(pose, hypotheses[0])
    assert clear_one(pose, hypotheses) is None
    assert clear_one(pose, hypotheses_of(pose, against=transposed)) is not None


@pytest.mark.parametrize("name", ["T_robot_camera", "T_base_radar", "cam_to_rig", "gripper_from_camera"])
def test_the_pose_of_one_of_the_two_in_something_else_is_left_to_a_person(name):
    file = read_unstated(json.dumps({name: POSE.inverse().as_matrix().tolist()}), "file.json")
    pose = file.pose_at(None)
    assert pose.hints.other
    assert clear_one(pose, hypotheses_of(pose)) is None


LASER = """% Transformation matrix specifies laser coordinate frame
% in the reference frame of the camera
%-- Translation vector (t)
t = [ 0.051 ; -0.312 ; -0.120 ]
%-- Rotation matrix (R)
R = ...
[ 0.017452  -0.999848  0.000000 ;...
  0.000000  0.000000  -1.000000 ;...
  0.999848  0.017452  0.000000 ]
"""
PRINTED = """Extrinsic:
R:
0.017452 -0.999848 0
0 0 -1
0.999848 0.017452 0
t: 0.051 -0.312 -0.120
************* the same, again *************
R: 1
"""
DICT = "{'T': [0.051, -0.312, -0.120],\n 'R': [[0.017452, -0.999848, 0], [0, 0, -1], [0.999848, 0.017452, 0]], 'to': 'camera'}"


@pytest.mark.parametrize("text", [LASER, PRINTED, DICT], ids=["matlab", "terminal", "python"])
def test_a_pose_that_a_program_printed_is_found(text):
    file = read_unstated(text, "printed.txt")
    assert file is not None
    (pose,) = file.poses
    first = hypotheses_of(pose)[0]
    assert first.key == "camera_from_radar,optical,m"
    np.testing.assert_allclose(first.camera_from_radar.translation_m, [0.051, -0.312, -0.120])


def test_the_poses_of_radar_and_camera_in_one_frame_are_not_the_pose_between_them():
    sensors = {
        "radar_calib": {"T": [0.0, 0.0, 0.0], "R": [0.0, 0.0, 0.0]},
        "left_cam_calib": {
            "T": [0.34, -0.07, 0.29],
            "R": [1.28, -0.53, 0.0],
            "fx": 338.0,
            "fy": 339.0,
            "cx": 342,
            "cy": 201,
        },
    }
    with pytest.raises(
        InputError, match="radar_calib and left_cam_calib are the poses of a radar and of a camera in a frame"
    ):
        read_clear(json.dumps(sensors))
    with pytest.raises(InputError, match="does not state what its numbers mean"):  # that nobody has filled in
        read_clear(json.dumps({"T_radar": np.eye(4).tolist()}))
