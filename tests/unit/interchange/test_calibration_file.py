"""Solved pairs become a file that reads back unchanged and passes its own check."""

import dataclasses
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import calib_core as cc
from benchmarks.simulated_pairs import SystematicErrors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import (
    MOST_CHARACTERS,
    AssumptionNote,
    CalibrationFile,
    Provenance,
    VehicleNote,
)
from calib_core.interchange.check.pair_residuals import read_check_pairs
from calib_core.interchange.check.report import check
from calib_core.interchange.exporting import contents_text, export
from calib_core.interchange.format import imported
from calib_core.interchange.formats.registry import FORMATS
from calib_core.interchange.importing import adoption, read_any
from calib_core.interchange.own.calibration_json import (
    calibration_file,
    calibration_text,
    read_calibration,
    write_calibration,
)
from calib_core.interchange.own.pairs_files import read_pairs
from calib_core.interchange.own.raw_data import aed_either_way, for_raw, other_pose
from calib_core.interchange.statement import statement
from calib_core.measurements import time_from_parts
from calib_core.options import CalibrationOptions, CameraPositionPrior, NoiseOptions, SolvingOptions
from calib_core.radar import RadarErrors, cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration
from calib_core.results.verdict import verdict_on
from calib_core.words.verdict import stated_verdict


@pytest.fixture
def truth(file: CalibrationFile) -> Calibration:
    return file.calibration


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

    outcome = calibrate_pairs(pairs, pairs_file.camera, options, frozenset({"p3"})).unwrap()
    text = calibration_text(outcome)

    report = check(read_any(text))
    assert report.ok, report.lines()
    verdict = stated_verdict(verdict_on(outcome))
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
    outcome = calibrate_pairs(
        simulated.pairs, simulated.camera, CalibrationOptions(method="paper"), frozenset({"p3"})
    ).unwrap()
    assert any(not pair.inlier and not pair.excluded for pair in outcome.pairs)

    content = json.loads(calibration_text(outcome))
    assert check(read_any(json.dumps(content))).ok

    content["metrics"]["aed_px"] += 1.0
    (wrong,) = (one for one in check(read_any(json.dumps(content))).results if one.level == "error")
    assert wrong.code == "metrics-disagree"
    assert "that are used average" in wrong.message


def test_printed_a_file_shows_pose_figures_frames_and_where_it_comes_from(golden_text):
    file = read_calibration(golden_text)
    text = str(file)
    assert text.startswith(str(file.calibration))
    for fact in (file.frames.radar, file.frames.camera, file.rests_on, file.provenance.version):
        assert fact in text


def test_a_file_without_a_verdict_stays_without_one(golden_text):
    text = json.dumps({key: value for key, value in json.loads(golden_text).items() if key != "verdict"})
    assert read_calibration(text).verdict is None
    assert "verdict" not in json.loads(write_calibration(read_calibration(text)))


def test_an_unconfirmed_assumption_makes_the_verdict_in_the_file_weak(truth):
    for confirmed, level in ((False, "coarse"), (True, verdict_on(truth).level)):
        provenance = Provenance(assumptions=(AssumptionNote("/radar: z in metres", confirmed),))
        assert calibration_file(truth, provenance=provenance).verdict.level == level


def test_results_of_a_later_version_are_kept_and_settings_are_not(golden_text):
    document = json.loads(golden_text)
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


def test_a_file_of_the_required_keys_alone_is_read(golden_text):
    whole = json.loads(golden_text)
    required = {key: whole[key] for key in ("schema", "camera_from_radar", "frames", "camera")}
    required["camera_from_radar"] = {key: whole["camera_from_radar"][key] for key in ("rotation", "translation_m")}

    file = read_calibration(json.dumps(required))

    assert file.check_point is None
    assert json.loads(write_calibration(file))["covariance"] is None
    for missing in required:
        with pytest.raises(InputError, match=f"{missing}: "):
            read_calibration(json.dumps({key: value for key, value in required.items() if key != missing}))


