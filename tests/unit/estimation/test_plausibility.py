"""Input in other units, images and axes is named, whether or not a pose can be solved from it."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.association.array_pairs import pairs_from_arrays
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera, CameraCovariance
from calib_core.errors import InputError
from calib_core.measurements import Candidate, Facts, Pair, Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, Method, SolvingOptions
from calib_core.results import Calibration
from calib_core.results.verdict import stated_error, verdict_on
from calib_core.synthetic.rig import RigOptions

SUSPECTED = {"units-suspected", "pixels-suspected", "radar-axes-suspected"}
DOUBTED = {"camera-position-contradicted", "camera-position-doubtful"}
RIG = RigOptions(camera_offset_m=(0.0, 0.5, 0.1))


@pytest.fixture(scope="module")
def simulated() -> SimulatedPairs:
    return simulate_pairs(20, rng=np.random.default_rng(91), rig_options=RIG)


def arrays(simulated: SimulatedPairs) -> tuple[np.ndarray, np.ndarray]:
    positions = np.array([pair.candidates[0].position_radar_m for pair in simulated.pairs])
    return positions, np.array([pair.pixel_px for pair in simulated.pairs])


def found_in(
    simulated: SimulatedPairs,
    points: np.ndarray,
    pixels: np.ndarray,
    *,
    position_m: np.ndarray | None = None,
    method: Method = "default",
) -> dict[str, Facts]:
    """Return what was found in the input, by code."""
    prior = None if position_m is None else CameraPositionPrior(tuple(position_m.tolist()), 0.01)
    options = CalibrationOptions(method=method, solving=SolvingOptions(camera_position=prior))
    outcome = calibrate_pairs(pairs_from_arrays(points, pixels), simulated.camera, options)
    if isinstance(outcome, Unsolvable):
        return {one.code: one.facts for one in (outcome, *outcome.suspected)}
    return {one.code: one.facts for one in outcome.warnings}


@pytest.mark.slow
@pytest.mark.parametrize("method", ["default", "paper"])
@pytest.mark.parametrize(
    ("change", "code", "facts"),
    [
        (lambda points, pixels: (1000.0 * points, pixels), "units-suspected", {"unit": "millimeters"}),
        (lambda points, pixels: (100.0 * points, pixels), "units-suspected", {"unit": "centimeters"}),
        (lambda points, pixels: (points, pixels[:, ::-1]), "pixels-suspected", {"exchanged": True}),
        (lambda points, pixels: (points, pixels / 2.0), "pixels-suspected", {"clicks": 20}),
        (
            lambda points, pixels: (points, pixels + np.array([0.0, 600.0])),
            "pixels-suspected",
            {"width_px": 1920, "height_px": 1080},
        ),
        (
            lambda points, pixels: (points[:, [1, 0, 2]] * [-1.0, 1.0, 1.0], pixels),
            "radar-axes-suspected",
            {"side": "left"},
        ),
        (lambda points, pixels: (points * [-1.0, -1.0, 1.0], pixels), "radar-axes-suspected", {"side": "behind"}),
    ],
)
def test_what_the_input_looks_like_is_found(simulated, change, code, facts, method):
    found = found_in(simulated, *change(*arrays(simulated)), method=method)
    assert facts.items() <= found[code].items()
    assert code == "units-suspected" or "mirrored-axes" not in found


def test_clicks_of_a_smaller_image_and_clicks_outside_are_told_apart(simulated):
    points, pixels = arrays(simulated)
    halved, shifted = (
        found_in(simulated, points, moved)["pixels-suspected"]
        for moved in (pixels / 2.0, pixels + np.array([0.0, 600.0]))
    )
    assert 0.3 < min(halved["reach"]) < max(halved["reach"]) <= 0.5
    assert shifted["outside"] > 0
    assert shifted["pixel_px"][1] > 1080


def test_good_input_is_not_suspected(simulated):
    found = found_in(simulated, *arrays(simulated))
    assert not set(found) & SUSPECTED


@pytest.mark.parametrize(
    ("in_ranges", "in_tape", "misread"), [(1.0 / 0.3048, 1.0, "ranges"), (1.0, 1.0 / 0.3048, "position")]
)
def test_feet_are_told_by_a_measured_position(simulated, in_ranges, in_tape, misread):
    points, pixels = arrays(simulated)
    position_m = in_tape * simulated.rig.camera_position_radar_m
    found = found_in(simulated, in_ranges * points, pixels, position_m=position_m)["camera-position-contradicted"]
    assert (found["misread"], found["unit"]) == (misread, "feet")


@pytest.mark.slow
def test_a_position_measured_along_the_ground_beside_a_tilted_radar_is_told():
    tilted = RigOptions(radar_tilt_deg=20.0, camera_offset_m=(1.5, 0.2, 0.4))
    misread = []
    for seed in range(6):
        simulated = simulate_pairs(40, rng=np.random.default_rng([94, seed]), noise="imaging", rig_options=tilted)
        level_m = simulated.rig.radar_from_world.rotation.T @ simulated.rig.camera_position_radar_m
        found = found_in(simulated, *arrays(simulated), position_m=level_m)
        misread += [(facts["misread"], facts["unit"]) for code, facts in found.items() if code in DOUBTED]
    assert len(misread) >= 4
    assert misread.count(("position", "level")) >= len(misread) - 1


def test_a_position_in_centimetres_is_blamed_rather_than_the_placements():
    for seed in range(3):
        simulated = simulate_pairs(20, rng=np.random.default_rng([92, seed]), noise="imaging")
        found = found_in(simulated, *arrays(simulated), position_m=100.0 * simulated.rig.camera_position_radar_m)
        assert set(found) & {"camera-position-contradicted", "units-suspected"}
        assert "degenerate-placements" not in found


def test_what_follows_from_a_named_unit_is_not_said(simulated):
    points, pixels = arrays(simulated)
    found = set(found_in(simulated, 1000.0 * points, pixels))
    assert "units-suspected" in found
    assert not {"weak-geometry", "camera-far-away", "two-poses", "handedness-assumed"} & found


def test_a_unit_is_named_only_if_the_pairs_place_the_camera_clearly_away_from_the_radar(simulated):
    for seed in range(3):
        near = simulate_pairs(20, rng=np.random.default_rng([93, seed]))
        found = found_in(near, *arrays(near), position_m=near.rig.camera_position_radar_m + np.array([0.0, 11.0, 0.0]))
        assert found["camera-position-contradicted"]["unit"] == ""
    found = found_in(simulated, *arrays(simulated), position_m=100.0 * simulated.rig.camera_position_radar_m)
    facts = found["camera-position-contradicted"]
    assert (facts["misread"], facts["unit"]) == ("position", "centimeters")


def changed(pair: Pair, **values: object) -> Pair:
    candidate: Candidate = replace(pair.candidates[0], **values)
    return replace(pair, candidates=(candidate,))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda pair: replace(pair, pixel_px=np.array([np.nan, 1.0])), r"pair p1: pixel \(nan, 1\) is not finite"),
        (lambda pair: replace(pair, sigma_px=np.nan), "pair p1: sigma_px is nan; .* above zero"),
        (lambda pair: replace(pair, sigma_px=0.0), "pair p1: sigma_px is 0; .* above zero"),
        (lambda pair: replace(pair, id="p2"), "pair p2: the id occurs more than once"),
        (lambda pair: changed(pair, position_radar_m=np.array([0.001, 0, 0])), "p1: .* 1 mm from the radar's origin"),
        (
            lambda pair: changed(pair, position_radar_m=np.array([1, np.inf, 0])),
            "pair p1: radar position .* not finite",
        ),
        (lambda pair: changed(pair, sigma_polar=np.array([0.1, np.nan, 0.1])), "pair p1: sigma_polar is .* above zero"),
        (lambda pair: changed(pair, sigma_polar=np.array([0.1, -0.1, 0.1])), "pair p1: sigma_polar is .* above zero"),
    ],
)
def test_impossible_numbers_in_a_pair_are_refused_with_its_name(simulated, change, words):
    first, *others = simulated.pairs
    with pytest.raises(InputError, match=words):
        calibrate_pairs([change(first), *others], simulated.camera)


def test_a_position_behind_the_radar_is_an_outlier_and_not_the_end(simulated):
    first, *others = simulated.pairs
    behind = changed(first, position_radar_m=first.candidates[0].position_radar_m * np.array([-1.0, -1.0, 1.0]))
    outcome = calibrate_pairs([behind, *others], simulated.camera).unwrap()
    assert [pair.id for pair in outcome.pairs if not pair.inlier] == ["p1"]


def with_principal_point(camera: Camera, right: float, down: float) -> Camera:
    """Return the camera with its principal point off the image's middle by shares of width and height."""
    matrix_px = camera.matrix_px.copy()
    size = np.array([camera.width_px, camera.height_px])
    matrix_px[:2, 2] = (size - 1.0) / 2.0 + np.array([right, down]) * size
    return replace(camera, matrix_px=matrix_px)


