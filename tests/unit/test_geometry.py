"""Rigid transforms by example; their laws are in tests/properties."""

import math

import numpy as np
import pytest

from calib_core.geometry import (
    RigidTransform,
    matrix_from_quaternion_wxyz,
    mounting_rotation,
    quaternion_wxyz_from_matrix,
    rotation_exp,
    rotation_log,
    skew,
)

QUARTER_ABOUT_Z = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def test_a_transform_moves_points_from_source_to_target():
    camera_from_radar = RigidTransform(QUARTER_ABOUT_Z, np.array([10.0, 0.0, 0.0]))
    points_camera = camera_from_radar @ np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 3.0]])
    np.testing.assert_allclose(points_camera, [[10.0, 1.0, 0.0], [8.0, 0.0, 3.0]])


@pytest.mark.parametrize(
    ("roll_pitch_yaw_deg", "seen_m", "optical"),
    [
        ((0.0, 0.0, 90.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),  # looks left: what is left is ahead
        ((0.0, 30.0, 0.0), (np.cos(np.pi / 6), 0.0, -0.5), (0.0, 0.0, 1.0)),  # looks down
        ((90.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, -1.0, 0.0)),  # its head to the right: right is up, and up is -y
    ],
)
def test_mounting_angles_turn_the_camera_as_they_say(roll_pitch_yaw_deg, seen_m, optical):
    assert mounting_rotation(*roll_pitch_yaw_deg) @ np.array(seen_m) == pytest.approx(optical, abs=1e-12)


def test_a_mirrored_rotation_is_refused_and_the_message_says_so():
    with pytest.raises(ValueError, match="left-handed"):
        RigidTransform(np.diag([1.0, -1.0, 1.0]), np.zeros(3))


@pytest.mark.parametrize(
    ("rotation", "translation", "reason"),
    [
        (2.0 * np.eye(3), np.zeros(3), "orthonormal"),
        (np.full((3, 3), np.nan), np.zeros(3), "finite"),
        (np.eye(3), np.array([0.0, np.inf, 0.0]), "finite"),
        (np.eye(4), np.zeros(3), "3 x 3"),
        (np.eye(3), np.zeros(2), "expected an array of 3"),
    ],
)
def test_an_invalid_transform_is_refused(rotation, translation, reason):
    with pytest.raises(ValueError, match=reason):
        RigidTransform(rotation, translation)


def test_a_rotation_rounded_to_six_decimals_can_be_inverted_and_composed():
    for seed in range(60):  # of seven of these, the rows are orthonormal within the tolerance and the columns are not
        rotation = rotation_exp(np.random.default_rng(seed).normal(0.0, 1.5, 3)).round(6)
        if np.abs(rotation @ rotation.T - np.eye(3)).max() <= 1e-6:
            transform = RigidTransform(rotation, np.ones(3))
            assert transform.rotation == pytest.approx(rotation, abs=2e-6)
            together = (transform @ transform.inverse()).as_matrix()
            assert together == pytest.approx(np.eye(4), abs=1e-11)


def test_a_transform_cannot_be_changed_and_does_not_share_its_arrays():
    rotation = np.eye(3)
    camera_from_radar = RigidTransform(rotation, np.zeros(3))
    rotation[0, 0] = 7.0
    assert camera_from_radar.rotation[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        camera_from_radar.rotation[0, 0] = 2.0


def test_quaternions_are_w_first_with_w_positive():
    half = math.sqrt(0.5)
    np.testing.assert_allclose(quaternion_wxyz_from_matrix(QUARTER_ABOUT_Z), [half, 0.0, 0.0, half])
    np.testing.assert_allclose(
        matrix_from_quaternion_wxyz(np.array([-half, 0.0, 0.0, -half])), QUARTER_ABOUT_Z, atol=1e-15
    )
    np.testing.assert_allclose(matrix_from_quaternion_wxyz(np.array([2.0, 0.0, 0.0, 2.0])), QUARTER_ABOUT_Z, atol=1e-15)


@pytest.mark.parametrize("quaternion", [np.zeros(4), np.array([np.nan, 0.0, 0.0, 1.0])])
def test_a_quaternion_without_direction_is_refused(quaternion):
    with pytest.raises(ValueError, match="not a rotation"):
        matrix_from_quaternion_wxyz(quaternion)


def test_skew_is_the_cross_product():
    a, b = np.array([1.0, -2.0, 3.0]), np.array([0.5, 4.0, -1.0])
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b))


def test_a_perturbation_shifts_the_translation_and_turns_from_the_left():
    camera_from_radar = RigidTransform(QUARTER_ABOUT_Z, np.array([1.0, 2.0, 3.0]))
    moved = camera_from_radar.perturbed(np.array([0.1, 0.2, 0.3, 0.01, 0.0, 0.0]))
    np.testing.assert_allclose(moved.translation_m, [1.1, 2.2, 3.3])
    np.testing.assert_allclose(moved.rotation, rotation_exp(np.array([0.01, 0.0, 0.0])) @ QUARTER_ABOUT_Z, atol=1e-15)


def test_the_adjoint_maps_a_small_motion_to_the_target_frame():
    camera_from_radar = RigidTransform(QUARTER_ABOUT_Z, np.array([1.0, 2.0, 3.0]))
    error = 1e-6 * np.array([1.0, -2.0, 0.5, 0.3, 0.7, -0.4])
    motion = RigidTransform(rotation_exp(error[3:]), error[:3])
    carried = camera_from_radar @ motion @ camera_from_radar.inverse()
    expected = camera_from_radar.adjoint() @ error
    np.testing.assert_allclose(carried.translation_m, expected[:3], atol=1e-11)
    np.testing.assert_allclose(rotation_log(carried.rotation), expected[3:], atol=1e-11)
