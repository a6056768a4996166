"""What of the covariance rests on stated sigmas, in a calibration's file."""

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.interchange import calibration_text, read_calibration
from calib_core.interchange.own.calibration_json import write_calibration
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results import Calibration
from calib_core.synthetic import simulate_pairs


@cache
def calibration(*, with_tape: bool = True, method: str = "default") -> Calibration:
    made = simulate_pairs(12, rng=np.random.default_rng(2), noise="imaging")
    forward, left, up = made.camera_from_radar.inverse().translation_m.tolist()
    tape = CameraPositionPrior((forward, left, up), 0.02) if with_tape else None
    options = CalibrationOptions(method=method, solving=SolvingOptions(camera_position=tape))  # type: ignore[arg-type]
    return calibrate_pairs(made.pairs, made.camera, options).unwrap()


def test_they_are_read_as_they_were_written_and_written_again_as_the_same_bytes() -> None:
    text = calibration_text(calibration())
    file = read_calibration(text)
    wrote, read = calibration().covariance_parts, file.calibration.covariance_parts
    assert wrote is not None
    assert read is not None
    np.testing.assert_allclose(read.systematic, wrote.systematic, rtol=1e-12)
    np.testing.assert_allclose(read.camera_position, wrote.camera_position, rtol=1e-12)
    assert write_calibration(file) == text


def test_without_a_tape_its_part_is_not_written_and_of_other_methods_there_are_none() -> None:
    assert set(json.loads(calibration_text(calibration(with_tape=False)))["covariance_parts"]) == {"systematic"}
    papers = calibration_text(calibration(method="paper"))
    assert "covariance_parts" not in json.loads(papers)
    assert read_calibration(papers).calibration.covariance_parts is None


@pytest.mark.parametrize("part", ["systematic", "camera_position"])
def test_a_part_that_is_no_covariance_is_refused_by_its_name(part: str) -> None:
    document: dict[str, Any] = json.loads(calibration_text(calibration()))
    document["covariance_parts"][part][2][2] = -1.0
    with pytest.raises(
        InputError, match=rf"file.json: covariance_parts.{part}: a variance on the diagonal is negative"
    ):
        read_calibration(json.dumps(document), source="file.json")