def test_the_radars_angle_errors_are_stored_with_the_calibration_if_correcting_them_helps():
    simulated = simulate_pairs(30, rng=np.random.default_rng(7), noise=NoiseOptions(2.0, 0.008, 0.1, 0.25))
    pairs = []
    for pair in simulated.pairs:
        polar = polar_from_cartesian(pair.candidates[0].position_radar_m)
        polar[2] += np.deg2rad(1.5) * np.cos(9.0 * polar[1])
        bent = dataclasses.replace(pair.candidates[0], position_radar_m=cartesian_from_polar(polar))
        pairs.append(dataclasses.replace(pair, candidates=(bent,)))
    outcome = calibrate_pairs(pairs, simulated.camera, CalibrationOptions()).unwrap()
    text = calibration_text(outcome)
    content = json.loads(text)["radar_angle_map"]
    assert content["corrected_aed_px"] < content["aed_px"]
    back = read_calibration(text)
    assert np.shape(content["add_elevation_rad"]) == back.calibration.angle_map.correction_rad.shape[:2]
    assert write_calibration(back) == text
    content["add_azimuth_rad"].pop()
    with pytest.raises(InputError, match="radar_angle_map"):
        read_calibration(json.dumps(json.loads(text) | {"radar_angle_map": content}))


def test_a_key_that_this_version_does_not_have_is_read_told_and_kept(golden_text):
    content = json.loads(golden_text) | {"fleet_prior": {"vehicle_type": "van", "used": True}}
    (note,) = read_any(json.dumps(content)).notes
    assert note.endswith(": fleet_prior")
    assert json.loads(write_calibration(read_calibration(json.dumps(content)))) == content
    assert read_any(golden_text).notes == ()


# What of the covariance rests on stated sigmas, in a calibration's file.


@cache
def calibration(*, with_tape: bool = True, method: str = "default") -> Calibration:
    made = simulate_pairs(12, rng=np.random.default_rng(2), noise="imaging")
    forward, left, up = made.camera_from_radar.inverse().translation_m.tolist()
    tape = CameraPositionPrior((forward, left, up), 0.02) if with_tape else None
    options = CalibrationOptions(method=method, solving=SolvingOptions(camera_position=tape))
    return calibrate_pairs(made.pairs, made.camera, options).unwrap()


def test_they_are_read_as_they_were_written_and_written_again_as_the_same_bytes():
    text = calibration_text(calibration())
    file = read_calibration(text)
    wrote, read = calibration().covariance_parts, file.calibration.covariance_parts
    np.testing.assert_allclose(read.systematic, wrote.systematic, rtol=1e-12)
    np.testing.assert_allclose(read.camera_position, wrote.camera_position, rtol=1e-12)
    assert write_calibration(file) == text


def test_without_a_tape_its_part_is_not_written_and_of_other_methods_there_are_none():
    assert set(json.loads(calibration_text(calibration(with_tape=False)))["covariance_parts"]) == {"systematic"}
    papers = calibration_text(calibration(method="paper"))
    assert "covariance_parts" not in json.loads(papers)
    assert read_calibration(papers).calibration.covariance_parts is None


@pytest.mark.parametrize("part", ["covariance", "covariance_parts.systematic", "covariance_parts.camera_position"])
def test_a_part_that_is_no_covariance_is_refused_by_its_name(part):
    document: dict[str, Any] = json.loads(calibration_text(calibration()))
    whole, _, name = part.partition(".")
    (document[whole][name] if name else document[whole])[2][2] = -1.0
    with pytest.raises(InputError, match=rf"file.json: {part}: a variance on the diagonal is negative"):
        read_calibration(json.dumps(document), source="file.json")


# The errors that all pairs share are in the file, to the last bit, and the check point is free of them.


@pytest.fixture(scope="module")
def solved() -> Calibration:
    simulated = simulate_pairs(20, rng=np.random.default_rng(1), noise="imaging")
    return calibrate_pairs(simulated.pairs, simulated.camera).unwrap()


def test_the_errors_come_back_to_the_last_bit(solved):
    text = calibration_text(solved)
    read = read_calibration(text).calibration
    assert solved.radar_errors != RadarErrors()
    assert read.radar_errors == solved.radar_errors
    assert read.systematic_errors == solved.systematic_errors
    assert write_calibration(read_calibration(text)) == text


