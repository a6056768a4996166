"""What a prior covers if calibrations or mountings are not as the model has them: `python -m benchmarks.fleet.strange_fleets`.

True mountings and three calibrations of each are drawn at the level of poses: scatter of the pairs, errors that a vehicle's
sessions share, and a camera position measured anew in each. Only the table reads the truth.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.fleet.paired_fleet import prior_holds, sigmas
from benchmarks.fleet.simulated_poses import NOMINAL
from calib_core.fleet import MountingScatter, SessionPose, fleet_prior_of, mounting_scatter, mountings_of
from calib_core.fleet.mounting_coordinates import pose_covariance, pose_from_coordinates
from calib_core.options import CameraPositionPrior

__all__ = ["CASES", "Case", "covered", "main"]

VEHICLES = (6, 20, 48)
_FLEETS, _NEXT, _SESSIONS = 40, 50, 3
_SCATTER = np.array([0.005] * 3 + [np.deg2rad(0.3)] * 3)
_UNEQUAL = np.array([0.05, 0.002, 0.002, 0.002, 0.002, 0.01])
_VARIANT_M = 0.03
_OF_PAIRS = (0.003, 0.1)  # m, deg
_NEARLY = 1.0 - 1e-9


def _normal(rng: np.random.Generator) -> np.ndarray:
    return _SCATTER * rng.standard_normal(6)


def _unequal(rng: np.random.Generator) -> np.ndarray:
    return _UNEQUAL * rng.standard_normal(6)


def _two_variants(rng: np.random.Generator) -> np.ndarray:
    return _normal(rng) + np.array([_VARIANT_M * (rng.random() < 0.5), 0.0, 0.0, 0.0, 0.0, 0.0])


def _heavy_tails(rng: np.random.Generator) -> np.ndarray:
    return _normal(rng) / np.sqrt(rng.chisquare(3) / 3.0)


@dataclass(frozen=True, slots=True)
class Case:
    """How fleets are drawn.

    Attributes:
        text: as it stands in the table.
        drawn: the coordinates (6,) of a true mounting.
        shared: stated standard deviations of the errors that sessions share [m, deg].
        there: how much of these there is.
        tape_m: stated standard deviation of the measured camera position; None without.
        tape_true_m: its true one.
    """

    text: str
    drawn: Callable[[np.random.Generator], np.ndarray] = _normal
    shared: tuple[float, float] = (0.002, 0.3)
    there: float = 1.0
    tape_m: float | None = None
    tape_true_m: float = 0.0


CASES = (
    Case("as stated"),
    Case("tape as stated: 1 cm", tape_m=0.01, tape_true_m=0.01),
    Case("tape stated 1 cm, true 0.2 cm", tape_m=0.01, tape_true_m=0.002),
    Case("tape stated 5 cm, true 0.2 cm", tape_m=0.05, tape_true_m=0.002),
    Case("tape stated 0.1 cm, true 2 cm", tape_m=0.001, tape_true_m=0.02),
    Case("shared errors stated 1 cm, 0.5 deg; none there", shared=(0.01, 0.5), there=0.0),
    Case("shared errors three times as large as stated", there=3.0),
    Case("scatter of 5 cm forward, 2 mm else", _unequal),
    Case("two variants, 3 cm apart", _two_variants),
    Case("heavy tails (Student's t, 3 degrees of freedom)", _heavy_tails),
)


def main() -> None:
    """Print the table."""
    print("| fleet | vehicles | coverage of the prior | least covered of 40 fleets | its sigma |")
    print("|---|---|---|---|---|")
    for count in VEHICLES:
        for case in CASES:
            shares, cm, deg = covered(case, count)
            figures = f"{100 * np.mean(shares):.1f} % | {100 * min(shares):.0f} % | {cm:.2f} cm, {deg:.2f} deg"
            print(f"| {case.text} | {count} | {figures} |", flush=True)


def covered(case: Case, count: int, *, fleets: int = _FLEETS) -> tuple[list[float], float, float]:
    """Return which share of further mountings the prior of each fleet contains, and its median sigma [cm, deg]."""
    rng, shares, spreads = np.random.default_rng(5), [], []
    for _ in range(fleets):
        sessions = [one for k in range(count) for one in _sessions(case, f"v{k:02}", rng)]
        scatter = mounting_scatter(mountings_of(sessions), vehicle_type="van")
        if isinstance(scatter, MountingScatter):
            prior = fleet_prior_of(scatter)
            further = (pose_from_coordinates(case.drawn(rng), NOMINAL) for _ in range(_NEXT))
            shares.append(float(np.mean([prior_holds(prior, one) for one in further])))
            spreads.append(sigmas(prior.covariance, prior.camera_from_radar))
    cm, deg = np.median(spreads, axis=0).tolist()
    return shares, cm, deg


def _sessions(case: Case, vehicle: str, rng: np.random.Generator) -> list[SessionPose]:
    truth = pose_from_coordinates(case.drawn(rng), NOMINAL)
    shared, of_pairs = _covariance(*case.shared), _covariance(*_OF_PAIRS)
    common = np.linalg.cholesky(shared) @ rng.standard_normal(6) * case.there
    found = []
    for number in range(_SESSIONS):
        error = common + np.linalg.cholesky(of_pairs) @ rng.standard_normal(6)
        of_tape, measured = np.zeros((6, 6)), None
        if case.tape_m is not None:
            of_tape = _covariance(case.tape_m, 0.0)
            forward, left, up = (case.tape_true_m * rng.standard_normal(3)).tolist()
            error = error + _moved(np.array([forward, left, up]))
            measured = CameraPositionPrior((forward, left, up), case.tape_m)
        found.append(
            SessionPose(
                vehicle,
                f"s{number}",
                truth.perturbed(error),
                shared + of_pairs + of_tape,
                _NEARLY * shared,
                of_tape=_NEARLY * of_tape,
                measured=measured,
            )
        )
    return found


def _covariance(position_m: float, rotation_deg: float) -> np.ndarray:
    variances = [position_m**2] * 3 + [np.deg2rad(rotation_deg) ** 2] * 3
    return pose_covariance(np.diag(variances), NOMINAL)


def _moved(centre_m: np.ndarray) -> np.ndarray:
    """Return the error (6,) of a pose whose camera centre is off by this (3,) in the radar frame."""
    return np.concatenate([-NOMINAL.rotation @ centre_m, np.zeros(3)])


if __name__ == "__main__":
    main()
