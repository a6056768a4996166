"""Laws of the reader for files that state nothing: however a pose is written, it is among the hypotheses, and pairs find it."""

import json
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calib_core.camera import Camera
from calib_core.geometry import (
    RigidTransform,
    quaternion_wxyz_from_matrix,
    rotation_angle_rad,
    rotation_exp,
    rotation_log,
)
from calib_core.interchange.check.pair_residuals import CheckPairs
from calib_core.interchange.hypotheses.ranking import hypotheses_of
from calib_core.interchange.hypotheses.reading import read_unstated
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, rpy_from_matrix

CAMERA = Camera("pinhole", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))
OPTICAL_FROM_BODY = LINK_FROM_OPTICAL.rotation.T
CAMERA_FROM_OPTICAL = {"optical": np.eye(3), "body": OPTICAL_FROM_BODY.T, "opengl": np.diag([1.0, -1, -1])}
RADAR_FROM_WRITTEN = {
    "flu": np.eye(3),
    "frd": np.diag([1.0, -1, -1]),
    "rfu": np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "optical-like": OPTICAL_FROM_BODY.T,
}
PER_METRE = {"m": 1.0, "mm": 1000.0, "cm": 100.0}


def _quaternion(pose: RigidTransform) -> np.ndarray:
    return quaternion_wxyz_from_matrix(pose.rotation)


WRITERS: dict[str, Callable[[RigidTransform], object]] = {
    "matrix": lambda pose: {"T": pose.as_matrix().tolist()},
    "flat": lambda pose: {"sensor": [{"extrinsic": pose.as_matrix().ravel().tolist()}]},
    "columns": lambda pose: {"T": pose.as_matrix().T.tolist()},
    "three-rows": lambda pose: {"calib": {"Rt": pose.as_matrix()[:3].tolist()}},
    "twelve": lambda pose: {"Rt": pose.as_matrix()[:3].ravel().tolist()},
    "twelve-by-columns": lambda pose: {"Rt": pose.as_matrix()[:3].T.ravel().tolist()},
    "R-and-t": lambda pose: {"R": pose.rotation.ravel().tolist(), "t": pose.translation_m.tolist()},
    "xyzw": lambda pose: {"rotation": np.roll(_quaternion(pose), -1).tolist(), "trans": pose.translation_m.tolist()},
    "wxyz": lambda pose: {"rotation": _quaternion(pose).tolist(), "position": pose.translation_m.tolist()},
    "seven": lambda pose: [*pose.translation_m.tolist(), *np.roll(_quaternion(pose), -1).tolist()],
    "named": lambda pose: (
        dict(zip(("qw", "qx", "qy", "qz"), _quaternion(pose).tolist(), strict=True))
        | dict(zip("xyz", pose.translation_m.tolist(), strict=True))
    ),
    "rvec": lambda pose: {"rvec": rotation_log(pose.rotation)[:, None].tolist(), "tvec": pose.translation_m.tolist()},
    "rpy": lambda pose: (
        dict(zip(("roll", "pitch", "yaw"), rpy_from_matrix(pose.rotation).tolist(), strict=True))
        | dict(zip("xyz", pose.translation_m.tolist(), strict=True))
    ),
    "rpy-in-degrees": lambda pose: {
        "euler": np.degrees(rpy_from_matrix(pose.rotation)).tolist(),
        "t": pose.translation_m.tolist(),
    },
    "yaw-first": lambda pose: {
        "ypr": rpy_from_matrix(pose.rotation)[::-1].tolist(),
        "t": pose.translation_m.tolist(),
    },
}


@st.composite
def mountings(draw: st.DrawFn) -> RigidTransform:
    """Draw a camera that looks about where the radar looks, within two metres of it."""
    turn = [draw(st.floats(-0.4, 0.4, allow_subnormal=False)) for _ in range(3)]
    apart_m = [draw(st.floats(-1.2, 1.2, allow_subnormal=False)) for _ in range(3)]
    return RigidTransform(rotation_exp(np.array(turn)) @ OPTICAL_FROM_BODY, apart_m)