def with_clicks_of(simulated: SimulatedPairs, camera: Camera) -> Calibration:
    """Solve with the clicks that this camera, if its intrinsics are right, would see."""
    rng = np.random.default_rng(5)
    seen = camera.project(simulated.camera_from_radar @ simulated.points_radar_m)
    pixels = seen + rng.normal(0.0, 2.0, seen.shape)
    points, _ = arrays(simulated)
    inside = ((pixels > 0.0) & (pixels < [camera.width_px, camera.height_px])).all(axis=1)
    sigma_polar = simulated.pairs[0].candidates[0].sigma_polar
    return calibrate_pairs(pairs_from_arrays(points[inside], pixels[inside], sigma_polar=sigma_polar), camera).unwrap()


def of_image(calibration: Calibration) -> list[tuple[str, str]]:
    return [(one.code, one.facts["mode"]) for one in calibration.warnings if "principal_point_px" in one.facts]


def test_the_matrix_of_another_image_mode_is_named(simulated):
    """A camera's 4:3 matrix with its 16:9 images: no residual shows it, and the pose turns by as much."""
    points, pixels = arrays(simulated)
    wrong = with_principal_point(simulated.camera, 0.0, 0.5 * (16.0 / 9.0 / (4.0 / 3.0) - 1.0))
    calibration = calibrate_pairs(pairs_from_arrays(points, pixels), wrong).unwrap()
    assert of_image(calibration) == [("intrinsics-suspected", "4:3")]
    assert verdict_on(calibration).level == "coarse"


