"""What is simulated: noise, number of pairs, share of wrong pairs, and what is known of the camera position."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from calib_core.evidence import CameraBelief
from calib_core.options import CalibrationOptions, CameraPositionPrior, NoiseOptions, SolvingOptions
from calib_core.radar import covariance_from_sigma_polar
from calib_core.synthetic import AISLE, FIELD, NOISE_PROFILES, RigOptions, SimulatedPairs, simulate_pairs
from calib_core.synthetic.pairs import NoiseName
from calib_core.uncertainty import pose_jacobian

__all__ = ["CASES", "QUICK_CASES", "Case", "bound", "options_of", "trials"]


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table."""

    noise: NoiseName
    pairs: int
    outlier_share: float
    ruler_m: float | None = 0.01
    """Sigma of the tape-measured camera position; None: not measured."""
    aisle: bool = False
    decoys: int = 0
    told: float = 1.0
    """The radar sigmas the estimator is told, over the true ones."""


_TAPE: tuple[NoiseName, ...] = ("ti", "ti_fine", "imaging")
_FREE: tuple[NoiseName, ...] = ("ti", "imaging")
_AISLE: tuple[NoiseName, ...] = ("ti_aisle", "imaging")

CASES = (
    *(Case(noise, n, share) for noise, n, share in product(_TAPE, (10, 20, 40), (0.0, 0.1, 0.3, 0.5))),
    *(Case(noise, n, share, ruler_m=None) for noise, n, share in product(_FREE, (20, 40), (0.0, 0.1, 0.3))),
    *(Case(noise, n, share, aisle=True) for noise, n, share in product(_AISLE, (10, 20), (0.0, 0.3))),
    *(Case("ti", n, 0.1, told=told) for told, n in product((1 / 1.7, 1.7), (10, 20, 40))),
    Case("ti", 20, 0.3, decoys=3),
    Case("ti_aisle", 1000, 0.1, ruler_m=None),
)
QUICK_CASES = (
    Case("ti", 10, 0.3),
    Case("ti", 20, 0.1),
    Case("imaging", 20, 0.3),
    Case("ti", 20, 0.3, ruler_m=None),
)


def options_of(case: Case) -> CalibrationOptions:
    """Return what our estimator is told."""
    position = None
    if case.ruler_m is not None:
        position = CameraPositionPrior(RigOptions().camera_offset_m, case.ruler_m)
    return CalibrationOptions(noise=NoiseOptions(), solving=SolvingOptions(camera_position=position))


def trials(case: Case, count: int) -> Iterator[SimulatedPairs]:
    """Draw the trials of a case; the seeds are the same for every method and every case."""
    layout = AISLE if case.aisle else FIELD
    if case.pairs > 200:
        layout = replace(layout, separation_m=0.0)
    for trial in range(count):
        simulated = simulate_pairs(
            case.pairs,
            rng=np.random.default_rng([2023, trial]),
            noise=case.noise,
            outlier_share=case.outlier_share,
            layout=layout,
            decoys=case.decoys,
        )
        yield _told(simulated, case.told)


def _told(simulated: SimulatedPairs, factor: float) -> SimulatedPairs:
    if factor == 1.0:
        return simulated
    pairs = tuple(
        replace(pair, candidates=tuple(replace(one, sigma_polar=one.sigma_polar * factor) for one in pair.candidates))
        for pair in simulated.pairs
    )
    return replace(simulated, pairs=pairs)


def bound(simulated: SimulatedPairs, case: Case) -> np.ndarray:
    """Return the Cramer-Rao bound (6, 6) on (camera position [m], rotation [rad]), told which pairs are right.

    The information of a right pair is J^T S^-1 J at its true position, S = C + J V J^T.
    """
    profile = NOISE_PROFILES[case.noise]
    pose, points = simulated.camera_from_radar, simulated.points_radar_m[~simulated.outlier]
    jacobian = pose_jacobian(simulated.camera, pose, points)
    d_point = simulated.camera.project_with_jacobian(pose @ points)[1] @ pose.rotation
    radar = covariance_from_sigma_polar(points, np.tile(profile.sigma_polar, (len(points), 1)))
    noise = d_point @ radar @ np.swapaxes(d_point, 1, 2) + profile.sigma_px**2 * np.eye(2)
    information = (np.swapaxes(jacobian, 1, 2) @ np.linalg.solve(noise, jacobian)).sum(axis=0)
    ruler = CameraBelief(np.zeros(3), case.ruler_m or 1.0, measured=True).rows(pose)[1]
    if case.ruler_m is not None:
        information = information + ruler.T @ ruler
    to_centre = np.vstack([ruler * (case.ruler_m or 1.0), np.eye(6)[3:]])
    return np.asarray(to_centre @ np.linalg.inv(information) @ to_centre.T)
