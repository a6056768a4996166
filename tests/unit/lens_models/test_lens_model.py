"""A lens model that contradicts itself is refused where it is defined."""

from dataclasses import replace

import pytest

from calib_core.lens_models.brown_conrady import PLUMB_BOB
from calib_core.lens_models.lens_model import TypicalLens


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"counts": ()}, "plumb_bob: counts must ascend"),
        ({"counts": (5, 4)}, "counts must ascend"),
        ({"counts": (-1, 5)}, "counts must ascend"),
        ({"counts": (4,)}, "5 coefficients are named, but counts ends at 4"),
        ({"typical": TypicalLens((0.1,))}, "the typical lens has 1 coefficient"),
    ],
)
def test_a_lens_model_that_contradicts_itself_is_refused(changes, reason) -> None:
    with pytest.raises(ValueError, match=reason):
        replace(PLUMB_BOB, **changes)
