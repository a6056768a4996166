"""Does the truth lie inside the error that good and usable verdicts state? All of it: benchmarks.accuracy --only verdict."""

from scipy.special import bdtrc

from benchmarks.accuracy.verdicts import Verdicts, measure_verdict, share_inside

CASES = (
    Verdicts("ti", 20, None, 0.2),
    Verdicts("ti_fine", 12, 0.01),
    Verdicts("imaging", 20, None),
    Verdicts("imaging", 12, 0.01, 0.2),
    Verdicts("ti", 15, None, 0.0, "flat"),
)


def test_nineteen_in_twenty_good_and_usable_calibrations_are_as_near_the_truth_as_they_say() -> None:
    trials = [measure_verdict(case, 70_000 + trial) for case in CASES for trial in range(14)]
    inside = share_inside(trials, ("good", "usable"))
    assert len(inside) > 45
    misses = int((~inside).sum())
    assert bdtrc(misses - 1, len(inside), 0.05) > 0.01, "so many misses have a chance below 1 % if 95 % hold"
