"""Every slip planted in every way in which formats write a pose, and two of them in every format: a check finds and names it."""

import dataclasses
import json
import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, choose_check_point
from calib_core.interchange.check.report import check
from calib_core.interchange.check.slips import undone_slips
from calib_core.interchange.exporting import export
from calib_core.interchange.format import ImportedCalibration, WrittenPose, imported
from calib_core.interchange.formats.registry import FORMATS, format_named
from calib_core.interchange.importing import read_any
from calib_core.interchange.syntax.zip_archives import pack, unpack
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, Metrics

CAMERA = Camera(
    "plumb_bob", 960, 600, np.array([[800.0, 0, 480], [0, 800, 300], [0, 0, 1]]), np.array([-0.1, 0.02, 0, 0])
)
LINK_FROM_OPTICAL = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
pytestmark = pytest.mark.slow

NO_COMMENT = {known.name for known in FORMATS if known.comment == "none"}
ANGLE = re.compile(r"(roll: |pitch: |yaw: |--roll |--pitch |--yaw )(\S+)")


@st.composite
def poses(draw: st.DrawFn) -> RigidTransform:
    """Return any orientation and a lever arm between a few centimetres and a few metres."""
    quaternion = np.array([draw(st.floats(-1, 1)) for _ in range(4)])
    assume(np.linalg.norm(quaternion) > 0.1)
    position_m = np.array([draw(st.floats(-3, 3)) for _ in range(3)])
    assume(np.linalg.norm(position_m) > 0.05)
    return RigidTransform(Rotation.from_quat(quaternion / np.linalg.norm(quaternion)).as_matrix(), position_m)


def any_pose(name: str) -> RigidTransform:
    """Return a pose without symmetry, the same for the same name."""
    rng = np.random.default_rng(list(name.encode()))
    return RigidTransform(Rotation.random(rng=rng).as_matrix(), rng.uniform(-2, 2, 3))


def file_of(pose: RigidTransform) -> CalibrationFile:
    unknown = Metrics()
    calibration = Calibration(pose, np.full((6, 6), np.nan), CAMERA, unknown, (), (), (), CalibrationOptions())
    return CalibrationFile(calibration, FrameNames(), choose_check_point(calibration))


def inverse(written: np.ndarray, _: WrittenPose) -> np.ndarray:
    return np.linalg.inv(written)


def transposed(written: np.ndarray, _: WrittenPose) -> np.ndarray:
    wrong = written.copy()
    wrong[:3, :3] = written[:3, :3].T
    return wrong


def reordered(written: np.ndarray, pose: WrittenPose) -> np.ndarray:
    """Return what is read if w is first and should be last, or vice versa."""
    shift = -1 if pose.form == "quaternion_wxyz" else 1
    wrong = written.copy()
    wrong[:3, :3] = Rotation.from_quat(np.roll(Rotation.from_matrix(written[:3, :3]).as_quat(), shift)).as_matrix()
    return wrong


def in_millimetres(written: np.ndarray, _: WrittenPose) -> np.ndarray:
    wrong = written.copy()
    wrong[:3, 3] *= 1000
    return wrong


def position_of_the_source(written: np.ndarray, _: WrittenPose) -> np.ndarray:
    wrong = written.copy()
    wrong[:3, 3] = -written[:3, :3].T @ written[:3, 3]
    return wrong


def other_axes(written: np.ndarray, pose: WrittenPose) -> np.ndarray:
    change = LINK_FROM_OPTICAL if pose.axes == "optical" else np.linalg.inv(LINK_FROM_OPTICAL)
    return change @ written if pose.direction == "camera_from_radar" else written @ np.linalg.inv(change)


def in_centimetres(written: np.ndarray, _: WrittenPose) -> np.ndarray:
    wrong = written.copy()
    wrong[:3, 3] *= 100
    return wrong


def negated_translation(written: np.ndarray, _: WrittenPose) -> np.ndarray:
    wrong = written.copy()
    wrong[:3, 3] *= -1
    return wrong


def with_axes_of_opengl(written: np.ndarray, pose: WrittenPose) -> np.ndarray:
    turned = np.diag([1.0, -1, -1, 1])
    if pose.axes == "link":
        turned = turned @ np.linalg.inv(LINK_FROM_OPTICAL)
    return turned @ written if pose.direction == "camera_from_radar" else written @ np.linalg.inv(turned)


