"""A prior of calibrations that are better or worse than they state still contains the next vehicle."""

import numpy as np
import pytest

from benchmarks.fleet.strange_fleets import CASES, Case, covered


@pytest.mark.parametrize(
    "case", [one for one in CASES if "tape" in one.text or one.text == "as stated"], ids=lambda one: one.text
)
def test_a_tape_that_is_better_or_worse_than_stated_does_not_make_the_prior_too_narrow(case: Case) -> None:
    shares, cm, _ = covered(case, 14, fleets=6)
    assert np.mean(shares) >= 0.9
    largest_m = np.hypot(0.005, max(case.tape_true_m, case.tape_m or 0.0))
    assert cm < 2.0 * np.sqrt(3.0) * 100.0 * largest_m  # nor say nothing


def test_errors_that_are_larger_than_stated_make_it_wider() -> None:
    (larger,) = (one for one in CASES if "three times" in one.text)
    shares, _, deg = covered(larger, 14, fleets=3)
    assert min(shares) >= 0.95
    assert deg > covered(CASES[0], 14, fleets=3)[2]
