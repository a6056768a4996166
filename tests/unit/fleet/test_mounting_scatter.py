"""The scatter of a vehicle type: what is estimated, what is left out, and when it is refused."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.fleet.simulated_poses import (
    NOMINAL,
    Accuracy,
    Spread,
    simulated_fleet,
    simulated_mounting,
    simulated_session,
)
from calib_core.fleet import (
    MountingScatter,
    OffKind,
    mounting_of,
    mounting_scatter,
    mountings_of,
    off_kind,
    off_kinds,
)
from calib_core.fleet.deviation import deviation, quantile
from calib_core.fleet.mounting_scatter import SharedTape, coordinates, pose_from_coordinates
from calib_core.fleet.mountings import Mounting
from calib_core.fleet.random_effects import PRIOR_VECTORS, random_effects
from calib_core.fleet.session_pose import SessionPose
from calib_core.geometry import RigidTransform
from calib_core.measurements import Unsolvable
from calib_core.options import CameraPositionPrior
from tests.unit.fleet.test_mountings import EQUAL, EXACT, estimated, squared_of_new

NARROW, FINE, COARSE = Spread(0.005, 0.3), Accuracy(0.001, 0.05), Accuracy(0.07, 0.6)
WRONG = pose_from_coordinates(np.array([0.3, -0.1, 0.0, 0.0, 0.1, 0.3]), NOMINAL)


def calibrated(truth: RigidTransform, rng: np.random.Generator, name: str, accuracy: Accuracy = FINE) -> Mounting:
    return mounting_of([simulated_session(truth, accuracy, rng, vehicle=name)])


def fleet(
    count: int, rng: np.random.Generator, *, spread: Spread = NARROW, accuracy: Accuracy = FINE
) -> list[Mounting]:
    return [calibrated(simulated_mounting(spread, rng), rng, f"v{k:02d}", accuracy) for k in range(count)]


def scattered(mountings: list[Mounting]) -> MountingScatter:
    scatter = mounting_scatter(mountings, vehicle_type="van")
    assert isinstance(scatter, MountingScatter)
    return scatter


def test_mean_and_scatter_are_those_of_the_simulation():
    scatter = scattered(fleet(80, np.random.default_rng(1)))
    sigma = np.sqrt(np.diag(scatter.scatter))
    np.testing.assert_allclose(sigma[:3], 0.005, rtol=0.3)
    np.testing.assert_allclose(np.rad2deg(sigma[3:]), 0.3, rtol=0.3)
    error = scatter.camera_from_radar.error_from(NOMINAL)
    assert np.rad2deg(np.linalg.norm(error[3:])) < 0.1
    assert np.linalg.norm(error[:3]) < 0.002


def test_the_errors_of_the_calibrations_are_no_scatter():
    rng = np.random.default_rng(2)
    rows = fleet(80, rng, accuracy=COARSE)
    sigma = np.sqrt(np.diag(scattered(rows).scatter))
    observed = np.std([one.camera_from_radar.error_from(NOMINAL) for one in rows], axis=0)
    assert observed[3:].mean() > np.deg2rad(0.55)
    assert np.rad2deg(sigma[3:]).max() < 0.5
    assert sigma[:3].max() < 0.03


def test_wrong_radars_are_left_out_with_the_axis_that_is_off():
    rng = np.random.default_rng(3)
    rows = fleet(12, rng)
    rows[4], rows[7] = calibrated(WRONG, rng, "v04"), calibrated(WRONG, rng, "v07")
    scatter = scattered(rows)
    assert [one.mounting.vehicle for one in scatter.left_out] == ["v04", "v07"]
    assert all("yaw +17 deg" in one.reason and "unlike its type" in one.reason for one in scatter.left_out)
    assert len(scatter.mountings) == 10


@pytest.mark.parametrize("count", [0, 1, 2, 4])
def test_too_few_vehicles_are_refused_with_reason_and_hint(count):
    outcome = mounting_scatter(fleet(count, np.random.default_rng(4)), vehicle_type="van")
    assert (outcome.code, f"{count} of at least 5" in outcome.reason) == ("too-few-vehicles", True)
    assert outcome.hint


def test_wrong_radars_among_few_are_not_averaged_in():
    rng = np.random.default_rng(6)
    outcome = mounting_scatter([*fleet(4, rng), calibrated(WRONG, rng, "odd")], vehicle_type="van")
    assert "after 1 that are off their kind were left out" in outcome.reason


def test_the_scatter_is_stated_as_it_is():
    rng = np.random.default_rng(8)
    scatter = scattered(fleet(49, rng))
    drawn = [coordinates(simulated_mounting(NARROW, rng), scatter.common) for _ in range(3000)]
    stated, found = np.sqrt(np.diag(scatter.effects.covariance)), np.std(drawn, axis=0)
    np.testing.assert_allclose(stated / found, 1.05, atol=0.3)


def test_the_next_vehicle_is_where_the_others_predict_it_in_about_95_percent():
    rng, inside = np.random.default_rng(1), []
    for _ in range(12):
        scatter = scattered(fleet(14, rng, accuracy=Accuracy(0.01, 0.3)))
        inside += [_probability(scatter, simulated_mounting(NARROW, rng)) >= 0.05 for _ in range(60)]
    assert np.mean(inside) >= 0.93


def test_in_50_vehicles_wrong_radars_and_remounts_are_off_and_no_other():
    simulated = simulated_fleet(NARROW, Accuracy(0.02, 0.15), np.random.default_rng(10))
    tested = off_kinds(scattered(list(mountings_of(simulated.sessions))))
    assert len(tested) == 53
    off = {one.mounting.vehicle for one in tested if one.is_off}
    assert simulated.wrong <= off <= simulated.wrong | simulated.remounted


def test_a_vehicle_off_its_kind_is_named_with_figures_and_what_to_do():
    rng = np.random.default_rng(12)
    scatter = scattered(fleet(20, rng))
    outcome = off_kind(calibrated(WRONG, rng, "odd"), scatter)
    assert outcome.is_off
    assert outcome.words.startswith("odd is unlike its type: ")
    assert "20 other mountings" in outcome.words
    assert outcome.hint.startswith("check that radar, camera and intrinsics are this vehicle's")


def test_a_vehicle_is_tested_against_the_others_only():
    rows = fleet(8, np.random.default_rng(13))
    scatter = scattered(rows)
    within, without = off_kind(rows[3], scatter), off_kind(rows[3], scattered(rows[:3] + rows[4:]))
    assert isinstance(within, OffKind)
    assert within.others == without.others == 7
    assert within.deviation.squared == pytest.approx(without.deviation.squared, rel=1e-3)


def test_without_enough_others_there_is_no_test():
    rng = np.random.default_rng(14)
    five = scattered(fleet(5, rng))
    fewer = five.without("v00")
    assert isinstance(fewer.without("v01"), Unsolvable)


def _probability(scatter: MountingScatter, exact: RigidTransform) -> float:
    """Return how often a sound mounting, known exactly, is as far from the others as this one, or farther."""
    vector = coordinates(exact, scatter.common)
    return deviation(scatter.effects, vector, 1e-12 * np.eye(6), freedom=1e7).probability


def test_a_measured_position_that_several_vehicles_state_is_one_measurement():
    rng = np.random.default_rng(12)
    copied = CameraPositionPrior((0.0, 0.05, 0.12), 0.01)
    rows, inside, narrow = 20, 0, 0
    for _ in range(25):
        common = np.concatenate([rng.normal(0.0, 0.01, 3), np.zeros(3)])  # what the copied measurement is off by
        drawn = [pose_from_coordinates(common + rng.normal(0.0, [5e-4] * 3 + [5e-3] * 3), NOMINAL) for _ in range(rows)]
        sessions = [simulated_session(pose, Accuracy(0.01, 0.05), rng, vehicle=f"v{k}") for k, pose in enumerate(drawn)]
        stated = [replace(one, measured=copied) for one in sessions]
        scatter = scattered([mounting_of([one]) for one in stated])
        assert (scatter.shared_tape.vehicles, scatter.shared_tape.sigma_m) == (rows, 0.01)
        narrow += np.sqrt(np.diag(scatter.scatter))[:3].min() < 0.01
        following = simulated_mounting(NARROW, rng)
        inside += _probability(scatter, following) >= 0.05
    assert narrow == 0
    assert inside >= 23  # with a chance of 10 % if 80 % were inside, as 36 of 40 has 8 %


def test_measured_positions_that_differ_less_than_their_sigma_are_one_measurement():
    """A drawing with a little jitter, or a tape that is held to the same wrong edge of every vehicle."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        sessions = [
            simulated_session(simulated_mounting(NARROW, rng), Accuracy(0.01, 0.05), rng, vehicle=f"v{k}")
            for k in range(20)
        ]

        def told(jitter_m: np.ndarray, rng: np.random.Generator, sessions: list[SessionPose]) -> SharedTape | None:
            rows = []
            for one in sessions:
                forward, left, up = (np.array([0.0, 0.05, 0.12]) + jitter_m * rng.standard_normal(3)).tolist()
                rows.append(mounting_of([replace(one, measured=CameraPositionPrior((forward, left, up), 0.01))]))
            return scattered(rows).shared_tape

        assert told(np.full(3, 0.01), rng, sessions) is None
        alike = told(np.full(3, 0.0003), rng, sessions)
        assert (alike.vehicles, alike.sigma_m) == (20, 0.01)
        assert 0.0002 < alike.spread_m < 0.0004
        assert "20 vehicles differ by ± 0.0" in alike.words
        assert told(np.array([0.01, 0.01, 0.0003]), rng, sessions) is not None  # one axis from the drawing


