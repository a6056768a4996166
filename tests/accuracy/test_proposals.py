"""A slice of the benchmark of proposals: ten small recordings."""

import numpy as np
import pytest

from benchmarks.accuracy.rows import Figures
from benchmarks.proposing.cases import case_of
from benchmarks.proposing.clicking import after_one_click
from benchmarks.proposing.left_alone import automatic_figures
from benchmarks.proposing.pixels import placement_figures, proposal_figures
from benchmarks.proposing.small import draw_small
from benchmarks.proposing.tables import limit_95, summed
from calib_core.options import CalibrationOptions
from calib_core.proposing import dwell_views, proposals_of

SEEDS = (540, 541, 542, 546, 547, 548, 549, 552, 553, 554)


@pytest.fixture(scope="module")
def figures() -> list[Figures]:
    found = []
    for drawn in map(draw_small, SEEDS):
        views = dwell_views(drawn.placements, drawn.frames, drawn.recording.camera)
        first = proposals_of(views, drawn.recording.camera, CalibrationOptions())
        after = after_one_click(first, views, drawn)
        rest, clicked = ((), []) if after is None else (after.proposals.ranked, [after.placement])
        found.append(
            placement_figures(drawn)
            | proposal_figures("without", first.ranked, drawn)
            | proposal_figures("after", rest, drawn, clicked=clicked)
            | automatic_figures(first, views, drawn)
        )
    return found


def test_the_radar_shows_the_placements(figures):
    assert summed(figures, "found") >= 0.9 * summed(figures, "placements")


def test_most_proposals_lie_on_the_reflector_and_more_after_one_click(figures):
    placements = summed(figures, "placements")
    assert summed(figures, "without nowhere") <= 0.1 * summed(figures, "without proposed")
    assert summed(figures, "after nowhere") <= 0.1 * summed(figures, "after proposed")
    assert summed(figures, "without right") >= 0.5 * placements
    assert summed(figures, "after right") >= 0.6 * placements


def test_nothing_is_confidently_wrong(figures):
    assert summed(figures, "auto far") == 0
    assert summed(figures, "auto wrong clicks") <= 0.1 * summed(figures, "auto clicks")


def test_any_24_seeds_have_every_scene_with_both_radars_and_all_clutter():
    options = [case_of(seed).options for seed in range(601, 625)]
    assert len({(one.scene, one.radar, one.clutter) for one in options}) == 24
    traits = {trait for seed in range(601, 641) for trait in case_of(seed).traits}
    assert {"light changes", "passers-by", "two reflectors", "tripod"} <= traits


def test_no_failure_in_a_hundred_leaves_three_percent():
    assert "at most 3 %" in limit_95(0, 100)
    assert "at most 1e+02 %" in limit_95(2, 2)


def test_the_same_seed_gives_the_same_case_and_images():
    one, other = draw_small(541), draw_small(541)
    assert one.case == other.case
    np.testing.assert_array_equal(one.frames.image(5), other.frames.image(5))
