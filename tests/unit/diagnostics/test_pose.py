"""A second pose is said when the pairs leave it open, and the expected distance only when it decides."""

from dataclasses import replace

import numpy as np
import pytest

import calib_core.calibration
from calib_core.calibration import calibrate_pairs
from calib_core.diagnostics.pose import two_poses
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.gnc import GncSolution
from calib_core.measurements import Pair
from calib_core.results import Calibration, DataWarning
from calib_core.synthetic import RigOptions, SimulatedPairs, simulate_pairs
from calib_core.synthetic.simulated_pairs import NoiseName


def solved(simulated: SimulatedPairs, pairs: tuple[Pair, ...] | None = None) -> Calibration:
    outcome = calibrate_pairs(pairs or simulated.pairs, simulated.camera)
    assert isinstance(outcome, Calibration)
    return outcome


@pytest.fixture
def fit(monkeypatch: pytest.MonkeyPatch) -> SolvedFit:
    kept: list[SolvedFit] = []

    def keep(one: SolvedFit) -> tuple[DataWarning, ...]:
        kept.append(one)
        return ()

    monkeypatch.setattr(calib_core.calibration, "warnings_of", keep)
    solved(simulate_pairs(20, rng=np.random.default_rng(71), noise="imaging"))
    return kept[0]


def with_another(fit: SolvedFit, step_m: float, *, worse_by_pairs: float) -> SolvedFit:
    """Add an alternative whose camera is moved, and which the pairs alone find a little less likely."""
    best, prior = fit.alternatives[0], fit.measurements.prior
    pose = best.camera_from_radar.perturbed(np.array([step_m, 0.0, 0.0, 0.0, 0.0, 0.0]))
    by_prior = [float(prior.costs(one.rotation, one.translation_m)) for one in (pose, best.camera_from_radar)]
    cost = best.cost + worse_by_pairs + by_prior[0] - by_prior[1]
    return replace(fit, alternatives=(best, GncSolution(pose, cost, 1.0)))


def test_a_pose_that_differs_in_position_only_is_said(fit: SolvedFit) -> None:
    (warning,) = two_poses(with_another(fit, 0.5, worse_by_pairs=1.0))
    assert warning.code == "two-poses"
    assert "0.1 deg and 0.50 m away" in warning.message
    assert two_poses(with_another(fit, 0.5, worse_by_pairs=30.0)) == []
    assert two_poses(with_another(fit, 0.001, worse_by_pairs=0.0)) == []


def test_the_expected_distance_is_asked_for_when_it_decides_between_two_poses(fit: SolvedFit) -> None:
    (warning,) = two_poses(with_another(fit, 4.0, worse_by_pairs=1.0))
    assert warning.code == "camera-far-away"
    assert "only because about 1 m is expected" in warning.message
    assert "same rig" in warning.hint


@pytest.mark.parametrize("offset_m", [(0.0, 3.0, 0.5), (-3.0, 7.4, 1.0)])
def test_sensors_far_apart_are_no_reason_for_a_warning(offset_m: tuple[float, float, float]) -> None:
    for seed, noise in enumerate[NoiseName](("ti", "imaging")):
        rig = RigOptions(camera_offset_m=offset_m)
        simulated = simulate_pairs(40, rng=np.random.default_rng([72, seed]), noise=noise, rig_options=rig)
        assert "camera-far-away" not in {one.code for one in solved(simulated).warnings}


def test_an_object_that_always_stands_behind_the_reflector_is_said() -> None:
    said = 0
    for seed in range(4):
        rng = np.random.default_rng([73, seed])
        simulated = simulate_pairs(20, rng=rng)
        behind_m = simulated.rig.radar_from_world.rotation @ np.array([1.0, 0.0, 0.3])
        pairs = []
        for pair in simulated.pairs:
            (right,) = pair.candidates
            position_m = right.position_radar_m + behind_m + 0.03 * rng.standard_normal(3)
            stronger = replace(right, position_radar_m=position_m, score=0.6)
            pairs.append(replace(pair, candidates=(stronger, replace(right, score=0.4))))
        outcome = solved(simulated, tuple(pairs))
        error = simulated.camera_from_radar.error_from(outcome.camera_from_radar)
        texts = [one.message for one in outcome.warnings if one.code == "two-poses"]
        assert all("with other radar positions for" in text for text in texts)
        said += bool(texts) or float(np.linalg.norm(error[:3])) < 0.3
    assert said >= 3
