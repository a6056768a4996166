"""A person clicks one proposal, and the machine proposes again with the look of what was clicked."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.proposing.drawn import Drawn, true_placement
from calib_core.association.placements import Placement
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.proposing import DwellView, Proposals
from cocalib.proposing import proposed_again

__all__ = ["Clicked", "after_one_click"]

_CLICK_SIGMA_PX = 0.7
_STREAM = 17


@dataclass(frozen=True, slots=True, eq=False)
class Clicked:
    """What is known after one click.

    Attributes:
        click: of the person.
        placement: that was clicked.
        proposals: for the other placements.
    """

    click: ReflectorClick
    placement: Placement
    proposals: Proposals


def after_one_click(proposals: Proposals, views: Sequence[DwellView], drawn: Drawn) -> Clicked | None:
    """Click the first proposal in whose frame a reflector stands, and propose again; None if there is none.

    Args:
        proposals: with nothing confirmed.
        views: of all placements.
        drawn: with the truth, which the person sees.
    """
    camera = drawn.recording.camera
    for one in proposals.ranked:
        truth = true_placement(one.placement, drawn.recording)
        if truth is None:
            continue
        rng = np.random.default_rng([drawn.case.options.seed, _STREAM])
        u_px, v_px = (truth.pixel_px + _CLICK_SIGMA_PX * rng.standard_normal(2)).tolist()
        click = ReflectorClick(one.image_time, "c1", u_px, v_px)
        _, again = proposed_again(views, drawn.frames, camera, CalibrationOptions(), confirmed=(click,))
        return Clicked(click, one.placement, again)
    return None
