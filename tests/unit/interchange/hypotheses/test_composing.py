"""Poses of data sets that name their frames are composed; a pose whose names say lidar is never silently the radar's."""

import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, rotation_from_euler
from calib_core.interchange.exporting import export
from calib_core.interchange.format import looks_like_lidar, of_lidar
from calib_core.interchange.hypotheses.composing import read_composed
from calib_core.interchange.hypotheses.ranking import clear_one, hypotheses_of
from calib_core.interchange.hypotheses.reading import as_imported, read_unstated
from calib_core.interchange.importing import read_any
from calib_core.interchange.trees.frame_choice import WantedFrames
from calib_core.interchange.trees.reading import TreeFile

OPTICAL_FROM_LINK = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
BODY_FROM_RADAR = RigidTransform(rotation_from_euler(0.01, -0.02, 0.03), np.array([3.6, 0.1, 0.5]))
BODY_FROM_CAMERA = RigidTransform(
    rotation_from_euler(-0.01, 0.03, -0.02) @ OPTICAL_FROM_LINK.T, np.array([1.5, -0.05, 1.4])
)
BODY_FROM_LIDAR = RigidTransform(rotation_from_euler(0, 0, 0.4), np.array([1.0, 0.0, 1.8]))
CAMERA_FROM_RADAR = BODY_FROM_CAMERA.inverse() @ BODY_FROM_RADAR
K = [[900, 0, 640], [0, 900, 360], [0, 0, 1]]


def rows(pose: RigidTransform) -> list[list[float]]:
    return pose.as_matrix().tolist()


def file_of(name: str, content: object) -> TreeFile:
    return TreeFile(json.dumps(content).encode(), name)


def lines(name: str, pose: RigidTransform) -> TreeFile:
    return TreeFile("\n".join(" ".join(map(repr, row)) for row in rows(pose)).encode(), name)


def astyx(*radars: str) -> TreeFile:
    sensors: list[object] = [
        {"sensor_uid": radar, "calib_data": {"T_to_ref_COS": rows(BODY_FROM_RADAR)}} for radar in radars
    ]
    sensors += [
        {"sensor_uid": "camera_front", "calib_data": {"K": K, "T_to_ref_COS": rows(BODY_FROM_CAMERA)}},
        {"sensor_uid": "lidar_vlp16", "calib_data": {"T_to_ref_COS": rows(BODY_FROM_LIDAR)}},
    ]
    return file_of("000000.json", {"sensors": sensors})


AIMOTIVE = file_of(
    "calibration.json",
    {
        "F_MIDRANGECAM": {"K": K, "RT_sensor_from_body": rows(BODY_FROM_CAMERA.inverse())},
        "FRONT_RADAR": {"RT_body_from_sensor": rows(BODY_FROM_RADAR)},
    },
)
BY_POSE = file_of("rig.json", {"radar": {"T": rows(BODY_FROM_RADAR)}, "camera": {"T": rows(BODY_FROM_CAMERA)}})
BOREAS = (
    lines("T_camera_lidar.txt", BODY_FROM_CAMERA.inverse() @ BODY_FROM_LIDAR),
    lines("T_radar_lidar.txt", BODY_FROM_RADAR.inverse() @ BODY_FROM_LIDAR),
)
BOTH_WAYS = file_of(
    "extrinsics.json",
    {
        "lidar_to_camera": rows(BODY_FROM_CAMERA.inverse() @ BODY_FROM_LIDAR),
        "radar2lidar": rows(BODY_FROM_LIDAR.inverse() @ BODY_FROM_RADAR),
    },
)


@pytest.mark.parametrize(
    "files", [(astyx("radar_6455"),), (AIMOTIVE,), (BY_POSE,), BOREAS, BOREAS[::-1], (BOTH_WAYS,)], ids=range(6)
)
def test_poses_are_composed_through_any_common_frame_and_stay_assumed(files):
    found = read_composed(files, WantedFrames())
    assert found is not None
    np.testing.assert_allclose(found.camera_from_radar.as_matrix(), CAMERA_FROM_RADAR.as_matrix(), atol=1e-9)
    assert found.assumptions
    assert found.evidence is None


