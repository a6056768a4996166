"""The numbers that the export panel shows are the file's own: direction, order, unit and value."""

import json
import re

import numpy as np
import pytest

from calib_core.interchange import (
    FORMATS,
    FrameNames,
    ImportedCalibration,
    WrittenPose,
)
from cocalib.web.channel.export_preview import export_preview
from cocalib.web.exports.file_numbers import our_numbers, pose_in_file

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


def test_the_words_name_the_frames_of_the_file_and_the_axes_of_the_camera():
    turn, shift = np.eye(3), np.array([0.1, 0.2, 0.3])
    optical, link, forward = (
        pose_in_file(ImportedCalibration("other", WrittenPose("matrix", turn, shift, direction, axes)), NAMES)
        for direction, axes in (
            ("radar_from_camera", "optical"),
            ("radar_from_camera", "link"),
            ("camera_from_radar", "optical"),
        )
    )
    assert "are the pose of 'front_camera_optical' (z forward) in 'front_radar'" in optical.words
    assert "are the pose of 'front_camera_link' (x forward) in 'front_radar'" in link.words
    assert "carry points from 'front_radar' to 'front_camera_optical'" in forward.words


@pytest.mark.parametrize(
    ("key", "third"), [("autoware", "sensor_kit_base_link"), ("driveworks", "the rig"), ("nuscenes", "the ego frame")]
)
def test_of_two_poses_in_a_third_frame_the_file_s_own_numbers_are_shown(file, key, third):
    made = preview(file, key, "parent_from_radar=1.25,-0.5,0.75,0,0,0.6,0.8")
    assert f"are the poses of 'radar' and of {made.pose.camera_frame!r}" in made.pose.words
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
