"""Simulated fleets: true mountings with a known scatter, and calibrations that are off by a normal error of known covariance."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.fleet import SessionPose
from calib_core.fleet.mounting_scatter import coordinate_jacobian, pose_from_coordinates
from calib_core.geometry import OPTICAL_FROM_LINK, RigidTransform, rotation_from_euler
from calib_core.measurements import NS_PER_S, TimeNs

__all__ = [
    "NOMINAL",
    "Accuracy",
    "SimulatedFleet",
    "Spread",
    "simulated_fleet",
    "simulated_mounting",
    "simulated_session",
]

_ROTATION = OPTICAL_FROM_LINK @ rotation_from_euler(0.02, 0.1, 0.03)
NOMINAL = RigidTransform(_ROTATION, -_ROTATION @ np.array([0.05, 0.2, 0.3]))
"""The mean pose of the simulated vehicle type: the camera 5 cm in front of the radar, 20 cm left of it, 30 cm above."""

_FROM_COORDINATES = np.linalg.inv(coordinate_jacobian(NOMINAL, NOMINAL))
_WRONG_RADAR = np.array([0.3, -0.1, 0.0, 0.0, 0.1, 0.3])
_REMOUNT_DEG = 4.0
_YEAR_NS = 365 * 24 * 3600 * NS_PER_S


@dataclass(frozen=True, slots=True)
class Spread:
    """How far mountings scatter along each axis: standard deviations of position [m] and rotation [deg]."""

    position_m: float
    rotation_deg: float


@dataclass(frozen=True, slots=True)
class Accuracy:
    """How accurate calibrations are: standard deviations per axis, on average, and the share that sessions have in common."""

    position_m: float
    rotation_deg: float
    systematic: float = 0.3


@dataclass(frozen=True, slots=True)
class SimulatedFleet:
    """A fleet and what is true of it.

    Attributes:
        sessions: of all vehicles.
        remounted: names of the vehicles whose radar was remounted once.
        wrong: names of those with a wrong radar.
    """

    sessions: tuple[SessionPose, ...]
    remounted: frozenset[str]
    wrong: frozenset[str]


def simulated_mounting(spread: Spread, rng: np.random.Generator) -> RigidTransform:
    """Draw the true pose of one vehicle."""
    position_m = spread.position_m * rng.standard_normal(3)
    turned_rad = np.deg2rad(spread.rotation_deg) * rng.standard_normal(3)
    return pose_from_coordinates(np.concatenate([position_m, turned_rad]), NOMINAL)


def simulated_covariance(accuracy: Accuracy, rng: np.random.Generator) -> Matrix66:
    """Draw the covariance of one calibration: correlated, and unequal along the axes, as few placements make it."""
    mixed = rng.standard_normal((6, 12))
    scale = np.diag(np.repeat([accuracy.position_m, np.deg2rad(accuracy.rotation_deg)], 3)) @ mixed / np.sqrt(12.0)
    return np.asarray(_FROM_COORDINATES @ scale @ scale.T @ _FROM_COORDINATES.T)


def simulated_session(
    truth: RigidTransform,
    accuracy: Accuracy,
    rng: np.random.Generator,
    *,
    vehicle: str,
    number: int = 0,
    covariance: Matrix66 | None = None,
    common: np.ndarray | None = None,
) -> SessionPose:
    """Draw one calibration of a vehicle.

    Args:
        truth: its true pose.
        accuracy: of the calibration.
        rng: the source of its error.
        vehicle: its name.
        number: of the session; sessions are a year apart.
        covariance: (6, 6) of the calibration; None draws one.
        common: (6,) standard normal numbers that the systematic part of its error is made of; None draws them.
    """
    stated = simulated_covariance(accuracy, rng) if covariance is None else covariance
    root = np.linalg.cholesky(stated)
    shared = rng.standard_normal(6) if common is None else common
    own = rng.standard_normal(6)
    error = root @ (np.sqrt(accuracy.systematic) * shared + np.sqrt(1.0 - accuracy.systematic) * own)
    return SessionPose(
        vehicle,
        f"{vehicle}-{number}",
        truth.perturbed(error),
        stated,
        accuracy.systematic * stated,
        time_ns=TimeNs(number * _YEAR_NS),
        radar_serial=f"radar-{vehicle}",
        camera_serial=f"camera-{vehicle}",
    )


def simulated_fleet(
    spread: Spread,
    accuracy: Accuracy,
    rng: np.random.Generator,
    *,
    vehicles: int = 50,
    sessions: int = 3,
    remounts: int = 3,
    wrong: int = 2,
) -> SimulatedFleet:
    """Draw a fleet with remounts and wrong radars.

    A remount turns the radar by 4 deg about every axis, some time after the first session; a wrong radar is 30 cm and 17 deg off.

    Args:
        spread: of the mountings.
        accuracy: of the calibrations.
        rng: the source of all randomness.
        vehicles: how many.
        sessions: of each.
        remounts: how many vehicles are remounted once.
        wrong: how many others have a wrong radar.
    """
    names = [f"vehicle-{k:03d}" for k in range(vehicles)]
    chosen = rng.permutation(vehicles)[: remounts + wrong].tolist()
    remounted, odd = (frozenset(names[k] for k in row) for row in (chosen[:remounts], chosen[remounts:]))
    rows = []
    for name in names:
        truth = simulated_mounting(spread, rng)
        if name in odd:
            truth = pose_from_coordinates(_WRONG_RADAR, truth)
        turned_rad = np.deg2rad(_REMOUNT_DEG) * rng.choice([-1.0, 1.0], 3)
        first_after = int(rng.integers(1, sessions))
        covariance, common = simulated_covariance(accuracy, rng), rng.standard_normal(6)
        for number in range(sessions):
            moved = name in remounted and number >= first_after
            pose = pose_from_coordinates(np.concatenate([np.zeros(3), turned_rad]), truth) if moved else truth
            rows.append(
                simulated_session(
                    pose, accuracy, rng, vehicle=name, number=number, covariance=covariance, common=common
                )
            )
    return SimulatedFleet(tuple(rows), remounted, odd)
