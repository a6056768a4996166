"""Solved pairs become a file that reads back unchanged and passes its own check."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs, solve_again
from calib_core.errors import InputError
from calib_core.interchange import (
    AssumptionNote,
    Provenance,
    calibration_text,
    check,
    export,
    read_any,
    read_calibration,
    read_pairs,
    write_calibration,
)
from calib_core.interchange.own.calibration_json import calibration_file
from calib_core.measurements import time_from_parts
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.results.verdict import verdict_on
from calib_core.synthetic import NoiseProfile, simulate_pairs


@pytest.fixture
def truth(project_root: Path) -> Calibration:
    return read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8")).calibration


@pytest.mark.parametrize("method", ["default", "paper"])
def test_solved_pairs_become_a_file_that_passes_its_check(truth, method):
    rng = np.random.default_rng(3)
    points = np.column_stack([rng.uniform(4, 15, 14), rng.uniform(-0.35, 0.35, 14), rng.uniform(-0.2, 0.1, 14)])
    points[:, 1:] *= points[:, :1]
    pixels = truth.reproject(points) + rng.normal(0, 1, (14, 2))
    rows = [
        {"id": f"p{i}", "radar_m": point.tolist(), "pixel_px": pixel.tolist()}
        for i, (point, pixel) in enumerate(zip(points, pixels, strict=True))
    ]
    camera = {
        "model": "plumb_bob",
        "width_px": 640,
        "height_px": 480,
        "matrix_px": truth.camera.matrix_px.tolist(),
        "distortion": truth.camera.distortion.tolist(),
    }
    pairs_file = read_pairs(json.dumps({"schema": "cocalib/pairs-1", "camera": camera, "pairs": rows}))
    pairs = [dataclasses.replace(p, image_time=time_from_parts(100 + i, 7)) for i, p in enumerate(pairs_file.pairs)]
    options = dataclasses.replace(pairs_file.options(CalibrationOptions()), method=method)

    outcome = calibrate_pairs(pairs, pairs_file.camera, options, frozenset({"p3"}))
    assert isinstance(outcome, Calibration)
    text = calibration_text(outcome)

    report = check(read_any(text))
    assert report.ok, report.lines()
    verdict = verdict_on(outcome)
    assert json.loads(text)["verdict"] == dataclasses.asdict(verdict)
    assert read_calibration(text).verdict == verdict
    assert write_calibration(read_calibration(text)) == text
    content = json.loads(text)
    assert content["options"]["method"] == method
    assert [pair["image_time"] for pair in content["pairs"]] == [{"sec": 100 + i, "nanosec": 7} for i in range(14)]
    assert [pair["id"] for pair in content["pairs"] if pair["excluded"]] == ["p3"]
    assert content["check_point"]["radar_m"] == [round(value, 3) for value in content["check_point"]["radar_m"]]
    assert check(read_any(export(read_calibration(text), "tf2").data)).ok


def test_a_paper_calibration_with_outliers_passes_its_check():
    simulated = simulate_pairs(20, rng=np.random.default_rng(3), noise="imaging", outlier_share=0.2)
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, CalibrationOptions(method="paper"), frozenset({"p3"}))
    assert isinstance(outcome, Calibration)
    assert any(not pair.inlier and not pair.excluded for pair in outcome.pairs)

    content = json.loads(calibration_text(outcome))
    assert check(read_any(json.dumps(content))).ok

    content["metrics"]["aed_px"] += 1.0
    (wrong,) = (one for one in check(read_any(json.dumps(content))).results if one.level == "error")
    assert wrong.code == "metrics-disagree"
    assert "the pairs that are used average" in wrong.message


def test_a_file_without_a_verdict_stays_without_one(project_root: Path):
    text = (project_root / "tests/golden/calibration-1-earlier.json").read_text(encoding="utf-8")
    assert read_calibration(text).verdict is None
    assert "verdict" not in json.loads(write_calibration(read_calibration(text)))


def test_an_unconfirmed_assumption_makes_the_verdict_in_the_file_weak(truth: Calibration):
    for confirmed, level in ((False, "weak"), (True, verdict_on(truth).level)):
        provenance = Provenance(assumptions=(AssumptionNote("/radar: z in metres", confirmed),))
        assert calibration_file(truth, provenance=provenance).verdict.level == level


def test_results_of_a_later_version_are_kept_and_settings_are_not(project_root: Path):
    document = json.loads((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    value = {"yaw": 0.25, "words": ["weak", None, "\ud800"], "large": 10**30, "small": 1e-300}
    for owner in _results(document):
        owner["observability"] = value
    text = write_calibration(read_calibration(json.dumps(document)))
    again = json.loads(text)
    assert [owner["observability"] for owner in _results(again)] == [value] * len(_results(document))
    assert write_calibration(read_calibration(text)) == text
    found = read_any(text).file
    assert found is not None
    assert write_calibration(found) == text
    document["options"]["noise"]["sigma_pixels"] = 1
    with pytest.raises(InputError, match="unknown key"):
        read_calibration(json.dumps(document))


def _results(document: dict) -> list[dict]:
    """Return every object of results: all of them but the settings."""
    found, objects = [], [document]
    while objects:
        found.append(objects.pop())
        for key, value in found[-1].items():
            if key not in ("camera", "options", "observability") and key != "image_time":
                objects += [item for item in (value if isinstance(value, list) else [value]) if isinstance(item, dict)]
    return found


def test_what_an_earlier_version_wrote_is_read_and_passes_its_check(project_root: Path):
    text = (project_root / "tests/golden/calibration-1-earlier.json").read_text(encoding="utf-8")
    earlier = json.loads(text)

    file = read_calibration(text)

    assert check(read_any(text)).ok
    again = json.loads(write_calibration(file))
    assert all(again[key] == earlier[key] for key in earlier if key not in ("options", "provenance"))
    assert again["provenance"].items() >= earlier["provenance"].items()
    for name, group in earlier["options"].items():
        assert again["options"][name] == group or again["options"][name].items() >= group.items()


def test_a_file_of_the_required_keys_alone_is_read(project_root: Path):
    whole = json.loads((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))
    required = {key: whole[key] for key in ("schema", "camera_from_radar", "frames", "camera")}
    required["camera_from_radar"] = {key: whole["camera_from_radar"][key] for key in ("rotation", "translation_m")}

    file = read_calibration(json.dumps(required))

    assert file.check_point is None
    assert json.loads(write_calibration(file))["covariance"] is None
    for missing in required:
        with pytest.raises(InputError, match=f"{missing}: "):
            read_calibration(json.dumps({key: value for key, value in required.items() if key != missing}))


def test_the_radars_angle_errors_are_stored_with_the_calibration_if_correcting_them_helps():
    simulated = simulate_pairs(30, rng=np.random.default_rng(7), noise=NoiseProfile(0.008, 0.1, 0.25))
    pairs = []
    for pair in simulated.pairs:
        polar = polar_from_cartesian(pair.candidates[0].position_radar_m)
        polar[2] += np.deg2rad(1.5) * np.cos(9.0 * polar[1])
        bent = dataclasses.replace(pair.candidates[0], position_radar_m=cartesian_from_polar(polar))
        pairs.append(dataclasses.replace(pair, candidates=(bent,)))
    outcome = calibrate_pairs(pairs, simulated.camera, CalibrationOptions())
    assert isinstance(outcome, Calibration)
    text = calibration_text(outcome)
    content = json.loads(text)["radar_angle_map"]
    assert content["corrected_aed_px"] < content["aed_px"]
    back = read_calibration(text)
    assert back.calibration.angle_map is not None
    assert np.shape(content["add_elevation_rad"]) == back.calibration.angle_map.correction_rad.shape[:2]
    assert write_calibration(back) == text
    content["add_azimuth_rad"].pop()
    with pytest.raises(InputError, match="radar_angle_map"):
        read_calibration(json.dumps(json.loads(text) | {"radar_angle_map": content}))


def test_a_pose_that_rests_on_a_fleets_prior_is_read_with_one_warning_and_solved_again_without(project_root: Path):
    text = (project_root / "tests/golden/calibration-1-fleet-prior.json").read_text(encoding="utf-8")
    file = read_calibration(text)
    assert [one.code for one in file.calibration.warnings] == ["rests-on-fleet-prior"]
    assert "of type van" in file.calibration.warnings[0].message
    assert file.verdict is not None
    assert file.verdict.level == "weak"
    assert check(read_any(text)).ok

    written = write_calibration(file)
    assert "fleet_prior" not in json.loads(written)
    again = read_calibration(written)
    assert [one.code for one in again.calibration.warnings] == ["rests-on-fleet-prior"]
    assert write_calibration(again) == written
    assert "rests-on-fleet-prior" not in [one.code for one in solve_again(file.calibration).unwrap().warnings]


def test_a_prior_that_an_older_version_left_out_changes_nothing(project_root: Path):
    content = json.loads((project_root / "tests/golden/calibration-1-fleet-prior.json").read_text(encoding="utf-8"))
    content["fleet_prior"]["used"] = False
    file = read_calibration(json.dumps(content))
    assert [one.code for one in file.calibration.warnings] == [one["code"] for one in content["warnings"]]
    assert "fleet_prior" not in json.loads(write_calibration(file))
