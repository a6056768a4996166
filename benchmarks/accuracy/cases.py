"""Pairs with known truth: noise, number of pairs, share of wrong pairs, what the estimator is given, and the bound."""

from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np

from benchmarks.simulated_pairs import (
    AISLE,
    FIELD,
    NOISE_PROFILES,
    NoiseName,
    SimulatedPairs,
    simulate_pairs,
    study_camera,
)
from calib_core.association.clustering import candidate_at
from calib_core.geometry import camera_position_jacobian
from calib_core.measurements import Pair
from calib_core.options import (
    CalibrationOptions,
    CameraPositionPrior,
    LensOptions,
    NoiseOptions,
    RadarOptions,
    ReflectorOptions,
    SolvingOptions,
)
from calib_core.radar import covariance_from_sigma_polar, sigma_polar_of
from calib_core.synthetic.rig import RigOptions, random_rig

SceneName = Literal["field", "aisle"]

_CROWD = 200  # with more pairs than this, placements may be close together
_BLOCK = 50
_NOT_GIVEN = 0.0


@dataclass(frozen=True, slots=True)
class Case:
    """What is drawn, and what the estimator is given."""

    noise: NoiseName
    pairs: int
    outlier_share: float = 0.0
    tape_m: float | None = 0.01
    """Sigma of the tape-measured camera position [m]; None: not measured."""
    scene: SceneName = "field"
    told: float = 1.0
    """The radar sigmas given to the estimator, over the true ones; 0: none are given, for radar and clicks."""

    @property
    def key(self) -> str:
        """A file name."""
        known = "free" if self.tape_m is None else "tape"
        return f"{self.scene}-{self.noise}-{self.pairs}-{self.outlier_share:.0%}-{known}-{self.told:.2f}".replace(
            "%", "pc"
        )


def tape_measured(sigma_m: float | None) -> SolvingOptions:
    """Return solving options with the rig's nominal camera position and this standard deviation."""
    return SolvingOptions(
        camera_position=None if sigma_m is None else CameraPositionPrior(RigOptions().camera_offset_m, sigma_m)
    )


def exact_instruments(options: CalibrationOptions) -> CalibrationOptions:
    """Return the options with every systematic error ruled out, as the bound assumes."""
    radar, lens, reflector = ([0.0] * len(fields(kind)) for kind in (RadarOptions, LensOptions, ReflectorOptions))
    return replace(options, radar=RadarOptions(*radar), lens=LensOptions(*lens), reflector=ReflectorOptions(*reflector))


def options_of(case: Case) -> CalibrationOptions:
    """Return the options given to our estimator along with pairs that have no systematic errors."""
    return exact_instruments(CalibrationOptions(noise=NoiseOptions(), solving=tape_measured(case.tape_m)))


def draw(case: Case, trial: int) -> SimulatedPairs:
    """Draw one trial. The seed depends on the trial only: every method gets the same pairs, with or without a tape prior."""
    rng = np.random.default_rng([2023, trial])
    layout = AISLE if case.scene == "aisle" else FIELD
    if case.pairs > _CROWD:
        simulated = _crowd(case, rng)
    else:
        simulated = simulate_pairs(
            case.pairs, rng=rng, noise=case.noise, outlier_share=case.outlier_share, layout=layout
        )
    return (
        simulated
        if case.told == 1.0
        else replace(simulated, pairs=tuple(_with_given_noise(p, case.told) for p in simulated.pairs))
    )


def _crowd(case: Case, rng: np.random.Generator) -> SimulatedPairs:
    """Draw many pairs of one rig, block by block."""
    rig = random_rig(rng, camera=study_camera())
    blocks = [
        simulate_pairs(_BLOCK, rng=rng, noise=case.noise, outlier_share=case.outlier_share, rig=rig)
        for _ in range(case.pairs // _BLOCK)
    ]
    pairs = [replace(pair, id=f"b{i}{pair.id}") for i, block in enumerate(blocks) for pair in block.pairs]
    return SimulatedPairs(
        rig,
        tuple(pairs),
        np.concatenate([block.points_radar_m for block in blocks]),
        np.concatenate([block.pixels_px for block in blocks]),
        np.concatenate([block.outlier for block in blocks]),
        tuple(place for block in blocks for place in block.true_candidate),
    )


def _with_given_noise(pair: Pair, factor: float) -> Pair:
    if factor == _NOT_GIVEN:
        candidates = tuple(candidate_at(one.position_radar_m, NoiseOptions()) for one in pair.candidates)
        return replace(pair, candidates=candidates, sigma_px=None)
    return replace(
        pair, candidates=tuple(replace(one, sigma_polar=one.sigma_polar * factor) for one in pair.candidates)
    )


@dataclass(frozen=True, slots=True)
class Bound:
    """The Cramer-Rao bound as standard deviations: rotation (total angle) and camera position (distance)."""

    rotation_rad: float
    position_m: float


def bound_of(
    simulated: SimulatedPairs, noise: NoiseName, tape_m: float | None, *, points_radar_m: np.ndarray | None = None
) -> Bound:
    """Return the bound of an estimator that knows which pairs are right.

    The information of a right pair is J^T S^-1 J at its true position, S = C + J V J^T.

    Args:
        simulated: truth and pairs.
        noise: the true noise.
        tape_m: sigma of the measured camera position [m]; None: not measured.
        points_radar_m: (n, 3) true positions; None takes those of the right pairs.
    """
    profile, pose = NOISE_PROFILES[noise], simulated.camera_from_radar
    points = simulated.points_radar_m[~simulated.outlier] if points_radar_m is None else points_radar_m
    jacobian = simulated.camera.pose_jacobian(pose, points)
    d_point = simulated.camera.project_with_jacobian(pose @ points)[1] @ pose.rotation
    radar = covariance_from_sigma_polar(points, np.tile(sigma_polar_of(profile), (len(points), 1)))
    spread = d_point @ radar @ np.swapaxes(d_point, 1, 2) + profile.sigma_px**2 * np.eye(2)
    information = (np.swapaxes(jacobian, 1, 2) @ np.linalg.solve(spread, jacobian)).sum(axis=0)
    to_centre = camera_position_jacobian(pose)
    if tape_m is not None:
        information = information + to_centre.T @ to_centre / tape_m**2
    covariance = np.linalg.inv(information)
    return Bound(
        rotation_rad=float(np.sqrt(np.trace(covariance[3:, 3:]))),
        position_m=float(np.sqrt(np.trace(to_centre @ covariance @ to_centre.T))),
    )