def test_of_several_radars_one_is_named_and_the_cameras_matrix_comes_along():
    with pytest.raises(InputError, match="--radar NAME"):
        read_composed([astyx("radar_left", "radar_right")], WantedFrames())
    found = read_composed([astyx("radar_left", "radar_right")], WantedFrames("radar_right", "camera_front"))
    assert found is not None
    assert found.frames is not None
    assert (found.frames.radar, found.frames.camera) == ("radar_right", "camera_front")
    assert found.matrix_px is not None
    assert found.matrix_px[0, 0] == 900.0
    lidar = read_composed([astyx("radar_left")], WantedFrames("lidar_vlp16", "camera_front"))
    assert lidar is not None
    assert lidar.assumptions[0] == of_lidar("lidar_vlp16")


def test_files_that_do_not_connect_the_two_or_state_their_meaning_are_not_composed():
    assert read_composed([lines("T_cam_radar.txt", CAMERA_FROM_RADAR)], WantedFrames()) is None
    assert read_composed([BOREAS[0], lines("T_camera_lidar_2.txt", BODY_FROM_LIDAR)], WantedFrames()) is None


@pytest.mark.parametrize("name", ["T_camera_lidar", "T_ldr2cam"])
@pytest.mark.parametrize("inside", [False, True])
def test_a_pose_named_after_a_lidar_is_never_clear_and_says_so_first(name, inside):
    pose = BODY_FROM_CAMERA.inverse() @ BODY_FROM_LIDAR
    file = file_of("c.json", {name: rows(pose)}) if inside else lines(f"{name}.txt", pose)
    unstated = read_unstated(file.data, file.source)
    assert unstated is not None
    (found,) = unstated.poses
    hypotheses = hypotheses_of(found)
    assert clear_one(found, hypotheses) is None
    imported = as_imported(unstated, found, hypotheses[0], by_hand=True)
    assert imported.assumptions[0] == of_lidar(name)


KITTI = "P2: 721.5 0 609.6 0 0 721.5 172.9 0 0 0 1 0\nR0_rect: 1 0 0 0 1 0 0 0 1\n" + (
    "Tr_velo_to_cam: " + " ".join(map(str, (BODY_FROM_CAMERA.inverse() @ BODY_FROM_LIDAR).as_matrix()[:3].ravel()))
)


@pytest.mark.parametrize(
    ("path", "lidar"),
    [
        ("kitti/training/calib/000000.txt", True),
        ("view_of_delft_PUBLIC/radar/training/calib/00000.txt", False),
        ("view_of_delft_PUBLIC/radar_5frames/training/calib/00000.txt", False),
        ("view_of_delft_PUBLIC/lidar/training/calib/00000.txt", True),
        ("TJ4DRadSet_4DRadar/calib/000000.txt", False),
    ],
)
def test_kittis_key_is_a_lidars_but_in_a_radars_folder(path, lidar):
    found = read_any(KITTI, f"/data/{path}")
    assert (of_lidar("Tr_velo_to_cam") == found.assumptions[0]) == lidar
    assert (of_lidar("Tr_velo_to_cam") in found.assumptions) == lidar


def test_our_own_export_in_kittis_keys_is_the_radars(file):
    written = export(file, "kitti")
    assert not any("lidar" in one for one in read_any(written.data, str(Path("/data/calib.txt"))).assumptions)


@pytest.mark.parametrize("name", ["velodyne", "os1_sensor", "livox_frame", "hesai", "lidar_top", "T_os1_cam", "ldr"])
def test_names_of_lidars(name):
    assert looks_like_lidar(name)


@pytest.mark.parametrize("name", ["velocity", "pos1", "radar_front", "T_cam_radar", "calibration"])
def test_other_names(name):
    assert not looks_like_lidar(name)
