"""A calibration keeps its input: solved again, from memory or from its file, it is the same bit for bit."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.solving import calibration_text_of_pairs, solve_pairs
from calib_core.calibration import calibrate, calibrate_pairs, solve_again
from calib_core.errors import InputError, OptionError
from calib_core.interchange import calibration_text, read_calibration
from calib_core.measurements import RadarScans, Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, NoiseOptions, SolvingOptions
from calib_core.results import Calibration
from calib_core.synthetic import simulate_pairs
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
    outcome = calibrate([*marked, lost], scans, camera, options)
    assert isinstance(outcome, Calibration)
    assert [one.id for one in outcome.unpaired] == ["lost"]
    return outcome


def test_the_file_solved_again_differs_only_in_its_provenance(solved: Calibration) -> None:
    text = calibration_text(solved)
    again = solve_pairs(text, "calibration.json", CalibrationOptions())
    assert isinstance(again, Calibration)
    assert without_provenance(calibration_text_of_pairs(again, text, "calibration.json")) == without_provenance(text)


def test_a_calibration_solved_again_from_memory_has_the_same_bits(solved: Calibration) -> None:
    again = solve_again(solved)
    assert isinstance(again, Calibration)
    assert calibration_text(again) == calibration_text(solved)
    assert again.camera_from_radar.rotation.tobytes() == solved.camera_from_radar.rotation.tobytes()
    assert again.covariance.tobytes() == solved.covariance.tobytes()


def test_a_file_written_from_a_file_can_be_solved_again(solved: Calibration) -> None:
    text = calibration_text(read_calibration(calibration_text(solved)).calibration)
    assert text == calibration_text(solved)


def test_clock_warnings_of_the_recording_are_copied(project_root: Path) -> None:
    clicks, scans, camera = read_rooftop(project_root, 8.0)
    late = RadarScans(
        scans.times_ns + 3_500_000_000,
        scans.first_return,
        scans.points_radar_m,
        scans.doppler_mps,
        scans.snr_db,
        scans.sigma_polar,
    )
    outcome = calibrate(clicks, late, camera)
    assert isinstance(outcome, Calibration)
    assert "clock-bias-suspected" in {warning.code for warning in outcome.warnings}
    again = solve_again(outcome)
    assert isinstance(again, Calibration)
    assert again.warnings == outcome.warnings


def test_given_options_override_those_of_the_file(solved: Calibration) -> None:
    text = calibration_text(solved)
    other = "paper" if solved.options.method == "default" else "default"
    again = solve_pairs(text, "calibration.json", CalibrationOptions(noise=NoiseOptions(sigma_px=7.0)))
    assert isinstance(again, Calibration)
    assert again.options == replace(solved.options, noise=replace(solved.options.noise, sigma_px=7.0))
    if other == "paper":
        turned = solve_pairs(text, "calibration.json", CalibrationOptions(method="paper"))
        assert isinstance(turned, Calibration)
        assert turned.options == replace(solved.options, method="paper")
    with pytest.raises(OptionError, match=r"noise\.sigma_px"):
        solve_pairs(text, "calibration.json", CalibrationOptions(noise=NoiseOptions(sigma_px=-1.0)))


def test_pairs_without_candidates_cannot_be_solved_again_and_the_error_says_so(project_root: Path) -> None:
    earlier = (project_root / "tests" / "golden" / "calibration-1-earlier.json").read_text(encoding="utf-8")
    with pytest.raises(InputError, match=r"^earlier\.json: .* pairs have no candidates") as refusal:
        solve_pairs(earlier, "earlier.json", CalibrationOptions())
    assert "\n" not in str(refusal.value)


def test_too_few_pairs_left_give_an_unsolvable_that_keeps_the_unpaired(solved: Calibration) -> None:
    few = replace(solved, pairs=solved.pairs[:3])
    outcome = solve_again(few)
    assert isinstance(outcome, Unsolvable)
    assert outcome.code == "too-few-pairs"
    assert outcome.unpaired == solved.unpaired


def test_alternatives_are_kept_with_their_scores() -> None:
    simulated = simulate_pairs(20, rng=np.random.default_rng(11), noise="ti", decoys=2)
    outcome = calibrate_pairs(simulated.pairs, simulated.camera)
    assert isinstance(outcome, Calibration)
    assert max(len(pair["candidates"]) for pair in json.loads(calibration_text(outcome))["pairs"]) > 1
    back = read_calibration(calibration_text(outcome)).calibration
    for given, kept in zip(simulated.pairs, back.pairs, strict=True):
        assert kept.measured is not None
        assert [c.score for c in kept.measured.candidates] == [c.score for c in given.candidates]
        assert [c.sigma_polar.tolist() for c in kept.measured.candidates] == [
            c.sigma_polar.tolist() for c in given.candidates
        ]