def test_a_principal_point_outside_the_image_contradicts_it(simulated):
    points, pixels = arrays(simulated)
    wrong = with_principal_point(simulated.camera, 0.0, 0.6)
    calibration = calibrate_pairs(pairs_from_arrays(points, pixels), wrong).unwrap()
    assert of_image(calibration) == [("pixels-suspected", "")]
    assert verdict_on(calibration).level == "contradictory"


def test_a_webcam_that_is_off_its_middle_stays_usable():
    simulated = simulate_pairs(20, rng=np.random.default_rng(92), noise="imaging", rig_options=RIG)
    webcam = with_principal_point(simulated.camera, 0.068, -0.081)
    calibration = with_clicks_of(simulated, webcam)
    assert of_image(calibration) == []
    assert verdict_on(calibration).level in ("usable", "good")
    (told,) = (one for one in calibration.warnings if one.code == "principal-point-off")
    assert (told.facts["right"], told.facts["down"]) == pytest.approx((0.068, -0.081), abs=0.001)
    assert verdict_on(calibration).cause == told
    middle = with_clicks_of(simulated, with_principal_point(simulated.camera, 0.0, 0.0))
    assert "principal-point-off" not in {one.code for one in middle.warnings}
    assert stated_error(calibration).rotation_deg > stated_error(middle).rotation_deg


def test_a_part_of_an_image_and_a_board_calibration_are_asked_nothing(simulated):
    part = simulated.camera.windowed((0, 0), (simulated.camera.width_px, 600), (1, 1))
    assert of_image(with_clicks_of(simulated, part)) == []
    camera = with_principal_point(simulated.camera, 0.0, 0.2)
    known = replace(camera, covariance=CameraCovariance(("cx_px", "cy_px"), np.eye(2)))
    assert of_image(with_clicks_of(simulated, known)) == []


def test_clicks_in_one_row_are_told(simulated):
    """A guess at the horizon puts the camera at the placements' height, and no residual shows it."""
    points, pixels = arrays(simulated)
    guessed = np.column_stack([pixels[:, 0], np.random.default_rng(6).normal(540.0, 3.0, len(pixels))])
    assert found_in(simulated, points, guessed)["one-row"]["row_px"] == pytest.approx(540.0, abs=2.0)
    told = calibrate_pairs(pairs_from_arrays(points, guessed), simulated.camera).unwrap()
    assert verdict_on(told).level in ("coarse", "contradictory")
    assert "one-row" not in found_in(simulated, points, pixels)
    rows_px = guessed[:, 1] - guessed[:, 1].mean()
    wider_px = 0.0075 * simulated.camera.height_px / rows_px.std() * rows_px
    assert "one-row" not in found_in(simulated, points, np.column_stack([pixels[:, 0], 540.0 + wider_px]))
    directions = points / np.linalg.norm(points, axis=1, keepdims=True)
    assert "one-row" not in found_in(simulated, 8.0 * directions, guessed)
    assert "one-row" in found_in(simulated, np.linspace(5.0, 10.0, len(points))[:, None] * directions, guessed)