def with_radar_axes(radar_from_flu: np.ndarray) -> "Slipping":
    def slip(written: np.ndarray, pose: WrittenPose) -> np.ndarray:
        if pose.direction == "camera_from_radar":
            return written @ np.linalg.inv(radar_from_flu)
        return radar_from_flu @ written

    return slip


def by_angles(sequence: str, order: list[int]) -> "Slipping":
    """Return a slip that takes the right roll, pitch, yaw in another order, or about other axes."""

    def slip(written: np.ndarray, _: WrittenPose) -> np.ndarray:
        wrong = written.copy()
        angles = Rotation.from_matrix(written[:3, :3]).as_euler("xyz")
        wrong[:3, :3] = Rotation.from_euler(sequence, angles[order]).as_matrix()
        return wrong

    return slip


def two_at_once(written: np.ndarray, pose: WrittenPose) -> np.ndarray:
    return in_millimetres(inverse(written, pose), pose)


Slipping = Callable[[np.ndarray, WrittenPose], np.ndarray]
FRD = np.diag([1.0, -1, -1, 1])
RIGHT_FORWARD_UP = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
SLIPS: dict[str, Slipping] = {
    "swapped-direction": inverse,
    "transposed-rotation": transposed,
    "quaternion-order": reordered,
    "millimetres": in_millimetres,
    "centimetres": in_centimetres,
    "translation-sign": negated_translation,
    "position-for-translation": position_of_the_source,
    "optical-for-link": other_axes,
    "opengl-axes": with_axes_of_opengl,
    "radar-y-right": with_radar_axes(FRD),
    "radar-x-right": with_radar_axes(RIGHT_FORWARD_UP),
    "angle-order": by_angles("xyz", [2, 1, 0]),
    "turning-axes": by_angles("XYZ", [0, 1, 2]),
    "swapped-direction+millimetres": two_at_once,
}


def with_check_point_of(right: bytes, wrong: bytes) -> bytes:
    """Return the wrong file with the check point that the right one states."""
    if right.startswith(b"PK"):
        members = unpack(right, source="right")
        return pack(
            {name: with_check_point_of(members[name], data) for name, data in unpack(wrong, source="wrong").items()}
        )
    if right.startswith(b"MATLAB"):
        return wrong  # whose keys have the point and the pixel of the right one
    if b"camera_intrinsic" in right:
        (_, stated_camera), (radar, camera) = json.loads(right), json.loads(wrong)
        return json.dumps([radar, {**camera, "cocalib": stated_camera["cocalib"]}]).encode()
    if found := re.search(rb"cocalib_check_point: .*\n", right):
        return re.sub(rb"cocalib_check_point: .*\n", b"", wrong) + found[0]
    found = re.search(rb"check point: .* px", right)
    return re.sub(rb"check point: .* px", found[0].replace(b"\\", b"\\\\"), wrong) if found else wrong


def planted(file: CalibrationFile, name: str, slip: Slipping) -> bytes:
    """Return a file whose numbers contain a slip but whose check point is that of the right one."""
    rectified = format_named(name).is_for_rectified
    right = export(file, name, rectified=rectified).data
    pose = read_any(right).pose
    numbers = slip(pose.as_written().as_matrix(), pose)
    meant = WrittenPose("matrix", numbers[:3, :3], numbers[:3, 3], pose.direction, pose.axes).camera_from_radar()
    calibration = dataclasses.replace(file.calibration, camera_from_radar=meant)
    wrong = export(dataclasses.replace(file, calibration=calibration), name, rectified=rectified)
    return with_check_point_of(right, wrong.data)


def named_errors(wrong: ImportedCalibration, file: CalibrationFile, by: str = "itself") -> list[str]:
    """Return the errors that a check by the file itself, by another calibration or by its own names, without staleness."""
    known = imported(file)
    report = check(wrong, against=known if by == "against" else None, of=known if by == "of" else None)
    if by == "itself" and not wrong.check_point:
        assert report.verdict in ("doubtful", "unproven")
    return [result.code for result in report.results if result.level == "error" and result.code != "stale"]


