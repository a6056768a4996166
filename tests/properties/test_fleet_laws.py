"""Laws of the fleet's mathematics: frames, order, and what more data does."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.fleet.simulated_poses import NOMINAL, Accuracy, Spread, simulated_mounting, simulated_session
from calib_core.fleet import (
    MountingScatter,
    SessionPose,
    mounting_of,
    mounting_scatter,
    mountings_of,
    transition,
)
from calib_core.fleet.mounting_scatter import coordinate_jacobian, coordinates, pose_from_coordinates
from calib_core.geometry import RigidTransform, rotation_exp

_seeds = st.integers(0, 2**32 - 1)
_vectors = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6).map(np.array)
_few = settings(max_examples=8, deadline=None)


def _poses(vectors: np.ndarray) -> RigidTransform:
    return RigidTransform(rotation_exp(vectors[3:]), vectors[:3])


def _sessions(seed: int, vehicles: int = 6, each: int = 2) -> list[SessionPose]:
    rng, accuracy = np.random.default_rng(seed), Accuracy(0.01, 0.2)
    truths = [simulated_mounting(Spread(0.01, 0.5), rng) for _ in range(vehicles)]
    return [
        simulated_session(truth, accuracy, rng, vehicle=f"v{k}", number=number)
        for k, truth in enumerate(truths)
        for number in range(each)
    ]


def _moved(session: SessionPose, camera_turned: np.ndarray, radar_from_other: RigidTransform) -> SessionPose:
    """Write a session in turned camera axes, and from another radar frame that is fixed to the first."""
    turned = RigidTransform(camera_turned, np.zeros(3))
    change = np.zeros((6, 6))  # of (dt, dtheta): t' = Q (R s + t), so dt' = Q (dt - [R s]x dtheta)
    change[:3, :3] = change[3:, 3:] = camera_turned
    lever = session.camera_from_radar.rotation @ radar_from_other.translation_m
    change[:3, 3:] = camera_turned @ np.cross(np.eye(3), lever).T
    covariance, systematic = (change @ one @ change.T for one in (session.covariance, session.systematic))
    pose = turned @ session.camera_from_radar @ radar_from_other
    return SessionPose(
        session.vehicle,
        session.session,
        pose,
        (covariance + covariance.T) / 2.0,
        (systematic + systematic.T) / 2.0,
        time_ns=session.time_ns,
    )


def _scatter(sessions: list[SessionPose]) -> MountingScatter:
    scatter = mounting_scatter(mountings_of(sessions), vehicle_type="van")
    assert isinstance(scatter, MountingScatter)
    return scatter


@given(_vectors, _vectors)
def test_coordinates_and_back(values, common):
    centre = _poses(common)
    np.testing.assert_allclose(coordinates(pose_from_coordinates(values, centre), centre), values, atol=1e-9)


@given(_vectors, _vectors)
def test_the_jacobian_of_the_coordinates_is_the_slope_of_the_numbers(one, other):
    common, step = _poses(other), 1e-6
    pose = pose_from_coordinates(one, common)
    columns = [
        (coordinates(pose.perturbed(step * axis), common) - coordinates(pose.perturbed(-step * axis), common))
        / (2 * step)
        for axis in np.eye(6)
    ]
    np.testing.assert_allclose(coordinate_jacobian(pose, common), np.stack(columns, axis=-1), atol=2e-6)


@_few
@given(_seeds, st.randoms(use_true_random=False))
def test_the_order_of_the_sessions_changes_nothing(seed, random):
    sessions = _sessions(seed)
    shuffled = list(sessions)
    random.shuffle(shuffled)
    one, other = _scatter(sessions), _scatter(shuffled)
    np.testing.assert_array_equal(one.scatter, other.scatter)
    assert [mounting.sessions for mounting in one.mountings] == [mounting.sessions for mounting in other.mountings]


@_few
@given(_seeds, st.integers(2, 5))
def test_another_session_never_widens_a_mounting(seed, count):
    rng = np.random.default_rng(seed)
    rows = [simulated_session(NOMINAL, Accuracy(0.01, 0.2, systematic=0.0), rng, vehicle="van") for _ in range(count)]
    fewer, more = mounting_of(rows[:-1]).covariance, mounting_of(rows).covariance
    root = np.linalg.inv(np.linalg.cholesky(fewer))
    assert np.linalg.eigvalsh(root @ more @ root.T)[-1] <= 1.0 + 1e-6


@_few
@given(_seeds)
def test_a_transition_there_and_back_is_as_large(seed):
    one, other = _sessions(seed, vehicles=1)
    there, back = transition(one, other), transition(other, one)
    assert np.isclose(there.squared, back.squared, rtol=1e-6)
    assert np.isclose(there.rotation_deg, back.rotation_deg)
    assert np.isclose(there.position_cm, back.position_cm)
    assert there.is_remount == back.is_remount


@_few
@given(_seeds, st.floats(1.0, 100.0))
def test_wider_error_bars_never_make_a_remount(seed, wider):
    one, other = _sessions(seed, vehicles=1)
    wide = SessionPose("v0", "wide", other.camera_from_radar, wider * other.covariance)
    assert transition(one, wide).squared <= transition(one, other).squared * (1.0 + 1e-9)
