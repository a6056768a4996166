"""The methods of a result: unwrap, the summary, and the uncertainty in pixels."""

import math

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.association.array_pairs import pairs_from_arrays
from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError, OptionError, UnsolvableError
from calib_core.measurements import Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.results import Calibration
from calib_core.results.metrics import acc, aed, cdsd, metrics_of, rms
from calib_core.results.verdict import verdict_on
from calib_core.words.outcomes import said_of

POINT = np.array([[8.0, 0.5, 0.0]])


@pytest.fixture(scope="module")
def simulated() -> SimulatedPairs:
    return simulate_pairs(20, rng=np.random.default_rng(5), noise="ti")


def solved(simulated: SimulatedPairs, options: CalibrationOptions | None = None) -> Calibration:
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


def test_unwrap_gives_the_calibration_or_raises_with_reason_and_hint(simulated):
    calibration = solved(simulated)
    assert calibration.unwrap() is calibration
    unsolvable = calibrate_pairs(simulated.pairs[:3], simulated.camera)
    assert isinstance(unsolvable, Unsolvable)
    with pytest.raises(UnsolvableError) as refusal:
        unsolvable.unwrap()
    assert (refusal.value.code, refusal.value.outcome) == (unsolvable.code, unsolvable)
    assert str(refusal.value) == f"no calibration: {said_of(unsolvable)}"


@pytest.mark.parametrize("method", ["default", "paper"])
def test_a_calibration_prints_as_ten_lines(simulated, method):
    lines = str(solved(simulated, CalibrationOptions(method=method))).splitlines()
    assert len(lines) == 10
    assert lines[1].split()[:2] == [
        "verdict",
        f"{verdict_on(solved(simulated, CalibrationOptions(method=method))).level}:",
    ]
    assert max(map(len, lines)) < 120
    for word in (
        "clicks agree",
        "translation",
        "quaternion wxyz",
        "one sigma",
        "systematic",
        "AED",
        "leave-one-out",
        "warnings",
        "next",
    ):
        assert word in "\n".join(lines)


def test_an_unsolvable_prints_its_reason_its_hint_and_the_clicks_without_radar():
    text = str(
        Unsolvable.reported("too-few-pairs", "2", "add two", (Unpaired.reported("c3", "no-scan", "lost", "wait"),))
    )
    assert text.splitlines() == [
        "No calibration (too-few-pairs): 2",
        "  add two",
        "  click c3: lost; wait",
    ]


def test_pixel_sigma_is_the_root_of_the_covariances_diagonal(simulated):
    calibration = solved(simulated)
    covariance = calibration.pixel_covariance(POINT)[0]
    assert calibration.pixel_sigma(POINT)[0] == pytest.approx(np.sqrt(np.diag(covariance)))
    assert calibration.pixel_sigma(np.array([[-5.0, 0.0, 0.0]])) == pytest.approx(np.full((1, 2), np.nan), nan_ok=True)


def test_the_pose_jacobian_is_that_of_finite_differences(simulated):
    calibration, step = solved(simulated), 1e-6
    jacobian = calibration.camera.pose_jacobian(calibration.camera_from_radar, POINT)[0]
    for k, error in enumerate(np.eye(6) * step):
        ahead, behind = (calibration.camera_from_radar.perturbed(sign * error) @ POINT for sign in (1.0, -1.0))
        slope = (calibration.camera.project(ahead) - calibration.camera.project(behind))[0] / (2.0 * step)
        assert jacobian[:, k] == pytest.approx(slope, rel=1e-5, abs=1e-4)


def test_the_advice_of_a_calibration_is_computed_once_and_kept(simulated):
    calibration = solved(simulated)
    assert calibration.next_placement is not None
    assert solved(simulated, CalibrationOptions(method="paper")).next_placement is None


def test_arrays_become_pairs_that_give_the_same_pose(simulated):
    points = np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])
    pixels = np.array([pair.pixel_px for pair in simulated.pairs])
    sigmas = np.array([pair.candidates[0].sigma_polar for pair in simulated.pairs])
    pairs = pairs_from_arrays(points, pixels, sigma_polar=sigmas, ids=[pair.id for pair in simulated.pairs])
    outcome = calibrate_pairs(pairs, simulated.camera).unwrap()
    assert outcome.camera_from_radar.as_matrix().tobytes() == solved(simulated).camera_from_radar.as_matrix().tobytes()
    assert [pair.id for pair in pairs_from_arrays(points[:2], pixels[:2])] == ["pair-1", "pair-2"]
    assert pairs_from_arrays(points[:1], pixels[:1], sigma_px=2.5)[0].sigma_px == 2.5
    assert pairs_from_arrays(points[:1], pixels[:1], times_s=[1.5])[0].image_time == 1_500_000_000


