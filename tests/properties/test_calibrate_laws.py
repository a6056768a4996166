"""Laws of the estimator, whatever the data."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import Pair, Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions, without_systematic_errors
from calib_core.results import Calibration
from calib_core.words.outcomes import outcome_remark

MEASURED = CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.0, 0.0, 0.045), 0.01)))
SEEDS = st.integers(0, 10_000)
FEW = settings(max_examples=15, deadline=None)


def solved(pairs: list[Pair] | tuple[Pair, ...], seed: int, options: CalibrationOptions = MEASURED) -> Calibration:
    return calibrate_pairs(pairs, simulate_pairs(1, rng=np.random.default_rng(seed)).camera, options).unwrap()


@pytest.mark.slow
@FEW
@given(seed=SEEDS, order=st.randoms(use_true_random=False))
def test_shuffling_pairs_changes_no_bit(seed, order):
    pairs = list(simulate_pairs(10, rng=np.random.default_rng(seed), outlier_share=0.2).pairs)
    plain = solved(pairs, seed)
    order.shuffle(pairs)
    shuffled = solved(pairs, seed)
    assert plain.camera_from_radar.as_matrix().tobytes() == shuffled.camera_from_radar.as_matrix().tobytes()
    assert plain.covariance.tobytes() == shuffled.covariance.tobytes()
    assert plain.metrics == shuffled.metrics


@pytest.mark.slow
@FEW
@given(seed=SEEDS, turn=st.floats(-0.3, 0.3))
def test_turning_the_radar_about_its_vertical_axis_turns_the_answer(seed, turn):
    """A yaw of a radar without scale errors only shifts azimuths, with the same noise: the fit must rotate with it."""
    simulated = simulate_pairs(12, rng=np.random.default_rng(seed))
    turned_from_radar = RigidTransform(rotation_exp(np.array([0.0, 0.0, turn])), np.zeros(3))
    turned = [
        replace(
            pair,
            candidates=tuple(
                replace(one, position_radar_m=(turned_from_radar @ one.position_radar_m[None])[0])
                for one in pair.candidates
            ),
        )
        for pair in simulated.pairs
    ]
    exact = without_systematic_errors(MEASURED)
    plain, other = solved(simulated.pairs, seed, exact), solved(turned, seed, exact)
    expected = plain.camera_from_radar @ turned_from_radar.inverse()
    error = expected.error_from(other.camera_from_radar)
    assert error @ np.linalg.solve(plain.covariance, error) < 1e-4


@pytest.mark.slow
@FEW
@given(seed=SEEDS)
def test_covariances_are_symmetric_and_positive(seed):
    calibration = solved(simulate_pairs(8, rng=np.random.default_rng(seed), outlier_share=0.25).pairs, seed)
    assert (calibration.covariance == calibration.covariance.T).all()
    assert np.linalg.eigvalsh(calibration.covariance).min() > 0
    assert all(0.0 <= pair.outlier_probability <= 1.0 for pair in calibration.pairs)


@pytest.mark.slow
@FEW
@given(seed=SEEDS)
def test_excluding_the_outliers_leaves_the_pose_where_it_was(seed):
    simulated = simulate_pairs(20, rng=np.random.default_rng(seed), noise="imaging", outlier_share=0.2)
    whole = solved(simulated.pairs, seed)
    named = frozenset(pair.id for pair in whole.pairs if pair.outlier_probability > 0.99)
    without = calibrate_pairs(simulated.pairs, simulated.camera, MEASURED, named).unwrap()
    error = without.camera_from_radar.error_from(whole.camera_from_radar)
    assert error @ np.linalg.solve(whole.covariance, error) < 0.5


@FEW
@given(seed=SEEDS, count=st.integers(0, 6))
def test_any_number_of_pairs_gives_an_answer_or_a_reason(seed, count):
    pairs = simulate_pairs(6, rng=np.random.default_rng(seed), outlier_share=0.5).pairs[:count]
    outcome = calibrate_pairs(pairs, simulate_pairs(1, rng=np.random.default_rng(0)).camera, CalibrationOptions())
    if isinstance(outcome, Unsolvable):
        remark = outcome_remark(outcome)
        assert outcome.code
        assert remark.message
        assert remark.hint
    else:
        assert len(outcome.pairs) == count >= 4
        assert np.isfinite(outcome.metrics.aed_px)


def test_more_pairs_make_the_pose_more_certain():
    simulated = simulate_pairs(40, rng=np.random.default_rng(1))
    sigmas = [np.sqrt(np.trace(solved(simulated.pairs[:count], 1).covariance[3:, 3:])) for count in (8, 16, 40)]
    assert sigmas == sorted(sigmas, reverse=True)
    assert sigmas[2] == pytest.approx(sigmas[0] / np.sqrt(5), rel=0.5)
