"""Static transforms written beside a tree: never a second parent, and read back with the chain that they state."""

import dataclasses

import numpy as np
import pytest
from pytransform3d.urdf import UrdfTransformManager

from benchmarks.simulated_pairs import SystematicErrors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.check.report import check
from calib_core.interchange.exporting import attached_export, posed
from calib_core.interchange.format import imported
from calib_core.interchange.formats.registry import format_named
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import calibration_file
from calib_core.interchange.trees.frame_tree import FrameTree
from calib_core.interchange.trees.reading import TreeFile, read_tree
from tests.unit.interchange.trees import vehicles

FORMATS = ("tf2", "tf2-launch-py", "urdf")
ECHO = TreeFile(vehicles.REALSENSE_ECHO.encode(), "echo.yaml")


@pytest.fixture(scope="module")
def calibration(file: CalibrationFile) -> CalibrationFile:
    return dataclasses.replace(file, frames=FrameNames("radar", "camera_color_optical_frame"))


@pytest.fixture(scope="module")
def driver() -> FrameTree:
    return read_tree([ECHO])


@pytest.mark.parametrize("name", FORMATS)
def test_a_drivers_frame_gets_no_second_parent_and_the_file_reads_back(name, calibration, driver):
    written = attached_export(calibration, name, driver)

    assert "from radar to camera_link" in written.notes[-1]
    joint = read_tree([TreeFile(written.data, written.file_name)]).joints[0]
    assert (joint.parent, joint.child) == ("radar", "camera_link")
    whole = read_tree([TreeFile(written.data, written.file_name), ECHO])
    expected = calibration.calibration.camera_from_radar.as_matrix()
    np.testing.assert_allclose(
        whole.between("camera_color_optical_frame", "radar").as_matrix(), expected, rtol=0, atol=1e-9
    )
    again = read_any(written.data)
    assert (again.format, again.frames, again.assumptions) == (name, calibration.frames, ())
    assert again.calibration_sha256 is not None
    np.testing.assert_allclose(again.camera_from_radar.as_matrix(), expected, rtol=0, atol=1e-9)
    assert check(again, against=imported(calibration)).verdict == "right"
    assert check(again).verdict == "right"


def test_the_written_joint_is_that_of_pytransform3d(calibration, driver):
    manager = UrdfTransformManager()
    manager.load_urdf(attached_export(calibration, "urdf", driver).data.decode())

    link_from_camera = driver.between("camera_link", "camera_color_optical_frame").as_matrix()
    expected = link_from_camera @ calibration.calibration.camera_from_radar.as_matrix()
    np.testing.assert_allclose(manager.get_transform("radar", "camera_link"), expected, rtol=0, atol=1e-9)


def test_frames_that_are_already_connected_are_refused(calibration):
    tree = read_tree([TreeFile(vehicles.REALSENSE_URDF.encode(), "cart.urdf"), ECHO])

    with pytest.raises(InputError, match=r"already connected .*cart.urdf:3.* second parent; .* --into FILE"):
        attached_export(calibration, "tf2", tree)


def test_a_frame_that_is_not_in_the_tree_is_written_as_a_new_one(calibration, driver):
    other = dataclasses.replace(calibration, frames=FrameNames("radar", "front_optical"))
    written = attached_export(other, "tf2", driver)

    assert "no frame front_optical" in written.notes[-1]
    assert "--frame-id radar --child-frame-id front_optical" in written.data.decode()
    with pytest.raises(InputError, match="--tree is for formats that add a joint to a frame tree"):
        attached_export(calibration, "kitti", driver)


def test_the_pose_is_for_the_returns_that_are_asked_for(calibration, driver):
    """Of a radar that reports its azimuths 4 % too large."""
    errors = SystematicErrors(azimuth_scale=0.04)
    drawn = simulate_pairs(24, rng=np.random.default_rng(12), noise="imaging", systematic=errors)
    solved = calibration_file(calibrate_pairs(drawn.pairs, drawn.camera).unwrap())
    corrected = dataclasses.replace(solved, frames=calibration.frames)

    def written(returns):
        data = attached_export(corrected, "urdf", driver, returns=returns)
        whole = read_tree([TreeFile(data.data, data.file_name), ECHO])
        return whole.between("camera_color_optical_frame", "radar").as_matrix()

    raw = posed(corrected, format_named("urdf"), "raw")[0].calibration.camera_from_radar.as_matrix()
    np.testing.assert_allclose(written("raw"), raw, rtol=0, atol=1e-9)
    assert np.abs(written(None) - raw).max() > 1e-4
