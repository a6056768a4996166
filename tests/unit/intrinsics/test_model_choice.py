"""The lens model that is chosen is the one the views were made with, unless a simpler one predicts as well."""

import pytest

from calib_core.intrinsics import CalibratedLens, calibrate_lens
from tests.unit.intrinsics.corner_draws import CAMERAS, drawn_views, search_of


@pytest.mark.parametrize("model", CAMERAS)
def test_the_true_model_is_chosen_with_a_reason(model: str) -> None:
    lens = calibrate_lens(search_of(drawn_views(CAMERAS[model], 16, 5)))
    assert isinstance(lens, CalibratedLens), lens
    assert lens.camera.model == model
    assert lens.choice.startswith(model)
    assert [trial.model for trial in lens.trials] == ["pinhole", "plumb_bob", "equidistant", "rational_polynomial"]
    (chosen,) = [trial for trial in lens.trials if trial.model == model]
    assert (chosen.worse_by, chosen.standard_error, chosen.fault) == (0.0, 0.0, "")
    assert all(trial.held_out_rms_px > trial.rms_px for trial in lens.trials if not trial.fault)
    assert lens.left_out == ()