# Mean and scatter of vectors with known covariances: truth by simulation, and how often a further one is covered.


UNEQUAL = np.array([0.01, 0.003, 0.001, 0.001, 0.01, 0.003])
WHOLE = 5.0
ROUGH = np.diag(np.repeat([1e-4, 1e-4], 3))


def covered(count: int, fleets: int, sigma: np.ndarray, error: np.ndarray) -> float:
    """Return the share of new vectors that are no farther out than 95 % are, as `deviation` judges it."""
    rng, shares = np.random.default_rng(count), []
    for _ in range(fleets):
        effects = estimated(count, sigma, error, rng)
        limit = quantile(0.95, effects.freedom, whole=WHOLE)
        shares.append((squared_of_new(effects, sigma, rng) <= limit).mean())
    return float(np.mean(shares))


@pytest.mark.parametrize(("count", "fleets"), [(5, 120), (10, 80), (49, 20)])
def test_a_further_vector_is_covered_in_at_least_95_percent(count, fleets):
    assert covered(count, fleets, EQUAL, EXACT) >= 0.93


@pytest.mark.parametrize("count", [10, 49])
def test_unequal_axes_are_covered_too(count):
    assert covered(count, 20, UNEQUAL, EXACT) >= 0.92


@pytest.mark.parametrize("count", [10, 20])
def test_errors_twice_as_large_as_the_scatter_do_not_make_it_overconfident(count):
    assert covered(count, 30, EQUAL, ROUGH) >= 0.93


