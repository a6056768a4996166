"""The numbers that the export panel shows are the file's own: direction, order, unit and value."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.interchange.calibration_file import FrameNames, choose_check_point
from calib_core.interchange.exporting import export
from calib_core.interchange.format import ImportedCalibration, WrittenPose
from calib_core.interchange.formats.registry import FORMATS
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.results import CheckPoint
from cocalib.web.channel.export_preview import export_preview, exported
from cocalib.web.exports import FieldError, fields_in, image_of, our_numbers, pose_in_file

NAMES = FrameNames("front_radar", "front_camera_optical")


def preview(file, key, query=""):
    form = next(form for form in FORMATS if form.name == key)
    ticked = "rectified=1" if form.is_for_rectified else ""
    return export_preview(file, key, "&".join(part for part in (query, ticked) if part), "drive")


@pytest.mark.parametrize("key", ["tf2", "tf2-launch-py", "urdf", "autoware", "apollo"])
def test_each_number_of_the_table_is_in_the_text_digit_by_digit(file, key):
    made = preview(file, key)
    rows = made.pose.numbers.rows
    assert len(rows) in (6, 7)
    for row in rows:
        (value,) = row.values
        assert re.search(rf"(?<![\d.]){re.escape(value)}(?![\d.])", made.text), row.name


def test_angles_that_the_file_states_in_degrees_are_shown_in_degrees(file):
    made = preview(file, "driveworks")
    sensor = json.loads(made.text)["rig"]["sensors"][1]["nominalSensor2Rig_FLU"]
    shown = {row.name: (float(row.values[0]), row.unit) for row in made.pose.numbers.rows}
    for name, angle_deg in zip(("roll", "pitch", "yaw"), sensor["roll-pitch-yaw"], strict=True):
        assert shown[name] == (pytest.approx(angle_deg, abs=1e-9), "deg")
    assert preview(file, "urdf").pose.numbers.rows[-1].unit == "rad"


@pytest.mark.parametrize("form", [form.name for form in FORMATS])
def test_the_table_and_the_words_give_the_calibration_back(file, form):
    made = preview(file, form)
    pose, numbers = made.pose, {row.name: row.values for row in made.pose.numbers.rows}
    turn = rotation_in(numbers, degrees=made.pose.numbers.rows[-1].unit == "deg")
    shift = np.array(numbers["t"] if "t" in numbers else [numbers[name][0] for name in "xyz"], dtype=float)
    point = np.array([7.0, -2.0, 0.5])
    optical = file.calibration.camera_from_radar @ point[None]
    link_from_optical = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    seen = link_from_optical @ optical[0] if "p_link" in pose.equation else optical[0]
    carried = turn @ point + shift if pose.carries == "camera_from_radar" else turn.T @ (point - shift)
    np.testing.assert_allclose(carried, seen, rtol=0, atol=1e-7)
    assert pose.equation in pose.words
    assert ("carry points from" in pose.words) is (pose.carries == "camera_from_radar")
    axes = np.array(pose.camera_axes)
    np.testing.assert_allclose(axes, turn if pose.carries == "camera_from_radar" else turn.T, rtol=0, atol=1e-8)


def rotation_in(numbers, degrees):
    from scipy.spatial.transform import Rotation

    if "R row 1" in numbers:
        return np.array([numbers[f"R row {row}"] for row in (1, 2, 3)], dtype=float)
    if "roll" in numbers:
        angles = [float(numbers[name][0]) for name in ("roll", "pitch", "yaw")]
        return Rotation.from_euler("xyz", angles, degrees=degrees).as_matrix()
    return Rotation.from_quat([float(numbers[name][0]) for name in ("qx", "qy", "qz", "qw")]).as_matrix()


@pytest.mark.parametrize(
    ("direction", "axes", "words"),
    [
        ("radar_from_camera", "optical", "are the pose of 'front_camera_optical' (z forward) in 'front_radar'"),
        ("radar_from_camera", "link", "are the pose of 'front_camera_link' (x forward) in 'front_radar'"),
        ("camera_from_radar", "optical", "carry points from 'front_radar' to 'front_camera_optical'"),
    ],
)
def test_the_words_name_the_frames_of_the_file_and_the_axes_of_the_camera(direction, axes, words):
    pose = WrittenPose("matrix", np.eye(3), np.array([0.1, 0.2, 0.3]), direction, axes)
    assert words in pose_in_file(ImportedCalibration("other", pose), NAMES).words


@pytest.mark.parametrize(
    ("key", "third"), [("autoware", "sensor_kit_base_link"), ("driveworks", "the rig"), ("nuscenes", "the ego frame")]
)
def test_of_two_poses_in_a_third_frame_the_file_s_own_numbers_are_shown(file, key, third):
    made = preview(file, key, "parent_from_radar=1.25,-0.5,0.75,0,0,0.6,0.8")
    assert f"of 'radar' and of {made.pose.camera_frame!r}" in made.pose.words
    assert [table.title for table in made.pose.in_third_frame] == [
        f"Pose of {name} in {third}" for name in ("radar", made.pose.camera_frame)
    ]
    radar, camera = ({row.name: row for row in table.rows} for table in made.pose.in_third_frame)
    assert [float(radar[name].values[0]) for name in "xyz"] == [1.25, -0.5, 0.75]
    assert all(camera[name].values[0] in made.text for name in "xyz")
    turns = [row for row in (*radar.values(), *camera.values()) if row.name not in "xyz"]
    assert all(row.values[0] in made.text or row.unit == "deg" for row in turns)
    assert made.pose.numbers.title == f"Pose of {made.pose.camera_frame} in radar"
    assert preview(file, key).pose.in_third_frame == ()


def test_the_calibration_s_own_pose_is_there_whatever_the_file_holds(file):
    ours = our_numbers(file.calibration.camera_from_radar)
    assert [row.name for row in ours.rows][-4:] == ["qw", "qx", "qy", "qz"]
    assert preview(file, "tf2").our_pose == preview(file, "kitti").our_pose == ours


def pixels_in(words):
    return [tuple(map(float, found)) for found in re.findall(r"pixel \((-?[\d.]+), (-?[\d.]+)\)", words)]


def test_a_file_with_its_lens_must_give_the_pixel(file):
    point = export_preview(file, "opencv", "", "drive").check_point
    (pixel,) = pixels_in(point.words)
    assert pixel == pytest.approx((point.u_px, point.v_px), abs=0.006)
    radar = [float(number) for number in re.findall(r"point \((.*?)\) m", point.words)[0].split(", ")]
    projected = file.calibration.camera.project(file.calibration.camera_from_radar @ np.array([radar]))[0]
    assert projected == pytest.approx(pixel, abs=0.01)
    assert "your reader" in point.words


def test_a_file_without_a_lens_must_give_the_point_in_the_camera_frame(file):
    point = export_preview(file, "urdf", "camera_frame=rear_optical", "drive").check_point
    assert point is not None
    assert file.check_point is not None
    at = re.search(r"expect \((.*?)\) m in 'rear_optical'", point.words)
    assert at is not None
    expected = (file.calibration.camera_from_radar @ file.check_point.radar_m[None])[0]
    np.testing.assert_allclose([float(number) for number in at[1].split(", ")], expected, atol=6e-4)


def test_a_file_for_rectified_images_names_both_pixels(file):
    camera = file.calibration.camera
    lens = Camera("plumb_bob", camera.width_px, camera.height_px, camera.matrix_px, np.array([-0.3, 0.1, 0, 0, 0]))
    calibration = replace(file.calibration, camera=lens)
    distorted = replace(file, calibration=calibration, check_point=choose_check_point(calibration))
    point = export_preview(distorted, "kitti", "rectified=1", "drive").check_point
    assert point is not None
    assert distorted.check_point is not None
    rectified, taken = pixels_in(point.words)
    assert taken == pytest.approx((point.u_px, point.v_px), abs=0.006)
    at = camera.matrix_px @ (calibration.camera_from_radar @ distorted.check_point.radar_m[None])[0]
    assert rectified == pytest.approx((at[:2] / at[2]).tolist(), abs=0.006)
    assert rectified != taken


def test_the_image_is_that_of_the_pair_it_was_chosen_from(file):
    pairs = tuple(replace(pair, image_time=index) for index, pair in enumerate(file.calibration.pairs))
    stamped = replace(file, calibration=replace(file.calibration, pairs=pairs))
    errors = stamped.calibration.radar_errors
    position = errors.corrected(pairs[image_of(stamped)].point_radar_m[None])[0]
    np.testing.assert_allclose(position, file.check_point.radar_m, rtol=0, atol=1e-3)
    elsewhere = replace(stamped, check_point=CheckPoint(np.array([50.0, 1.0, 2.0]), np.array([5.0, 5.0])))
    assert image_of(elsewhere) is None
    assert export_preview(elsewhere, "opencv", "", "drive").check_point.pair == ""
    assert export_preview(replace(file, check_point=None), "tf2", "", "drive").check_point is None


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
    fields = fields_in("", FrameNames("r", "c"))
    assert (fields.frames, fields.parent_from_radar, fields.rectified) == (FrameNames("r", "c"), None, False)


def test_a_lens_that_no_maps_can_rectify_asks_whether_the_images_are_rectified(file):
    camera = replace(file.calibration.camera, model="plumb_bob", distortion=[-5000.0, 0, 0, 0, 0])
    distorted = replace(file, calibration=replace(file.calibration, camera=camera))
    with pytest.raises(FieldError, match="no rectified image") as refused:
        exported(distorted, "kitti", "")
    assert refused.value.field == "rectified"
