"""A calibration keeps its input: solved again, from memory or from its file, it is the same bit for bit."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate, calibrate_pairs, solve_again
from calib_core.errors import InputError, OptionError
from calib_core.interchange.own.calibration_json import calibration_text, read_calibration
from calib_core.measurements import RadarScans
from calib_core.options import CalibrationOptions, CameraPositionPrior, NoiseOptions, SolvingOptions
from calib_core.results import Calibration
from cocalib.solving.solving import GivenPairs, calibration_text_of_pairs, solve_pairs
from tests.rooftop import read_rooftop

OPTIONS = {
    "default": CalibrationOptions(),
    "measured": CalibrationOptions(solving=SolvingOptions(camera_position=CameraPositionPrior((0.1, 0.0, 0.05), 0.02))),
    "noisier": CalibrationOptions(noise=NoiseOptions(sigma_px=3.0, estimate_scale=False)),
    "paper": CalibrationOptions(method="paper"),
}


def without_provenance(text: str) -> dict[str, object]:
    return {key: value for key, value in json.loads(text).items() if key != "provenance"}


@pytest.fixture(scope="module", params=list(OPTIONS))
def solved(request: pytest.FixtureRequest, project_root: Path) -> Calibration:
    options = OPTIONS[request.param]
    clicks, scans, camera = read_rooftop(project_root, 4.0)
    marked = [replace(click, excluded=i in (2, 7), sigma_px=1.5 if i == 4 else None) for i, click in enumerate(clicks)]
    lost = replace(marked[0], id="lost", image_time=marked[0].image_time + 10**12)
    outcome = calibrate([*marked, lost], scans, camera, options).unwrap()
    assert [one.id for one in outcome.unpaired] == ["lost"]
    return outcome


def test_the_file_solved_again_differs_only_in_its_provenance(solved):
    text = calibration_text(solved)
    given = GivenPairs.read(text, "calibration.json")
    again = solve_pairs(given)
    assert isinstance(again, Calibration)
    assert without_provenance(calibration_text_of_pairs(again, given)) == without_provenance(text)


def test_a_calibration_solved_again_from_memory_has_the_same_bits(solved):
    again = solve_again(solved).unwrap()
    assert calibration_text(again) == calibration_text(solved)
    assert again.camera_from_radar.rotation.tobytes() == solved.camera_from_radar.rotation.tobytes()
    assert again.covariance.tobytes() == solved.covariance.tobytes()


def test_a_file_written_from_a_file_can_be_solved_again(solved):
    text = calibration_text(read_calibration(calibration_text(solved)).calibration)
    again, before = json.loads(text), json.loads(calibration_text(solved))
    del again["verdict"]["action"], before["verdict"]["action"]  # where a further placement helps is not in the file
    assert again == before


def test_clock_warnings_of_the_recording_are_copied(project_root):
    clicks, scans, camera = read_rooftop(project_root, 8.0)
    late = RadarScans(
        scans.times_ns + 3_500_000_000,
        scans.first_return,
        scans.points_radar_m,
        scans.doppler_mps,
        scans.snr_db,
        scans.sigma_polar,
    )
    outcome = calibrate(clicks, late, camera).unwrap()
    assert "clock-bias-suspected" in {warning.code for warning in outcome.warnings}
    again = solve_again(outcome).unwrap()
    assert again.warnings == outcome.warnings


def test_given_options_replace_those_of_the_file(solved):
    text = calibration_text(solved)
    louder = replace(solved.options, noise=replace(solved.options.noise, sigma_px=7.0))
    again = solve_pairs(GivenPairs.read(text, "calibration.json"), louder)
    assert isinstance(again, Calibration)
    assert again.options == louder
    other = replace(solved.options, method="paper" if solved.options.method == "default" else "default")
    turned = solve_pairs(GivenPairs.read(text, "calibration.json"), other)
    assert isinstance(turned, Calibration)
    assert turned.options == other
    with pytest.raises(OptionError, match=r"noise\.sigma_px"):
        solve_pairs(
            GivenPairs.read(text, "calibration.json"), replace(solved.options, noise=NoiseOptions(sigma_px=-1.0))
        )


def test_options_that_choose_returns_are_refused_for_pairs_that_exist(solved):
    nearer = replace(solved.options, gating=replace(solved.options.gating, max_range_m=8.0))
    with pytest.raises(OptionError, match=r"^a\.json: gating\.max_range_m chooses radar returns, .* made with 60"):
        solve_pairs(GivenPairs.read(calibration_text(solved), "a.json"), nearer)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda pair: pair["candidates"][0].update(sigma_polar=[0.1, -0.1, 0.1]), r"sigma_polar\[1\]"),
        (lambda pair: pair["candidates"][0].update(score=2.0), "score"),
        (lambda pair: pair["candidates"][0].update(radar_m=[0.0, 0.0, 0.0]), "is at the radar's origin"),
        (lambda pair: pair.update(radar_m=[1.0, 2.0, 3.0]), r"pairs\[1\]\.radar_m: is not the position of candidate 0"),
        (lambda pair: pair.update(candidate=9), r"pairs\[1\]\.radar_m: is not the position of candidate 9"),
        (lambda pair: pair.update(id="a"), "a"),
    ],
)
def test_an_edited_pair_that_contradicts_itself_is_refused_with_its_place(change, words):
    simulated = simulate_pairs(8, rng=np.random.default_rng(2), noise="ti")
    outcome = calibrate_pairs(simulated.pairs, simulated.camera).unwrap()
    content = json.loads(calibration_text(outcome))
    content["pairs"][0]["id"] = "a"
    change(content["pairs"][1])
    with pytest.raises(InputError, match=words) as refusal:
        solve_pairs(GivenPairs.read(json.dumps(content), "edited.json"))
    assert "edited.json" in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_pose_without_pairs_says_so(solved):
    with pytest.raises(InputError, match="contains a pose but no pairs"):
        solve_again(replace(solved, pairs=()))


def test_pairs_without_candidates_cannot_be_solved_again_and_the_error_says_so(solved):
    bare = calibration_text(replace(solved, pairs=tuple(replace(pair, measured=None) for pair in solved.pairs)))
    with pytest.raises(InputError, match=r"^bare\.json: .* pairs have no candidates") as refusal:
        solve_pairs(GivenPairs.read(bare, "bare.json"))
    assert "\n" not in str(refusal.value)


def test_too_few_pairs_left_give_an_unsolvable_that_keeps_the_unpaired(solved):
    few = replace(solved, pairs=solved.pairs[:3])
    outcome = solve_again(few)
    assert outcome.code == "too-few-pairs"
    assert outcome.unpaired == solved.unpaired


def test_alternatives_are_kept_with_their_scores():
    simulated = simulate_pairs(20, rng=np.random.default_rng(11), noise="ti", decoys=2)
    outcome = calibrate_pairs(simulated.pairs, simulated.camera).unwrap()
    assert max(len(pair["candidates"]) for pair in json.loads(calibration_text(outcome))["pairs"]) > 1
    back = read_calibration(calibration_text(outcome)).calibration
    for given, kept in zip(simulated.pairs, back.pairs, strict=True):
        assert [c.score for c in kept.measured.candidates] == [c.score for c in given.candidates]
        assert [c.sigma_polar.tolist() for c in kept.measured.candidates] == [
            c.sigma_polar.tolist() for c in given.candidates
        ]
