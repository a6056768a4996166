"""The errors that all pairs share: each has words, and the largest is named with what would reduce it."""

from dataclasses import replace

import numpy as np
import pytest

from calib_core.camera import Camera
from calib_core.options import CalibrationOptions, CameraPositionPrior, SolvingOptions
from calib_core.results.shared_errors import (
    ERROR_WORDS,
    SystematicErrorResult,
    dominant_errors,
    error_words,
    knowledge_text,
)
from calib_core.systematic_errors import systematic_errors

CAMERA = Camera("pinhole", 1920, 1080, np.array([[1000.0, 0, 960], [0, 1000, 540], [0, 0, 1]]))
COVARIANCE = np.diag([0.03, 0.06, 0.06, 0.004, 0.004, 0.002]) ** 2
AZIMUTH = SystematicErrorResult("azimuth_scale", 0.012, 0.009, 0.02, True, 0.51, 0.05)
DOWN = SystematicErrorResult("click_down_px", 0.5, 5.38, 5.385, False, 0.0, 0.25)
RIGHT = replace(DOWN, name="click_right_px", rotation_share=0.20)


@pytest.mark.parametrize("taped", [True, False])
@pytest.mark.parametrize("flat", [True, False])
def test_every_error_of_the_estimate_has_words(flat: bool, taped: bool) -> None:
    position = CameraPositionPrior() if taped else None
    options = CalibrationOptions(solving=SolvingOptions(camera_position=position))
    errors = systematic_errors(options, CAMERA, flat=flat)
    assert {one.name for one in (*errors.estimated, *errors.widening)} <= set(ERROR_WORDS)


def test_the_error_with_most_of_the_variance_is_named_with_its_value_and_a_remedy() -> None:
    (found,) = dominant_errors([AZIMUTH, DOWN], COVARIANCE, measured=False)
    assert found.sentence == (
        "about half of the variance of the position (9 cm) comes from the radar's azimuth scale: +1.20 ± 0.90 %, ± 2 % before "
        "any pair; a tape-measured camera position, or placements at both edges of the picture, would reduce it"
    )
    (found,) = dominant_errors([AZIMUTH], COVARIANCE, measured=True)
    assert "tape" not in found.sentence
    assert dominant_errors([replace(AZIMUTH, position_share=0.3), DOWN], COVARIANCE, measured=False) == ()


def test_errors_along_several_axes_count_together() -> None:
    position, rotation = dominant_errors([AZIMUTH, RIGHT, DOWN], COVARIANCE, measured=False)
    assert (position.position_share, position.rotation_share) == (0.51, 0.0)
    assert (rotation.position_share, rotation.rotation_share) == (0.0, pytest.approx(0.45))
    assert rotation.sentence.startswith(
        "about half of the variance of the rotation (0.34 deg) comes from the principal point"
    )
    assert "± 5.4 px assumed, the pairs do not determine it" in rotation.sentence


def test_the_parameter_of_a_lens_with_a_covariance_is_named() -> None:
    fx = replace(AZIMUTH, name="lens_fx_px", value=-11.0, sigma=30.0, prior_sigma=140.0)
    cx = replace(fx, name="lens_cx_px", position_share=0.2)
    (found,) = dominant_errors([cx, fx], 100.0 * COVARIANCE, measured=False)
    assert (
        "position (90 cm) comes from the lens, as far as its calibration knows it, above all the focal length fx: "
        "-11 ± 30 px, ± 140 px before any pair"
    ) in found.sentence
    assert found.label == "lens, focal length fx -11 ± 30 px"


def test_one_error_behind_both_is_named_once() -> None:
    (found,) = dominant_errors([replace(AZIMUTH, rotation_share=0.95)], COVARIANCE, measured=False)
    assert (
        "(9 cm) and nearly all of that of the rotation (0.34 deg) come from the radar's azimuth scale" in found.sentence
    )


def test_an_error_of_a_later_version_goes_by_its_name() -> None:
    assert error_words("warp_rad").text == "warp_rad"
    assert knowledge_text(replace(AZIMUTH, name="warp_rad")) == "+0.0120 ± 0.0090, ± 0.02 before any pair"