def covered_with_stated(there: float, share: float, sigma: np.ndarray) -> float:
    """Return the share of new vectors inside, if a share of the covariance is stated and only some of that is there."""
    stated, count, rng, inside = share * (1.0 - 1e-9) * ROUGH, 30, np.random.default_rng(5), []
    error = ROUGH - (1.0 - there) * stated
    for _ in range(12):
        vectors = sigma * rng.standard_normal((count, 6)) + rng.multivariate_normal(np.zeros(6), error, count)
        effects = random_effects(vectors, np.tile(ROUGH, (count, 1, 1)), np.tile(stated, (count, 1, 1)))
        limit = quantile(0.95, effects.freedom, whole=WHOLE)
        inside.append((squared_of_new(effects, sigma, rng) <= limit).mean())
    return float(np.mean(inside))


@pytest.mark.parametrize(
    ("share", "sigma"), [(0.3, 2.0 * EQUAL), (1.0, EQUAL)], ids=["as large as the errors", "half the errors"]
)
def test_errors_smaller_than_stated_do_not_make_it_overconfident(share, sigma):
    shares = [covered_with_stated(there, share, sigma) for there in (0.0, 0.3, 1.0)]
    assert np.mean(shares) >= 0.93
    assert min(shares) >= 0.85


def test_what_was_stated_is_found_to_be_there_or_not_where_it_decides():
    rng = np.random.default_rng(6)
    of_rotation = np.diag(np.repeat([1e-8, 1e-4], 3))
    stated = np.where(np.arange(60)[:, None, None] % 2, of_rotation, 0.0)  # of every other vector only
    whole = stated + 1e-6 * np.eye(6)
    vectors = 1e-3 * rng.standard_normal((60, 6))
    assert random_effects(vectors, whole, stated).of_stated < 0.2
    there = vectors + np.sqrt(np.diagonal(stated, axis1=1, axis2=2)) * rng.standard_normal((60, 6))
    assert random_effects(there, whole, stated).of_stated > 0.7


