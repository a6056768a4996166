"""Where to put the reflector next, as shown on the page."""

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.results.verdict import verdict_on
from calib_core.synthetic import simulate_pairs
from cocalib.view.build import advice_for
from cocalib.view.model import Advice


def solved(count: int, options: CalibrationOptions | None = None) -> Calibration:
    simulated = simulate_pairs(count, rng=np.random.default_rng(3), noise="ti")
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, options)
    assert isinstance(outcome, Calibration)
    return outcome


def advised(calibration: Calibration) -> Advice | None:
    return advice_for(calibration, verdict_on(calibration))


def test_the_advised_place_is_in_the_picture_and_in_the_text():
    calibration = solved(6)
    advice = advised(calibration)
    assert not advice.best.may_stop
    assert calibration.camera.in_image(advice.best.pixel_px[None])[0]
    assert advice.range_m == pytest.approx(np.linalg.norm(advice.best.position_radar_m))
    assert f"{advice.best.position_radar_m[0]:.1f} m ahead" in advice.words
    assert "would reduce the pose uncertainty by" in advice.words


def test_the_side_is_named_as_the_radar_sees_it():
    advice = advised(solved(6))
    y = advice.best.position_radar_m[1]
    expected = "straight ahead" if abs(y) < 0.1 * advice.best.position_radar_m[0] else ("left" if y > 0 else "right")
    assert expected in advice.words


def test_many_placements_are_enough():
    advice = advised(solved(400))
    assert advice.best.may_stop
    assert "No further placement would" in advice.words


def test_the_advice_does_not_repeat_the_action_of_the_verdict():
    calibration = solved(30)
    advice, verdict = advised(calibration), verdict_on(calibration)
    assert advice is not None
    assert "A tape-measured camera position" in verdict.action
    assert advice.words.startswith("A placement ")


def test_the_papers_method_gives_no_advice_since_it_has_no_covariance():
    assert advised(solved(30, CalibrationOptions(method="paper"))) is None
