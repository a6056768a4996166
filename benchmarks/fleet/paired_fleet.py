"""Simulated fleets at the level of pairs: every vehicle's mounting, pairs and calibrations, and what came of an answer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.fleet.simulated_poses import Spread, simulated_mounting
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.fleet import MountingScatter, fleet_prior_of, mounting_scatter, mountings_of, session_pose
from calib_core.fleet.mounting_coordinates import coordinate_jacobian, pose_from_coordinates
from calib_core.fleet.session_pose import CHI2_95
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform
from calib_core.measurements import Pair, Unsolvable
from calib_core.pose_difference import squared_distance
from calib_core.results import Calibration
from calib_core.stated_error import stated_error
from calib_core.synthetic import simulate_pairs
from calib_core.synthetic.rig import Rig, RigOptions, radar_stand
from calib_core.synthetic.simulated_pairs import SystematicErrors, draw_systematic_errors, study_camera
from calib_core.verdict import VerdictLevel, verdict_on

__all__ = ["Answer", "Setting", "Vehicle", "answered", "draw_vehicle", "prior_from", "prior_holds", "sigmas"]

PLACEMENTS = 20
KIND = "van"


@dataclass(frozen=True, slots=True)
class Setting:
    """How a fleet is drawn.

    Attributes:
        spread: of the true mountings.
        shared_errors: whether radar, lens and clicks of each vehicle have the errors that the options allow for; otherwise
            none, as `simulate_pairs` by default.
    """

    spread: Spread
    shared_errors: bool = True

    @property
    def text(self) -> str:
        """As it stands in the tables."""
        spread = f"{100 * self.spread.position_m:g} cm, {self.spread.rotation_deg:g} deg"
        return spread if self.shared_errors else f"{spread}; exact sensors"


@dataclass(frozen=True, slots=True, eq=False)
class Vehicle:
    """One vehicle: what an estimator is given, and the truth.

    Attributes:
        name: unique in its fleet.
        truth: camera_from_radar in the axes in which the radar reports.
        camera: the intrinsics as given.
        pairs: the first ones are those of a short session.
    """

    name: str
    truth: RigidTransform
    camera: Camera
    pairs: tuple[Pair, ...]

    def solved(self, count: int = PLACEMENTS, prior: FleetPrior | None = None) -> Calibration | Unsolvable:
        """Calibrate from the first pairs."""
        return calibrate_pairs(self.pairs[:count], self.camera, fleet_prior=prior)


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of a calibration.

    Attributes:
        level: of its verdict.
        inside: whether the truth is in its 95 % ellipsoid.
        kept: whether the errors of rotation and position are within the stated ones.
        sigma_cm: of the camera position: root of the trace.
        sigma_deg: of the rotation: root of the trace.
        error_cm: true error of the camera position.
        error_deg: true error of the rotation.
        warnings: codes.
        off_kind: whether the fleet's prior was refused.
    """

    level: VerdictLevel
    inside: bool = False
    kept: bool = False
    sigma_cm: float = float("nan")
    sigma_deg: float = float("nan")
    error_cm: float = float("nan")
    error_deg: float = float("nan")
    warnings: tuple[str, ...] = ()
    off_kind: bool = False


def draw_vehicle(
    setting: Setting, seed: Sequence[int], *, turned_deg: float = 0.0, placements: int = PLACEMENTS
) -> Vehicle:
    """Draw a vehicle; another seed is another vehicle with its own sensors.

    Args:
        setting: of its fleet.
        seed: any numbers.
        turned_deg: turn of the camera about a random axis, on top of the scatter: a vehicle off its kind.
        placements: how many pairs.
    """
    rng = np.random.default_rng(seed)
    truth = simulated_mounting(setting.spread, rng)
    axis = rng.standard_normal(3)
    turn_rad = np.deg2rad(turned_deg) * axis / np.linalg.norm(axis)
    truth = pose_from_coordinates(np.concatenate([np.zeros(3), turn_rad]), truth)
    systematic = draw_systematic_errors(rng) if setting.shared_errors else SystematicErrors()
    rig = Rig(study_camera(), truth, radar_stand(RigOptions()))
    drawn = simulate_pairs(placements, rng=rng, noise="ti", rig=rig, systematic=systematic)
    return Vehicle("-".join(map(str, seed)), drawn.camera_from_radar, drawn.camera, drawn.pairs)


def prior_from(vehicles: Sequence[Vehicle]) -> FleetPrior:
    """Return the prior of vehicles, as the fleet's report makes it: from their calibrations with 20 placements alone.

    Raises:
        ValueError: they give none.
    """
    calibrations = [(one.name, one.solved()) for one in vehicles]
    poses = [
        session_pose(outcome, vehicle=name, session="1")
        for name, outcome in calibrations
        if isinstance(outcome, Calibration)
    ]
    scatter = mounting_scatter(mountings_of(poses), vehicle_type=KIND)
    if not isinstance(scatter, MountingScatter):
        raise ValueError(scatter.reason)
    return fleet_prior_of(scatter)


def prior_holds(prior: FleetPrior, truth: RigidTransform) -> bool:
    """Return whether a true mounting is in the prior's 95 % ellipsoid."""
    return squared_distance(truth.error_from(prior.camera_from_radar), prior.covariance) <= CHI2_95


def answered(outcome: Calibration | Unsolvable, truth: RigidTransform) -> Answer:
    """Compare an answer with the truth."""
    level = verdict_on(outcome).level
    if isinstance(outcome, Unsolvable):
        return Answer(level, warnings=(outcome.code,))
    pose, stated = outcome.camera_from_radar, stated_error(outcome)
    away = pose.error_from(truth)
    error_cm = 100.0 * float(np.linalg.norm(pose.inverse().translation_m - truth.inverse().translation_m))
    error_deg = float(np.degrees(np.linalg.norm(away[3:])))
    sigma_cm, sigma_deg = sigmas(outcome.covariance, pose)
    return Answer(
        level,
        squared_distance(truth.error_from(pose), outcome.covariance) <= outcome.covariance_quantile,
        error_cm <= stated.position_cm and error_deg <= stated.rotation_deg,
        sigma_cm,
        sigma_deg,
        error_cm,
        error_deg,
        tuple(warning.code for warning in outcome.warnings),
        outcome.fleet is not None and not outcome.fleet.used,
    )


def sigmas(covariance: np.ndarray, camera_from_radar: RigidTransform) -> tuple[float, float]:
    """Return the standard deviations of camera position [cm] and rotation [deg]: the roots of the traces."""
    jacobian = coordinate_jacobian(camera_from_radar, camera_from_radar)
    variances = np.diag(jacobian @ covariance @ jacobian.T)
    return 100.0 * float(np.sqrt(variances[:3].sum())), float(np.degrees(np.sqrt(variances[3:].sum())))
