"""One recording measured: what is proposed without a click, and the pose that follows from it."""

from functools import partial
from pathlib import Path

import cv2

from benchmarks.accuracy.rows import Figures
from benchmarks.proposing.cases import case_of
from benchmarks.proposing.clicking import Clicked, after_one_click
from benchmarks.proposing.drawn import Drawn, draw, drawn_from
from benchmarks.proposing.left_alone import automatic_figures
from benchmarks.proposing.pixels import placement_figures, proposal_figures
from benchmarks.proposing.solving import accepted_clicks, pose_figures
from benchmarks.proposing.square_reflector import with_square_reflectors
from calib_core.errors import OptionError
from calib_core.options import CalibrationOptions
from calib_core.proposing import dwell_views, proposals_of
from calib_core.synthetic.recording import simulate

__all__ = ["measure_case", "measure_drawn", "measure_square"]


def measure_case(folder: Path, seed: int) -> Figures:
    """Draw the case of a seed and measure it; no figures if its placements do not fit into the scene.

    Args:
        folder: where frames are kept.
        seed: of the case.
    """
    cv2.setNumThreads(1)
    try:
        drawn = draw(case_of(seed), folder)
    except OptionError:
        return {}
    return measure_drawn(drawn)


def measure_square(folder: Path, seed: int) -> Figures:
    """Measure the case of a seed with the reflector of square sheets, which nothing was developed on.

    Args:
        folder: where frames are kept.
        seed: of the case.
    """
    cv2.setNumThreads(1)
    case = case_of(seed)
    return measure_drawn(drawn_from(with_square_reflectors(simulate(case.options)), case, folder))


def measure_drawn(drawn: Drawn) -> Figures:
    """Propose without a click and after one, and solve in every way."""
    camera, options = drawn.recording.camera, CalibrationOptions()
    views = dwell_views(drawn.placements, drawn.frames, camera)
    first = proposals_of(views, camera, options)
    pose = partial(pose_figures, drawn=drawn)
    clicked = after_one_click(first, views, drawn)
    return (
        placement_figures(drawn)
        | (
            {}
            if first.agreement is None
            else {"agreement": first.agreement.share, "rival": first.agreement.rival_share}
        )
        | proposal_figures("without", first.ranked, drawn)
        | pose("true", drawn.recording.clicks)
        | pose("without", accepted_clicks(first.ranked, drawn))
        | automatic_figures(first, views, drawn)
        | ({} if clicked is None else _after(clicked, drawn))
    )


def _after(clicked: Clicked, drawn: Drawn) -> Figures:
    """Return the figures after one click; a click in a dwell of two reflectors may leave one of them to be proposed."""
    rest = clicked.proposals.ranked
    clicks = (clicked.click, *accepted_clicks(rest, drawn))
    counted = proposal_figures("after", rest, drawn, clicked=(clicked.placement,))
    return counted | pose_figures("after", clicks, drawn)