def test_the_file_applies_its_errors_when_it_is_checked(solved):
    text = calibration_text(solved)
    assert check(read_any(text)).ok
    document = json.loads(text)
    del document["radar_errors"]
    assert "pairs-disagree" in [result.code for result in check(read_any(json.dumps(document))).results]


def test_a_check_against_its_own_pairs_gives_its_aed(solved):
    text = calibration_text(solved)
    report = check(read_any(text), pairs=read_check_pairs(text))
    assert f"AED {solved.metrics.aed_px:.3g} px" in str(report)


def test_a_bare_export_is_checked_with_the_errors_that_the_pairs_file_states(solved):
    text = calibration_text(solved)
    bare = read_any(export(read_calibration(text), "tf2").data.decode())
    report = check(bare, pairs=read_check_pairs(text))
    assert f"AED {solved.metrics.aed_px:.3g} px" in str(report)


def test_every_export_with_comments_states_the_errors_and_reads_back(solved):
    file = read_calibration(calibration_text(solved))
    for form in FORMATS:
        if form.comment not in ("#", "<!-- -->") or form.name == "colmap":
            continue
        text = export(file, form.name, returns="corrected" if form.pose_for else None).data.decode()
        assert f"azimuth_scale {solved.radar_errors.azimuth_scale:.6g}" in text, form.name
        if form.reads is not None:
            assert check(read_any(text), camera=solved.camera).ok, form.name


def test_the_plain_transform_takes_the_check_point_to_its_pixel(solved):
    point = json.loads(calibration_text(solved))["check_point"]
    projected = solved.camera.project(solved.camera_from_radar @ np.array([point["radar_m"]]))[0]
    np.testing.assert_allclose(projected, point["pixel_px"], atol=1e-9)


def test_a_file_without_the_keys_has_no_errors_and_stays_without_them(solved):
    document = json.loads(calibration_text(replace(solved, radar_errors=RadarErrors(), systematic_errors=())))
    assert not {"radar_errors", "systematic_errors"} & document.keys()
    assert read_calibration(json.dumps(document)).calibration.radar_errors == RadarErrors()


def test_a_scale_of_zero_is_refused(solved):
    document = json.loads(calibration_text(solved))
    document["radar_errors"]["azimuth_scale"] = -1.0
    with pytest.raises(InputError, match=r"radar_errors\.azimuth_scale"):
        read_calibration(json.dumps(document))


# Which vehicle a calibration is of, in its file.


FULL = VehicleNote("V017", "van", "2026-09-21", "R-0417", "C-\u00fc12", "base_link", (3.7, 0.0, 0.6, 0.0, -1.5, 45.0))
KEYS = list(VehicleNote.__struct_fields__)
GOLDEN = (Path(__file__).resolve().parents[2] / "golden/calibration-1.json").read_text(encoding="utf-8")

_LABELS = st.text(st.characters(exclude_categories=("C", "Z")), min_size=1, max_size=MOST_CHARACTERS)
_NAMES = _LABELS.filter(lambda text: text.strip(".") and not set(text) & set("/\\"))
_NUMBERS = st.floats(-180.0, 180.0).map(lambda value: value + 0.0)
_TEXTS = [key for key in KEYS if key != "radar_mount"]
_NOTES = st.builds(
    VehicleNote,
    radar_mount=st.none() | st.tuples(*[_NUMBERS] * 6),
    **{key: st.none() | (_NAMES if key in ("name", "session") else _LABELS) for key in _TEXTS},
)


def with_vehicle(vehicle: object) -> str:
    return json.dumps({**json.loads(GOLDEN), "vehicle": vehicle})


@pytest.mark.slow
@settings(max_examples=20)
@given(_NOTES, _NOTES)
def test_any_note_is_read_back_and_goes_before_what_a_file_says(one, other):
    text = write_calibration(replace(read_calibration(GOLDEN), vehicle=one))
    stated = {key: value for key in KEYS if (value := getattr(one, key)) is not None}
    stated |= {key: list(value) for key, value in stated.items() if isinstance(value, tuple)}
    assert json.loads(text).get("vehicle", {}) == stated
    assert ("vehicle" in json.loads(text)) == bool(stated)
    assert read_calibration(text).vehicle == one
    assert write_calibration(read_calibration(text)) == text
    both = one.over(other)
    assert all(getattr(both, key) == (getattr(one, key) or getattr(other, key)) for key in KEYS)


