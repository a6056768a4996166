"""Does the truth lie inside the error that good and usable verdicts state? All of it: benchmarks.accuracy --only verdict."""

import numpy as np
import pytest
from scipy.special import bdtrc

from benchmarks.accuracy.verdicts import Verdicts, measure_verdict, share_inside
from benchmarks.sample import SAMPLE_OPTIONS
from calib_core.calibration import calibrate
from calib_core.results.verdict import verdict_on
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import simulate
from cocalib.session.state import Session
from cocalib.view.build import verdict_row

CASES = (
    Verdicts("ti", 20, None, 0.2),
    Verdicts("ti_fine", 12, 0.01),
    Verdicts("imaging", 20, None),
    Verdicts("imaging", 12, 0.01, 0.2),
    Verdicts("ti", 15, None, 0.0, "flat"),
)


def test_nineteen_in_twenty_good_and_usable_calibrations_are_as_near_the_truth_as_they_say():
    trials = [measure_verdict(case, 70_000 + trial) for case in CASES for trial in range(14)]
    inside = share_inside(trials, ("good", "usable"))
    assert len(inside) > 45
    misses = int((~inside).sum())
    assert bdtrc(misses - 1, len(inside), 0.05) > 0.01, "so many misses have a chance below 1 % if 95 % hold"


@pytest.mark.parametrize("options", [SAMPLE_OPTIONS, PRESETS["default"], PRESETS["fine"], PRESETS["paper-d1"]])
def test_right_clicks_in_any_order_show_no_red(options):
    """Neither below the pairs that the verdict needs, nor soon after: no contradiction, and no pair that disagrees."""
    simulated = simulate(options)
    rng = np.random.default_rng(1)
    for _ in range(20):
        order = rng.permutation(len(simulated.clicks))
        for count in (5, 9):
            clicks = [simulated.clicks[i] for i in order[:count]]
            outcome = calibrate(clicks, simulated.scans, simulated.camera, background=simulated.scans).unwrap()
            shown = verdict_row(verdict_on(outcome), Session(clicks=tuple(clicks), outcome=outcome), None)
            assert shown.early or shown.level != "contradictory", str(shown.line)
            assert all(pair.inlier for pair in outcome.pairs)