def test_many_exact_vectors_give_the_sample_covariance_and_a_little_of_the_prior():
    rng, count = np.random.default_rng(3), 300
    vectors = UNEQUAL * rng.standard_normal((count, 6))
    effects = random_effects(vectors, np.repeat(1e-9 * np.eye(6)[None], count, axis=0))
    sample = (vectors - vectors.mean(axis=0)).T @ (vectors - vectors.mean(axis=0)) / (count - 1)
    equal = np.repeat(np.diag(sample).reshape(2, 3).mean(axis=1), 3)
    expected = (count * sample + PRIOR_VECTORS * np.diag(equal)) / (count + PRIOR_VECTORS)
    np.testing.assert_allclose(np.diag(effects.scatter), np.diag(expected), rtol=0.02)
    np.testing.assert_allclose(effects.mean, vectors.mean(axis=0), atol=1e-5)
    assert effects.informative == pytest.approx(count, rel=0.01)


def test_where_the_errors_hide_the_scatter_it_is_neither_zero_nor_theirs():
    effects = estimated(30, np.full(6, 1e-4), ROUGH, np.random.default_rng(4))
    sigma = np.sqrt(np.diag(effects.scatter))
    assert (sigma > 3e-4).all()
    assert (sigma < 6e-3).all()
    assert effects.informative < 5.0


def test_vectors_that_are_all_the_same_have_next_to_no_scatter():
    effects = random_effects(np.zeros((6, 6)), np.repeat(1e-8 * np.eye(6)[None], 6, axis=0))
    assert np.sqrt(np.diag(effects.scatter)).max() < 2e-4
    assert np.linalg.eigvalsh(effects.scatter)[0] > 0.0


def test_the_axes_in_which_vectors_are_given_do_not_matter():
    rng = np.random.default_rng(6)
    vectors, errors = EQUAL * rng.standard_normal((20, 6)), np.array([np.diag(row) for row in rng.random((20, 6))])
    turned = np.kron(np.eye(2), np.linalg.qr(rng.standard_normal((3, 3)))[0])
    one = random_effects(vectors, 1e-4 * errors)
    other = random_effects(vectors @ turned.T, 1e-4 * turned @ errors @ turned.T)
    np.testing.assert_allclose(other.covariance, turned @ one.covariance @ turned.T, rtol=1e-3, atol=1e-8)
