"""The median of a few pictures against NumPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from calib_core.proposing.still_pictures import stack_median


@given(st.integers(1, 14), st.integers(0, 2**32 - 1), st.sampled_from([np.uint8, np.uint16]))
def test_the_median_is_numpys(count: int, seed: int, kind: type) -> None:
    stack = np.random.default_rng(seed).integers(0, 255, (count, 4, 5, 3)).astype(kind)
    assert np.abs(stack_median(list(stack)) - np.median(stack, axis=0)).max() <= 0.5