def written(pose: RigidTransform, direction: str, camera: str, radar: str, unit: str) -> RigidTransform:
    """Return camera_from_radar as a tool with these conventions writes it."""
    left, right = CAMERA_FROM_OPTICAL[camera], RADAR_FROM_WRITTEN[radar]
    carried = RigidTransform(left @ pose.rotation @ right, left @ pose.translation_m)
    one = carried if direction == "camera_from_radar" else carried.inverse()
    return RigidTransform(one.rotation, one.translation_m * PER_METRE[unit])


def _same(a: RigidTransform, b: RigidTransform) -> bool:
    apart_m = float(np.abs(a.translation_m - b.translation_m).max())
    return rotation_angle_rad(a.rotation @ b.rotation.T) < 1e-3 and apart_m < 1e-3


conventions = st.tuples(
    st.sampled_from(["camera_from_radar", "radar_from_camera"]),
    st.sampled_from(sorted(CAMERA_FROM_OPTICAL)),
    st.sampled_from(sorted(RADAR_FROM_WRITTEN)),
    st.sampled_from(sorted(PER_METRE)),
)


@pytest.mark.parametrize("writer", WRITERS)
@settings(max_examples=4, deadline=None)
@given(pose=mountings(), convention=conventions)
def test_a_pose_is_among_the_hypotheses_however_it_is_written(writer, pose, convention):
    file = read_unstated(json.dumps(WRITERS[writer](written(pose, *convention))), "file.json")
    hypotheses = hypotheses_of(file.pose_at(None))
    fitting = [one for one in hypotheses if _same(one.camera_from_radar, pose)]
    assert fitting
    direction, camera, radar, unit = convention
    meanings = [meaning for one in fitting for meaning in one.meanings]
    if np.abs(pose.translation_m).max() > 0.1:
        assert any({direction, camera, radar, unit} <= set(meaning.parts) for meaning in meanings)


_TURNS = ("matrix", "R-and-t", "wxyz", "rvec", "yaw-first")


@pytest.mark.parametrize(
    "writer", [name if name in _TURNS else pytest.param(name, marks=pytest.mark.slow) for name in WRITERS]
)
@settings(max_examples=4, deadline=None)
@given(pose=mountings(), convention=conventions, seed=st.integers(0, 2**32 - 1))
def test_pairs_find_the_pose_among_the_hypotheses(writer, pose, convention, seed):
    rng = np.random.default_rng(seed)
    pixels_px = rng.uniform((0, 0), (640, 480), (20, 2))
    points_radar_m = pose.inverse() @ (CAMERA.rays(pixels_px) * rng.uniform(3, 15, (20, 1)))
    pairs = CheckPairs(points_radar_m, pixels_px + rng.normal(0, 1, (20, 2)), CAMERA)
    file = read_unstated(json.dumps(WRITERS[writer](written(pose, *convention))), "file.json")
    first = hypotheses_of(file.pose_at(None), pairs=pairs)[0]
    assert first.fits
    at_right = np.linalg.norm(pairs.camera.project(first.camera_from_radar @ points_radar_m) - pixels_px, axis=1)
    assert float(np.median(at_right)) < 3.0
    if np.abs(pose.translation_m).max() > 0.3:
        assert _same(first.camera_from_radar, pose)


@settings(max_examples=20, deadline=None)
@given(pose=mountings(), convention=conventions)
def test_another_calibration_finds_the_pose_among_the_hypotheses(pose, convention):
    file = read_unstated(json.dumps({"T": written(pose, *convention).as_matrix().tolist()}), "file.json")
    first = hypotheses_of(file.pose_at(None), against=pose)[0]
    assert first.fits
    if np.abs(pose.translation_m).max() > 0.1:
        assert _same(first.camera_from_radar, pose)


@settings(max_examples=20, deadline=None)
@given(pose=mountings(), convention=conventions)
def test_the_shares_add_up_and_no_two_hypotheses_are_one_pose(pose, convention):
    file = read_unstated(json.dumps({"T": written(pose, *convention).as_matrix().tolist()}), "file.json")
    hypotheses = hypotheses_of(file.pose_at(None))
    assert sum(one.share for one in hypotheses) == pytest.approx(1.0)
    keys = [meaning.key for one in hypotheses for meaning in one.meanings]
    assert len(keys) == len(set(keys)) == 72
