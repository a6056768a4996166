"""Each warning is raised when there is a reason, and good data give none."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import calib_core.calibration
from benchmarks.simulated_pairs import FIELD, NOISE_PROFILES, NoiseName, SimulatedPairs, simulate_pairs, study_camera
from calib_core.association.clustering import candidate_at
from calib_core.calibration import calibrate, calibrate_pairs
from calib_core.camera import Camera
from calib_core.diagnostics.clocks import clock_offset
from calib_core.diagnostics.pose import two_poses
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.gnc import GncSolution
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration
from calib_core.measurements import NS_PER_S, Pair, RadarScans, TimeNs, Unsolvable
from calib_core.options import (
    CalibrationOptions,
    CameraPositionPrior,
    GatingOptions,
    Method,
    SolvingOptions,
    without_systematic_errors,
)
from calib_core.results import Calibration, DataWarning, PairResult
from calib_core.results.actions import ChooseReturn, MeasureCameraPosition, ReviewPairs, SetOption
from calib_core.results.verdict import verdict_on
from calib_core.synthetic.rig import RigOptions, random_rig
from calib_core.words.warnings import warning_remark
from tests.rooftop import ClickedSample, read_rooftop
from tests.scans import scan_of

FREE = CalibrationOptions()


def measured(sigma_m: float = 0.01, position_m: tuple[float, float, float] = (0.0, 0.0, 0.045)) -> CalibrationOptions:
    return CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior(position_m, sigma_m)))


def moved(pairs: Sequence[Pair], factors: Sequence[float]) -> list[Pair]:
    """Multiply the axes of every radar position."""
    return [
        replace(
            pair,
            candidates=tuple(
                replace(one, position_radar_m=one.position_radar_m * np.array(factors)) for one in pair.candidates
            ),
        )
        for pair in pairs
    ]


def codes(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions) -> set[str]:
    return {warning.code for warning in warnings(pairs, camera, options)}


def warnings(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions) -> tuple[DataWarning, ...]:
    outcome = calibrate_pairs(pairs, camera, options)
    if isinstance(outcome, Unsolvable):
        return (DataWarning(outcome.code, outcome.facts), *outcome.suspected)
    assert all(warning_remark(warning).message and warning_remark(warning).hint for warning in outcome.warnings)
    return outcome.warnings


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_of_twelve_good_sets_with_a_tape_measure_at_most_one_has_a_warning(noise):
    sets = [simulate_pairs(20, rng=np.random.default_rng(seed), noise=noise) for seed in range(12)]
    assert sum(bool(codes(simulated.pairs, simulated.camera, measured())) for simulated in sets) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("axes", [(1, -1, 1), (1, 1, -1)])
@pytest.mark.parametrize("sigma_m", [0.01, 0.3])
def test_mirrored_axes_are_caught_whenever_the_camera_position_is_known(axes, sigma_m):
    for seed in range(4):
        simulated = simulate_pairs(20, rng=np.random.default_rng(seed))
        found = codes(moved(simulated.pairs, axes), simulated.camera, measured(sigma_m, (0.0, 0.0, 0.0)))
        assert "mirrored-axes" in found


def test_mirrored_axes_are_caught_by_placements_at_varied_heights_alone():
    tripod = replace(FIELD, max_height_m=1.5)
    simulated = simulate_pairs(20, rng=np.random.default_rng(1), layout=tripod)
    assert "mirrored-axes" in codes(moved(simulated.pairs, (1, -1, 1)), simulated.camera, FREE)
    assert "mirrored-axes" not in codes(simulated.pairs, simulated.camera, FREE)
    assert "handedness-open" not in codes(simulated.pairs, simulated.camera, FREE)


def test_two_mirrored_axes_are_a_rotation_and_give_no_warning():
    simulated = simulate_pairs(20, rng=np.random.default_rng(2))
    assert codes(moved(simulated.pairs, (1, -1, -1)), simulated.camera, measured(0.05)) == set()


def test_a_flat_radar_is_reported():
    simulated = simulate_pairs(20, rng=np.random.default_rng(3))
    assert "flat-radar" in codes(moved(simulated.pairs, (1, 1, 0)), simulated.camera, measured())


def test_wrong_intrinsics_show_in_the_residuals():
    simulated = simulate_pairs(30, rng=np.random.default_rng(4), noise="imaging")
    matrix = simulated.camera.matrix_px * np.array([[1.25, 1, 1], [1, 1.25, 1], [1, 1, 1]])
    wrong = replace(simulated.camera, matrix_px=matrix)
    assert codes(simulated.pairs, wrong, measured()) & {
        "angle-scale",
        "residuals-too-large",
        "many-outliers",
        "camera-position-contradicted",
        "no-pose",
    }


def test_a_wrong_tape_measure_is_contradicted():
    simulated = simulate_pairs(40, rng=np.random.default_rng(5), noise="imaging")
    assert "camera-position-contradicted" in codes(simulated.pairs, simulated.camera, measured(0.02, (0.0, 0.4, 0.0)))


@pytest.mark.slow
def test_a_tape_that_fits_the_residuals_is_doubted_by_the_pairs_all_the_same():
    """An azimuth scale that is uncertain by 2 % leaves the pairs alone uncertain by 10 cm: then only half of these are found."""
    doubted = 0
    for seed in range(6):
        simulated = simulate_pairs(20, rng=np.random.default_rng([51, seed]))
        x_m, y_m, z_m = simulated.rig.camera_position_radar_m.tolist()
        off = {"forward": (x_m - 0.3, y_m, z_m), "left": (x_m, y_m + 0.3, z_m), "up": (x_m, y_m, z_m + 0.3)}
        wrong = without_systematic_errors(measured(0.01, off[("forward", "left", "up")[seed % 3]]))
        found = codes(simulated.pairs, simulated.camera, wrong)
        doubted += bool(found & {"camera-position-contradicted", "camera-position-doubtful"})
        assert codes(simulated.pairs, simulated.camera, measured(0.01, (x_m + 0.02, y_m, z_m - 0.02))) == set()
    assert doubted >= 5


@pytest.mark.parametrize("method", ["default", "paper"])
def test_who_excludes_the_longest_residuals_is_told_with_the_error_of_all(method: Method) -> None:
    simulated, options = simulate_pairs(20, rng=np.random.default_rng(6)), replace(measured(), method=method)
    calibration = calibrate_pairs(simulated.pairs, simulated.camera, options)
    assert isinstance(calibration, Calibration)
    ids = [pair.id for pair in sorted(calibration.pairs, key=lambda pair: -pair.distance_px)]
    cut = calibrate_pairs(simulated.pairs, simulated.camera, options, frozenset(ids[:5]))
    assert isinstance(cut, Calibration)
    (excluded,) = (one for one in cut.warnings if one.code == "excluded-by-residual")
    assert set(excluded.facts["ids"]) == set(ids[:5])
    assert cut.metrics.aed_px == excluded.facts["aed_px"] < excluded.facts["all_aed_px"]
    assert excluded.facts["all_aed_px"] == pytest.approx(np.mean([pair.distance_px for pair in cut.pairs]))
    assert verdict_on(cut).excluded is excluded
    read = read_calibration(calibration_text(cut)).calibration
    assert verdict_on(read).excluded is not None
    assert "excluded by residual" in str(verdict_on(read))
    assert warning_remark(excluded).action == ReviewPairs(tuple(excluded.facts["ids"]))
    for chosen in (ids[-5:], ids[::4], ids[:1]):
        other = calibrate_pairs(simulated.pairs, simulated.camera, options, frozenset(chosen))
        assert isinstance(other, Calibration)
        assert verdict_on(other).excluded is None


def test_leaving_out_pairs_that_disagree_anyway_is_not_excluding_by_residual() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(6), outlier_share=0.2)
    calibration = calibrate_pairs(simulated.pairs, simulated.camera, measured())
    assert isinstance(calibration, Calibration)
    outliers = frozenset(pair.id for pair in calibration.pairs if not pair.inlier)
    cut = calibrate_pairs(simulated.pairs, simulated.camera, measured(), outliers)
    assert isinstance(cut, Calibration)
    assert len(outliers) > 2
    assert verdict_on(cut).excluded is None


def test_placements_in_one_corner_give_a_weak_geometry():
    corner = replace(FIELD, min_range_m=9.0, max_range_m=10.0, max_azimuth_deg=10.0, separation_m=0.05)
    simulated = simulate_pairs(16, rng=np.random.default_rng(7), layout=corner)
    (weak,) = (one for one in warnings(simulated.pairs, simulated.camera, FREE) if one.code == "weak-geometry")
    assert weak.facts["position_cm"] > 10.0
    assert weak.facts["farthest_m"] == pytest.approx(10.0, abs=0.1)
    assert warning_remark(weak).action == MeasureCameraPosition()


def test_many_outliers_are_counted_and_named():
    simulated = simulate_pairs(20, rng=np.random.default_rng(8), outlier_share=0.45)
    (many,) = (one for one in warnings(simulated.pairs, simulated.camera, measured()) if one.code == "many-outliers")
    assert many.facts["pairs"] == 20
    assert len(many.facts["ids"]) > 7
    assert warning_remark(many).action == ReviewPairs(tuple(many.facts["ids"]))


def test_few_pairs_are_reported():
    simulated = simulate_pairs(6, rng=np.random.default_rng(9))
    assert "few-pairs" in codes(simulated.pairs, simulated.camera, measured())


def test_many_clicks_of_few_places_are_reported():
    simulated = simulate_pairs(5, rng=np.random.default_rng(10), noise="imaging")
    rng = np.random.default_rng(1)
    returned = [  # the reflector was carried away and put back, each time to a few centimetres
        replace(pair, id=f"{pair.id}-{k}", pixel_px=pair.pixel_px + rng.standard_normal(2), candidates=(moved,))
        for pair in simulated.pairs
        for k in range(4)
        for own in pair.candidates
        for moved in (replace(own, position_radar_m=own.position_radar_m * (1.0 + 0.002 * k)),)
    ]
    assert "repeated-placements" in codes(returned, simulated.camera, measured())


def test_two_radar_positions_that_fit_one_click_are_reported():
    simulated = simulate_pairs(12, rng=np.random.default_rng(11))
    first = simulated.pairs[0]
    chosen = first.candidates[0]
    farther = replace(chosen, position_radar_m=1.1 * chosen.position_radar_m, score=0.5)
    ambiguous = replace(first, candidates=(replace(chosen, score=0.5), farther))
    (warning,) = (
        one
        for one in warnings([ambiguous, *simulated.pairs[1:]], simulated.camera, measured())
        if one.code == "uncertain-association"
    )
    assert warning.facts["ids"] == ["p1"]
    assert warning_remark(warning).action == ChooseReturn(("p1",))


def ambiguous(count: int) -> tuple[SimulatedPairs, list[Pair]]:
    """Return twelve pairs, so many of them with a second return behind the first."""
    simulated = simulate_pairs(12, rng=np.random.default_rng(11))
    pairs = list(simulated.pairs)
    for i, pair in enumerate(pairs[:count]):
        chosen = replace(pair.candidates[0], score=0.5)
        farther = replace(chosen, position_radar_m=1.1 * chosen.position_radar_m)
        pairs[i] = replace(pair, candidates=(chosen, farther))
    return simulated, pairs


def test_a_click_that_two_returns_fit_does_not_agree_until_one_is_chosen():
    simulated, pairs = ambiguous(1)
    asked, *others = calibrate_pairs(pairs, simulated.camera, measured()).unwrap().pairs
    assert (asked.inlier, asked.outlier_probability) == (False, 0.5)
    assert asked.rival == 1 - asked.candidate
    assert all(other.inlier and other.rival == -1 for other in others)
    chosen = replace(pairs[0], candidates=pairs[0].candidates[:1])
    answered = calibrate_pairs([chosen, *pairs[1:]], simulated.camera, measured()).unwrap().pairs[0]
    assert (answered.inlier, answered.rival) == (True, -1)


def test_what_two_returns_do_at_most_placements_keeps_no_click_from_agreeing():
    simulated, pairs = ambiguous(8)
    outcome = calibrate_pairs(pairs, simulated.camera, measured()).unwrap()
    assert sum(pair.rival >= 0 for pair in outcome.pairs) > 3
    assert all(pair.inlier for pair in outcome.pairs)


def test_a_return_that_another_click_of_the_scene_needs_is_no_rival():
    simulated, pairs = ambiguous(1)
    first, second = pairs[0], pairs[1]
    needed = replace(second, candidates=(first.candidates[1],), image_time=TimeNs(1), pixel_px=second.pixel_px)
    camera, pose = simulated.camera, simulated.camera_from_radar
    pixel_px = camera.project(pose @ first.candidates[1].position_radar_m[None])[0] + [30.0, 0.0]
    needed = replace(needed, pixel_px=pixel_px)
    outcome = calibrate_pairs([replace(first, image_time=TimeNs(0)), needed, *pairs[2:]], camera, measured()).unwrap()
    (result,) = (pair for pair in outcome.pairs if pair.id == first.id)
    assert result.rival == -1
    assert result.candidate == 0


# A pair that alone determines part of the pose is reported; well-spread placements report none.


FAR = replace(FIELD, min_range_m=8.0, max_range_m=10.0, max_azimuth_deg=12.0, separation_m=0.1)
NEAR = replace(FIELD, min_range_m=2.0, max_range_m=2.5)


def decisive(simulated: SimulatedPairs, *more: SimulatedPairs) -> list[DataWarning]:
    pairs = [*simulated.pairs, *(replace(pair, id="near") for other in more for pair in other.pairs)]
    outcome = calibrate_pairs(pairs, simulated.camera, CalibrationOptions()).unwrap()
    return [one for one in outcome.warnings if one.code == "one-pair-decides"]


@pytest.mark.parametrize("noise", ["ti", "imaging"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_near_placement_among_far_ones_decides(noise, seed):
    rng = np.random.default_rng([31, seed])
    far = simulate_pairs(19, rng=rng, noise=noise, layout=FAR)
    near = simulate_pairs(1, rng=rng, noise=noise, layout=NEAR, rig=far.rig)
    (warning,) = decisive(far, near)
    assert warning.facts["pair"] == "near"
    assert warning.facts["loss"] > 8.0


@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_a_second_near_placement_takes_the_decision_from_the_first(noise):
    rng = np.random.default_rng([31, 1])
    far = simulate_pairs(18, rng=rng, noise=noise, layout=FAR)
    near = simulate_pairs(4, rng=rng, noise=noise, layout=NEAR, rig=far.rig)
    pairs = [replace(pair, id=f"near-{i}") for i, pair in enumerate(near.pairs)]
    outcome = calibrate_pairs([*far.pairs, *pairs], far.camera, CalibrationOptions()).unwrap()
    assert "one-pair-decides" not in {one.code for one in outcome.warnings}


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["ti", "imaging"])
def test_no_pair_of_a_good_set_decides(noise):
    for seed in range(8):
        assert decisive(simulate_pairs(20, rng=np.random.default_rng([32, seed]), noise=noise)) == []


# A second pose is found when the pairs leave it open, and the expected distance only when it decides.


def solved(simulated: SimulatedPairs, pairs: tuple[Pair, ...] | None = None) -> Calibration:
    return calibrate_pairs(pairs or simulated.pairs, simulated.camera).unwrap()


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
    best, prior = fit.best.found[0], fit.measurements.prior
    pose = best.camera_from_radar.perturbed(np.array([step_m, 0.0, 0.0, 0.0, 0.0, 0.0]))
    by_prior = [float(prior.costs(one.rotation, one.translation_m)) for one in (pose, best.camera_from_radar)]
    cost = best.cost + worse_by_pairs + by_prior[0] - by_prior[1]
    return replace(fit, best=replace(fit.best, found=(best, GncSolution(pose, cost, 1.0))))


def test_a_pose_that_differs_in_position_only_is_found(fit):
    (warning,) = two_poses(with_another(fit, 0.5, worse_by_pairs=1.0))
    assert warning.code == "two-poses"
    assert warning.facts["away_cm"] == pytest.approx(50.0, abs=2.0)
    assert warning.facts["away_deg"] < 0.2
    assert two_poses(with_another(fit, 0.5, worse_by_pairs=30.0)) == []
    assert two_poses(with_another(fit, 0.001, worse_by_pairs=0.0)) == []


def test_the_expected_distance_is_asked_for_when_it_decides_between_two_poses(fit):
    assert two_poses(with_another(fit, 4.0, worse_by_pairs=1.0)) == []  # no rig has its camera there
    assert two_poses(with_another(fit, 4.0, worse_by_pairs=-20.0)) == []
    solving = replace(fit.options.solving, rig_size_m=30.0)
    two_rigs = replace(fit, options=replace(fit.options, solving=solving))
    (warning,) = two_poses(with_another(two_rigs, 4.0, worse_by_pairs=1.0))
    assert warning.code == "camera-far-away"
    assert warning.facts["expected_m"] == pytest.approx(1.0, abs=0.5)
    assert warning.facts["here_m"] < warning.facts["there_m"] == pytest.approx(4.0, abs=0.5)


@pytest.mark.parametrize("offset_m", [(0.0, 3.0, 0.5), (-3.0, 7.4, 1.0)])
def test_sensors_far_apart_are_no_reason_for_a_warning(offset_m):
    for seed, noise in enumerate[NoiseName](("ti", "imaging")):
        rig = RigOptions(camera_offset_m=offset_m)
        simulated = simulate_pairs(40, rng=np.random.default_rng([72, seed]), noise=noise, rig_options=rig)
        assert "camera-far-away" not in {one.code for one in solved(simulated).warnings}


def test_an_object_that_always_stands_behind_the_reflector_is_found():
    found = 0
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
        other = [one for one in outcome.warnings if one.code == "two-poses"]
        assert all(one.facts["other_returns"] for one in other)
        found += bool(other) or float(np.linalg.norm(error[:3])) < 0.3
    assert found >= 3


# Clicks that miss their dwells to one side indicate a clock offset; single hasty clicks and clicks inside a dwell do not.


DWELL_S = 4.0
EVERY_S = 10.0
AHEAD_S = 3.0


@pytest.fixture(scope="module")
def rooftop(project_root: Path) -> ClickedSample:
    return read_rooftop(project_root, 8.0)


def clock_warnings(rooftop: ClickedSample, ahead_s: float) -> list[DataWarning]:
    clicks, scans, camera = rooftop
    shifted = replace(scans, times_ns=scans.times_ns + round(ahead_s * NS_PER_S))
    outcome = calibrate(clicks, shifted, camera, CalibrationOptions()).unwrap()
    return [one for one in outcome.warnings if one.code == "clock-bias-suspected"]


@pytest.mark.parametrize("ahead_s", [0.0, 1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
def test_an_offset_that_leaves_the_clicks_in_their_dwells_gives_no_warning(rooftop, ahead_s):
    assert clock_warnings(rooftop, ahead_s) == []


@pytest.mark.parametrize("ahead_s", [AHEAD_S, -AHEAD_S])
def test_stamps_that_take_the_clicks_out_of_their_dwells_are_suspected(rooftop, ahead_s):
    (warning,) = clock_warnings(rooftop, ahead_s)
    assert 0.0 < warning.facts["offset_s"] / ahead_s <= 1.0


def placed(offsets_s: list[float]) -> tuple[list[PairResult], RadarScans]:
    """Make one dwell per click, and place each click at an offset from its middle."""
    rng = np.random.default_rng(1)
    scans, pairs = [], []
    for i, offset_s in enumerate(offsets_s):
        place = np.array([3.0 + i, 0.5 * (-1) ** i, -0.5])
        middle_s = 100.0 + EVERY_S * i
        for time_s in np.arange(middle_s - DWELL_S / 2, middle_s + DWELL_S / 2, 0.1):
            scans.append(scan_of(float(time_s), place + 0.005 * rng.standard_normal(3), doppler_mps=np.nan))
        click_ns = TimeNs(round((middle_s + offset_s) * NS_PER_S))
        pairs.append(PairResult(f"c{i}", np.zeros(2), np.zeros(2), place, inlier=True, image_time=click_ns))
    return pairs, RadarScans.from_scans(scans)


def test_the_offset_lies_between_what_all_clicks_allow():
    clicked_s = [-2.9, -1.7, -2.6, -2.5, -3.0]
    offset = clock_offset(*placed(clicked_s), GatingOptions())
    assert offset.least_s == pytest.approx(3.0 - DWELL_S / 2, abs=0.11)
    assert offset.most_s == pytest.approx(1.7 + DWELL_S / 2, abs=0.21)
    assert offset.nearest_s == offset.least_s
    assert offset.outside == ("c0", "c2", "c3", "c4")
    assert offset.clicks == len(clicked_s)


def test_clicks_anywhere_inside_their_dwells_give_no_warning():
    assert clock_offset(*placed([-1.9, 1.8, 0.0, -1.0, 1.5]), GatingOptions()) is None


def test_clicks_that_miss_to_both_sides_are_not_a_clock_offset():
    assert clock_offset(*placed([-2.9, 2.8, -3.1, 3.0, -2.7, 2.9]), GatingOptions()) is None


def test_two_hasty_clicks_are_not_a_clock_offset():
    assert clock_offset(*placed([-2.9, -2.8, 0.0, 0.1, -0.2, 0.3]), GatingOptions()) is None


def test_without_scans_or_stamps_there_is_no_warning():
    pairs, scans = placed([-2.9, -3.0, -2.8])
    assert clock_offset(pairs, RadarScans(), GatingOptions()) is None
    assert clock_offset([replace(pair, image_time=None) for pair in pairs], scans, GatingOptions()) is None


# Clocks that differ by whole placements.


def clocks_apart(warnings: Sequence[DataWarning]) -> list[DataWarning]:
    return [one for one in warnings if one.code == "clocks-apart"]


@pytest.mark.slow
@pytest.mark.parametrize("ahead_s", [9.5, -9.5])
def test_stamps_that_are_a_placement_off_are_found(rooftop, ahead_s):
    clicks, scans, camera = rooftop
    moved_scans = replace(scans, times_ns=scans.times_ns + round(ahead_s * NS_PER_S))
    outcome = calibrate(clicks, moved_scans, camera)
    (warning,) = clocks_apart(outcome.suspected if isinstance(outcome, Unsolvable) else outcome.warnings[:1])
    assert warning.facts["apart_s"] == pytest.approx(ahead_s, abs=2.0)
    assert warning_remark(warning).action == SetOption("clock", "receive")


@pytest.mark.slow
@pytest.mark.parametrize("ahead_s", [37.0, -37.0, 18.0, -18.0])
def test_clocks_of_two_time_scales_are_named_with_the_seconds(rooftop, ahead_s):
    clicks, scans, camera = rooftop
    moved_scans = replace(scans, times_ns=scans.times_ns + round(ahead_s * NS_PER_S))
    outcome = calibrate(clicks, moved_scans, camera)
    (warning,) = clocks_apart(outcome.suspected if isinstance(outcome, Unsolvable) else outcome.warnings[:1])
    assert warning.facts["apart_s"] == ahead_s
    assert warning_remark(warning).action == SetOption("radar_late", f"{ahead_s:.0f}")


ROWS, PER_ROW = 4, 6


def walked_grid(later: int, *, timed: bool = True, wrong: Sequence[int] = ()) -> tuple[list[Pair], Camera]:
    """Walk a grid row by row, each in the same direction; each click is given the return of a placement that much later."""
    rng = np.random.default_rng(3)
    rig = random_rig(rng, camera=study_camera())
    places = [(4.0 + 2.0 * row, column - 2.5, 0.025) for row in range(ROWS) for column in range(PER_ROW)]
    points_m = rig.radar_from_world @ np.array(places)
    pixels_px = rig.camera.project(rig.camera_from_radar @ points_m) + rng.standard_normal((len(places), 2))
    pixels_px[list(wrong)] += 90.0
    seen = np.clip(np.arange(len(places)) + later, 0, len(places) - 1)
    noise = NOISE_PROFILES["imaging"]
    reported_m = points_m + 0.01 * rng.standard_normal(points_m.shape)
    pairs = [
        Pair(
            f"c{i:02}",
            pixels_px[i],
            (candidate_at(reported_m[seen[i]], noise),),
            image_time=TimeNs((100 + 9 * i) * NS_PER_S) if timed else None,
        )
        for i in range(len(places))
    ]
    return pairs, rig.camera


@pytest.mark.parametrize("later", [1, -1])
def test_a_grid_walked_row_by_row_does_not_hide_clocks_that_are_a_placement_off(later):
    """Most pairs agree on a pose that is off by a whole step; only the ends of the rows do not."""
    outcome = calibrate_pairs(*walked_grid(later)).unwrap()
    assert sum(pair.inlier for pair in outcome.pairs) >= (ROWS - 1) * PER_ROW
    (warning,) = clocks_apart(outcome.warnings)
    assert (warning.facts["shifted_agreeing"], warning.facts["shifted_clicks"]) == (23, 23)
    assert (warning.facts["placements"], warning.facts["apart_s"]) == (-later, pytest.approx(-9.0 * later))
    assert verdict_on(outcome).level == "contradictory"


@pytest.mark.parametrize("later", [2, PER_ROW])
def test_clocks_that_are_several_placements_or_a_whole_row_off_are_named_with_the_number(later):
    (warning,) = clocks_apart(calibrate_pairs(*walked_grid(later)).unwrap().warnings)
    assert warning.facts["placements"] == -later


@pytest.mark.parametrize("wrong", [(), (5, 11), (2, 5, 9, 17, 20)])
def test_a_grid_with_wrong_clicks_is_not_a_matter_of_the_clocks(wrong):
    assert clocks_apart(calibrate_pairs(*walked_grid(0, wrong=wrong)).unwrap().warnings) == []


def test_pairs_without_times_say_nothing_of_clocks():
    assert clocks_apart(calibrate_pairs(*walked_grid(1, timed=False)).unwrap().warnings) == []