def test_a_file_of_which_nothing_is_stated_stays_as_it_is():
    assert write_calibration(read_calibration(GOLDEN)) == GOLDEN
    assert write_calibration(read_calibration(with_vehicle({}))) == GOLDEN
    assert read_calibration(GOLDEN).vehicle == VehicleNote()


@pytest.mark.parametrize("vehicle", [{"plate": "F-17"}, {"name": "V017", "plate": "F-17"}])
def test_what_a_later_version_states_is_kept(vehicle):
    text = write_calibration(read_calibration(with_vehicle(vehicle)))
    assert json.loads(text)["vehicle"] == vehicle
    assert write_calibration(read_calibration(text)) == text


@pytest.mark.parametrize(
    ("vehicle", "fault"),
    [
        ("V017", "vehicle: expected object | null, got str"),
        ({"name": 17}, "vehicle.name: expected str | null, got int"),
        ({"name": ""}, "vehicle.name is ''; give 1 to 120 printable characters"),
        ({"radar_serial": "a\u202eb"}, "vehicle.radar_serial is 'a\\u202eb'; give 1 to 120 printable characters"),
        ({"name": "a/b"}, "vehicle.name: 'a/b' cannot be a name; give one without slashes"),
        ({"session": ".."}, "vehicle.session: '..' cannot be a name; give one without slashes"),
    ],
)
def test_an_invalid_value_is_refused_by_every_reader(vehicle, fault):
    for read in (read_calibration, read_any):
        with pytest.raises(InputError) as error:
            read(with_vehicle(vehicle), "mine.json")
        assert str(error.value).startswith(f"mine.json: {fault}")


@pytest.mark.parametrize("key", _TEXTS)
@pytest.mark.parametrize("value", ["", " ", "x" * 121, "a\x00", "\ud800"])
def test_a_note_that_no_file_can_hold_cannot_be_made(key, value):
    with pytest.raises(InputError, match=rf"^vehicle\.{key} is "):
        VehicleNote(**{key: value})
    assert getattr(VehicleNote(**{key: "x" * 120}), key) == "x" * 120


def test_an_export_that_holds_the_calibration_keeps_it(file):
    stated = replace(file, vehicle=FULL)
    written = export(stated, "json")
    assert written.content == write_calibration(stated)
    assert adoption(read_any(written.data, written.file_name), written.file_name).file.vehicle == FULL


def test_a_script_states_it_too(file, tmp_path):
    path = tmp_path / "calibration.json"
    note = cc.VehicleNote(name="V017", radar_serial="R-0417")
    cc.write_calibration(path, file.calibration, vehicle=note)
    assert json.loads(path.read_text())["vehicle"] == {"name": "V017", "radar_serial": "R-0417"}
    assert cc.read_calibration(path).vehicle == note


def test_the_schema_says_the_same(file, project_root):
    path = project_root / "docs/schemas/calibration-1.schema.json"
    schema: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(schema)
    assert validator.is_valid(json.loads(write_calibration(replace(file, vehicle=FULL))))
    assert validator.is_valid(json.loads(with_vehicle({"plate": "F-17"})))
    for wrong in ("V017", {"name": ""}, {"type": "x" * 121}, {"session": 3}):
        assert not validator.is_valid(json.loads(with_vehicle(wrong)))


@pytest.fixture(scope="module")
def scaled() -> CalibrationFile:
    """Return a calibration of a radar that reports its azimuths 4 % too large."""
    errors = SystematicErrors(azimuth_scale=0.04, range_bias_m=0.05)
    drawn = simulate_pairs(24, rng=np.random.default_rng(12), noise="imaging", systematic=errors)
    return calibration_file(calibrate_pairs(drawn.pairs, drawn.camera).unwrap())


POSED = [known for known in FORMATS if known.pose_for and known.reads and known.write]


