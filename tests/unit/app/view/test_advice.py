"""Where to put the reflector next, as shown on the page."""

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.results.actions import ReduceError
from calib_core.results.verdict import verdict_on
from cocalib.view.build import advice_for
from cocalib.view.model import Advice


def solved(count: int, options: CalibrationOptions | None = None) -> Calibration:
    simulated = simulate_pairs(count, rng=np.random.default_rng(3), noise="ti")
    return calibrate_pairs(simulated.pairs, simulated.camera, options).unwrap()


def advised(calibration: Calibration) -> Advice | None:
    return advice_for(calibration, verdict_on(calibration))


def test_the_advised_place_is_in_the_image_and_in_the_text_with_its_side_as_the_radar_sees_it():
    calibration = solved(6)
    advice = advised(calibration)
    assert not advice.best.may_stop
    assert calibration.camera.in_image(advice.best.pixel_px[None])[0]
    x_m, y_m, _ = advice.best.position_radar_m
    assert advice.range_m == pytest.approx(np.linalg.norm(advice.best.position_radar_m))
    side = "straight ahead" if abs(y_m) < 0.1 * x_m else ("left" if y_m > 0 else "right")
    assert [words for words in (f"{x_m:.1f} m ahead", side) if words not in advice.words] == []


@pytest.mark.slow
def test_many_placements_are_enough():
    assert advised(solved(400)).best.may_stop


def test_the_advice_does_not_repeat_the_action_of_the_verdict():
    calibration = solved(30)
    advice, verdict = advised(calibration), verdict_on(calibration)
    assert advice is not None
    assert isinstance(verdict.action, ReduceError)
    assert advice.words.startswith("One more placement ")


def test_the_papers_method_gives_no_advice_since_it_has_no_covariance():
    assert advised(solved(30, CalibrationOptions(method="paper"))) is None