def explaining(wrong: ImportedCalibration, file: CalibrationFile, count: int = 1) -> set[str]:
    """Return every single slip, or every two, that would explain the numbers exactly."""
    right = file.calibration.camera_from_radar.as_matrix()
    slips = set()
    for candidate in undone_slips(wrong.pose):
        if len(candidate.slips) > count:
            break
        try:
            undone = candidate.pose.camera_from_radar().as_matrix()
        except ValueError:
            continue
        if np.abs(undone - right).max() < 1e-6 * (1 + np.abs(right).max()):
            slips.add("+".join(slip.code for slip in candidate.slips))
    return slips


EACH_WAY = ("json", "tf2", "urdf", "nuscenes", "colmap")
"""A format for each form, direction and axes in which a pose is written; what is undone depends on nothing else."""
IN_ALL = ("position-for-translation", "swapped-direction+millimetres")


def test_formats_write_a_pose_in_no_other_way():
    def way(name: str) -> tuple[str, ...]:
        written = read_any(export(file_of(any_pose(name)), name, rectified=format_named(name).is_for_rectified).data)
        return written.pose.form, written.pose.direction, written.pose.axes

    assert set(map(way, EACH_WAY)) == {way(known.name) for known in FORMATS}


@pytest.mark.parametrize(
    ("name", "slip"),
    [(known.name, slip) for known in FORMATS for slip in (SLIPS if known.name in EACH_WAY else IN_ALL)],
)
def test_a_planted_slip_is_named(name, slip):
    file = file_of(any_pose(f"{name} {slip}"))
    wrong = read_any(planted(file, name, SLIPS[slip]))

    slips = explaining(wrong, file, 1 + slip.count("+"))

    assert slip in slips
    for by in ("itself", "against", "of"):
        errors = named_errors(wrong, file, by)
        assert set(errors) <= slips
        assert errors or (by == "itself" and name in NO_COMMENT)


@pytest.mark.parametrize("name", ["urdf", "autoware", "tf2"])
@pytest.mark.parametrize("slip", ["degrees-for-radians", "angle-order"])
@settings(max_examples=10, deadline=None)
@given(pose=poses())
def test_wrong_angles_are_named(name, slip, pose):
    file = file_of(pose)
    text = export(file, name).data.decode()
    if name == "tf2":
        angles = Rotation.from_matrix(file.calibration.camera_from_radar.rotation.T).as_euler("xyz").tolist()
        named = " ".join(f"--{key} {angle!r}" for key, angle in zip(("roll", "pitch", "yaw"), angles, strict=True))
        text = re.sub(r"--qx .* \\", lambda _: f"{named} \\", text)

    def slipped(angles: list[str]) -> list[str]:
        return angles[::-1] if slip == "angle-order" else [repr(float(np.degrees(float(angle)))) for angle in angles]

    if name == "urdf":
        text = re.sub(r'rpy="([^"]+)"', lambda m: f'rpy="{" ".join(slipped(m[1].split()))}"', text, count=1)
    else:
        head, tail = text[: text.rindex("roll")], text[text.rindex("roll") :]
        head, tail = head[:-2] if name == "tf2" else head, ("--" if name == "tf2" else "") + tail
        replaced = iter(slipped([number for _, number in ANGLE.findall(tail)]))
        text = head + ANGLE.sub(lambda m: m[1] + next(replaced), tail)
    wrong = read_any(text.encode())
    assume(np.abs(wrong.camera_from_radar.as_matrix() - pose.as_matrix()).max() > 0.01)

    errors, slips = named_errors(wrong, file), explaining(wrong, file)

    assert slip in slips
    assert errors
    assert set(errors) <= slips


@settings(max_examples=20, deadline=None)
@given(pose=poses())
def test_radians_in_a_rig_that_expects_degrees_are_named(pose):
    file = file_of(pose)
    rig = json.loads(export(file, "driveworks").data)
    written = rig["rig"]["sensors"][1]["nominalSensor2Rig_FLU"]
    written["roll-pitch-yaw"] = np.radians(written["roll-pitch-yaw"]).tolist()
    wrong = read_any(json.dumps(rig).encode())
    assume(np.abs(wrong.camera_from_radar.as_matrix() - pose.as_matrix()).max() > 0.01)

    errors, slips = named_errors(wrong, file, "against"), explaining(wrong, file)

    assert "radians-for-degrees" in slips
    assert errors
    assert set(errors) <= slips
