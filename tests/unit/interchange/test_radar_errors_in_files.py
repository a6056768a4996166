"""The errors that all pairs share are in the file, to the last bit, and the check point is free of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.interchange import (
    FORMATS,
    calibration_text,
    check,
    export,
    read_any,
    read_calibration,
    read_check_pairs,
    write_calibration,
)
from calib_core.radar import RadarErrors
from calib_core.results import Calibration
from calib_core.synthetic import simulate_pairs


@pytest.fixture(scope="module")
def solved() -> Calibration:
    simulated = simulate_pairs(20, rng=np.random.default_rng(1), noise="imaging")
    return calibrate_pairs(simulated.pairs, simulated.camera).unwrap()


def test_the_errors_come_back_to_the_last_bit(solved: Calibration) -> None:
    text = calibration_text(solved)
    read = read_calibration(text).calibration
    assert solved.radar_errors != RadarErrors()
    assert read.radar_errors == solved.radar_errors
    assert read.systematic_errors == solved.systematic_errors
    assert all(one.text for one in read.systematic_errors)
    assert write_calibration(read_calibration(text)) == text


def test_the_file_applies_its_errors_when_it_is_checked(solved: Calibration) -> None:
    text = calibration_text(solved)
    assert check(read_any(text)).ok
    document = json.loads(text)
    del document["radar_errors"]
    assert "pairs-disagree" in [result.code for result in check(read_any(json.dumps(document))).results]


def test_a_check_against_its_own_pairs_gives_its_aed(solved: Calibration) -> None:
    text = calibration_text(solved)
    report = check(read_any(text), pairs=read_check_pairs(text))
    assert f"AED {solved.metrics.aed_px:.3g} px" in str(report)


def test_a_bare_export_is_checked_with_the_errors_that_the_pairs_file_states(solved: Calibration) -> None:
    text = calibration_text(solved)
    bare = read_any(export(read_calibration(text), "tf2").data.decode())
    report = check(bare, pairs=read_check_pairs(text))
    assert f"AED {solved.metrics.aed_px:.3g} px" in str(report)


def test_every_export_with_comments_states_the_errors_and_reads_back(solved: Calibration) -> None:
    file = read_calibration(calibration_text(solved))
    for form in FORMATS:
        if form.comment not in ("#", "<!-- -->") or form.name == "colmap":
            continue
        text = export(file, form.name, rectified=form.is_for_rectified).data.decode()
        assert f"azimuth_scale {solved.radar_errors.azimuth_scale:.6g}" in text, form.name
        if form.reads is not None:
            assert check(read_any(text), camera=solved.camera).ok, form.name


def test_the_plain_transform_takes_the_check_point_to_its_pixel(solved: Calibration) -> None:
    point = json.loads(calibration_text(solved))["check_point"]
    projected = solved.camera.project(solved.camera_from_radar @ np.array([point["radar_m"]]))[0]
    np.testing.assert_allclose(projected, point["pixel_px"], atol=1e-9)


def test_a_file_without_the_keys_has_no_errors_and_stays_without_them(solved: Calibration) -> None:
    document = json.loads(calibration_text(replace(solved, radar_errors=RadarErrors(), systematic_errors=())))
    assert not {"radar_errors", "systematic_errors"} & document.keys()
    assert read_calibration(json.dumps(document)).calibration.radar_errors == RadarErrors()


def test_a_scale_of_zero_is_refused(solved: Calibration) -> None:
    document = json.loads(calibration_text(solved))
    document["radar_errors"]["azimuth_scale"] = -1.0
    with pytest.raises(InputError, match=r"radar_errors\.azimuth_scale"):
        read_calibration(json.dumps(document))