@pytest.mark.parametrize("known", POSED, ids=[known.name for known in POSED])
def test_an_export_says_what_the_pose_for_the_other_radar_data_would_change(scaled, known):
    right, without = aed_either_way(scaled)
    written = export(scaled, known.name, rectified=known.is_for_rectified)
    other = written.other_pose

    assert without > 1.5 * right
    assert other.is_for == ("corrected" if known.pose_for == "raw" else "raw")
    assert f"--for {other.is_for}" in other.note
    assert other.note in written.notes
    assert other.moved_cm > 1
    assert other.aed_px[1] < other.aed_px[0]
    assert read_any(written.data).for_raw == (known.pose_for == "raw")
    again = export(scaled, known.name, rectified=known.is_for_rectified, returns=other.is_for)
    assert again.other_pose.is_for == known.pose_for
    assert read_any(again.data).for_raw == (other.is_for == "raw")


@pytest.mark.slow
@pytest.mark.parametrize("known", POSED, ids=[known.name for known in POSED])
def test_a_pose_for_raw_data_says_so_in_its_file_and_check_knows_it(scaled, known):
    raw = for_raw(scaled)
    with_errors, without = aed_either_way(scaled), aed_either_way(raw)
    found = read_any(export(scaled, known.name, rectified=known.is_for_rectified, returns="raw").data)

    assert without[0] < with_errors[1]
    assert without[1] == with_errors[0]
    assert found.for_raw
    whole = imported(scaled)
    report = check(found, of=whole, against=whole, pairs=read_check_pairs(write_calibration(scaled)))
    assert report.verdict == "right", str(report)
    assert {"same-pose", "agrees", "pairs-fit"} <= {one.code for one in report.results}
    assert "data as reported" in str(report)
    plain = read_any(export(scaled, known.name, rectified=known.is_for_rectified, returns="corrected").data)
    assert np.linalg.norm(plain.pose.translation_m - found.pose.translation_m) > 0.02


@pytest.mark.parametrize("known", POSED, ids=[known.name for known in POSED])
def test_the_comment_of_an_export_has_at_most_six_lines(scaled, known):
    content = contents_text(export(scaled, known.name, rectified=known.is_for_rectified))

    assert len(statement(scaled, known.numbers)) <= 6
    if known.comment == "#" and not known.file_name.endswith(".zip"):
        assert len(re.findall(r"^# ", content, re.MULTILINE)) <= 6


def test_the_covariance_of_a_raw_pose_grows_by_what_no_pose_replaces_over_the_field(scaled):
    raw = for_raw(scaled).calibration
    grown = raw.covariance - scaled.calibration.covariance
    assert np.linalg.eigvalsh(grown).min() > -1e-12
    assert np.trace(grown) > 0

    reported = np.array([pair.point_radar_m for pair in raw.pairs if pair.inlier])
    left_px = raw.reproject(reported) - scaled.calibration.reproject(reported)
    squared = np.einsum("ni,nij,nj->n", left_px, np.linalg.inv(raw.pixel_covariance(reported)), left_px)
    assert 0.5 < squared.mean() < 2.0  # degrees of freedom


def test_a_calibration_without_corrections_or_pairs_is_exported_as_it_is(scaled):
    bare = replace(scaled, calibration=replace(scaled.calibration, pairs=()))
    exact = replace(scaled, calibration=replace(scaled.calibration, radar_errors=RadarErrors()))

    for file in (bare, exact):
        written = export(file, "opencv")
        assert len(written.notes) > len(export(file, "opencv", returns="corrected").notes)
        assert not read_any(written.data).for_raw
    assert export(exact, "opencv", returns="raw").content == export(exact, "opencv").content
    with pytest.raises(InputError, match="solved from the pairs"):
        export(bare, "opencv", returns="raw")
    with pytest.raises(InputError, match="omit --for"):
        export(scaled, "json", returns="raw")


def test_poses_that_hardly_differ_are_no_choice(scaled):
    wide = replace(scaled.calibration, covariance=scaled.calibration.covariance * 1e6)
    assert other_pose(replace(scaled, calibration=wide)) is None