@pytest.mark.parametrize(
    ("points", "pixels", "more", "words"),
    [
        (np.zeros((2, 2)), np.zeros((2, 2)), {}, "points_radar_m: expected an array of n x 3, got 2 x 2"),
        (np.ones((2, 3)), np.zeros(2), {}, "pixels_px: expected an array of n x 2, got 2"),
        ([[1, 2, 3], [4, 5]], np.zeros((2, 2)), {}, "points_radar_m: .* real numbers, got rows of different lengths"),
        (np.full((1, 3), "x"), np.zeros((1, 2)), {}, "points_radar_m: .* real numbers, got an array of <U1"),
        (np.ones((1, 3)) * 1j, np.zeros((1, 2)), {}, "points_radar_m: .* real numbers, got an array of complex"),
        (None, np.zeros((1, 2)), {}, "points_radar_m: "),
        (np.ma.masked_less(np.ones((1, 3)), 2), np.zeros((1, 2)), {}, r"points_radar_m\[0\]: .* is not finite"),
        (np.ones((2, 3)), np.zeros((3, 2)), {}, "2 radar positions, 3 pixels and 2 ids"),
        (np.full((1, 3), np.nan), np.zeros((1, 2)), {}, r"points_radar_m\[0\]: .* is not finite"),
        (np.ones((1, 3)), np.full((1, 2), np.inf), {}, r"pixels_px\[0\]: .* is not finite"),
        (np.zeros((1, 3)), np.zeros((1, 2)), {}, "is at the radar's origin"),
        (np.ones((1, 3)), np.zeros((1, 2)), {"sigma_px": np.nan}, "sigma_px: is nan; .* above zero"),
        (np.ones((1, 3)), np.zeros((1, 2)), {"sigma_px": -2.0}, "sigma_px: is -2; .* above zero"),
        (np.ones((2, 3)), np.zeros((2, 2)), {"ids": ["a", "a"]}, "ids: there are duplicates"),
        (np.ones((2, 3)), np.zeros((2, 2)), {"times_s": [1.0]}, "times_s: 1 times of 2 pairs"),
        (np.ones((1, 3)), np.zeros((1, 2)), {"times_s": [1.7e18]}, "times_s: 1.7e"),
        (np.ones((2, 3)), np.zeros((2, 2)), {"sigma_polar": [0.1, 0.2]}, "sigma_polar: expected an array of 3"),
        (np.ones((2, 3)), np.zeros((2, 2)), {"sigma_polar": [0.1, 0.2, 0.0]}, "sigma_polar: every standard deviation"),
        (np.ones((2, 3)), np.zeros((2, 2)), {"sigma_polar": [0.03, 0.5, 1.0]}, r"np\.deg2rad\(1\)"),
        (np.ones((2, 3)), np.zeros((2, 2)), {"sigma_polar": [0.03, 0.5, 0.25]}, r"np\.deg2rad\(0\.5\)"),
    ],
)
def test_arrays_that_make_no_pairs_are_refused_with_a_clear_error(points, pixels, more, words):
    with pytest.raises(InputError, match=words):
        pairs_from_arrays(points, pixels, **more)


def test_points_of_another_shape_are_refused(simulated):
    with pytest.raises(InputError, match="points_radar_m: expected an array of n x 3, got 3"):
        solved(simulated).pixel_sigma(np.array([5.0, 1.0, 0.0]))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (CalibrationOptions(method="magic"), "option method: unknown value 'magic'; choose default or paper"),
        (CalibrationOptions(noise=NoiseOptions(sigma_px=-3.0)), r"option noise\.sigma_px: -3 is out of range"),
        (CalibrationOptions(noise=NoiseOptions(sigma_px="2")), r"option noise\.sigma_px: expected a number, got '2'"),
        ({"method": "paper"}, "options: expected CalibrationOptions, got dict"),
    ],
)
def test_invalid_options_are_refused_by_name(simulated, options, words):
    with pytest.raises(OptionError, match=words):
        calibrate_pairs(simulated.pairs, simulated.camera, options)


def test_the_housing_is_less_certain_by_the_biases_of_the_angles(simulated):
    calibration = calibrate_pairs(simulated.pairs, simulated.camera).unwrap()
    added = calibration.housing_covariance - calibration.covariance
    about = calibration.camera_from_radar.rotation.T @ added[3:, 3:] @ calibration.camera_from_radar.rotation
    np.testing.assert_allclose(about, np.diag([0.0, np.deg2rad(1.0) ** 2, np.deg2rad(1.0) ** 2]), atol=1e-12)
    assert not added[:3].any()


# Metrics in addition to the paper's; the paper's equations are in tests/paper.


LENGTHS = np.array([1.0, 2.0, 6.0])


def test_rms_aed_and_cdsd_belong_together():
    n = len(LENGTHS)
    assert n * rms(LENGTHS) ** 2 == pytest.approx(n * aed(LENGTHS) ** 2 + (n - 1) * cdsd(LENGTHS) ** 2)


def test_without_pairs_there_are_no_metrics():
    nothing = np.zeros(0)
    assert math.isnan(aed(nothing))
    assert math.isnan(rms(nothing))
    assert math.isnan(cdsd(nothing))
    assert metrics_of(nothing).n == 0


def test_one_pair_has_no_spread():
    assert aed(np.array([3.0])) == 3.0
    assert math.isnan(cdsd(np.array([3.0])))


def test_the_metrics_contain_the_held_out_figure_and_the_training_one():
    metrics = metrics_of(LENGTHS, held_out_distances_px=LENGTHS + 1.0, acc=0.5, chi2=4.0, degrees_of_freedom=3)
    assert metrics.aed_px == pytest.approx(3.0)
    assert metrics.held_out_aed_px == pytest.approx(4.0)
    assert (metrics.acc, metrics.chi2, metrics.degrees_of_freedom, metrics.n) == (0.5, 4.0, 3, 3)


def test_without_held_out_pairs_that_figure_is_unknown():
    metrics = metrics_of(LENGTHS)
    assert math.isnan(metrics.held_out_aed_px)
    assert metrics.acc is None


def test_acc_without_any_frame_is_unknown():
    assert acc([]) is None
    assert acc([np.zeros(0, dtype=np.bool_)]) is None
    assert acc([np.array([False])], zero_frames="drop") is None
