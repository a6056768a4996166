"""The adversarial table and its neighbours: what counts as silently wrong, and that every row can be drawn and solved."""

import re

import numpy as np
import pytest
from scipy.special import bdtr, fdtri

from benchmarks.accuracy.defects.adversarial import ALL, highest_share, measure_adversary, silent
from benchmarks.accuracy.defects.adversaries import draw_flat
from benchmarks.accuracy.defects.crying_wolf import measure_apart
from benchmarks.accuracy.defects.flat_radars import measure_flat
from benchmarks.accuracy.defects.handedness import Hand, measure_hand
from benchmarks.accuracy.defects.shared_errors import Shared, draw_shared, measure_shared
from benchmarks.accuracy.defects.two_reflectors import measure_returns
from benchmarks.accuracy.outcomes import (
    codes_in,
    misleading,
    outcome_figures,
    quantile_999,
    silently_wrong,
    solved_or_refused,
)
from benchmarks.accuracy.rows import Figures
from benchmarks.simulated_pairs import SystematicErrors
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.measurements import Unsolvable

_SLOW = {"heavy-aisle"}
_WITHOUT_POSE = {"degenerate-placements", "no-pose", "too-few-pairs"}


def figures(squared: float, *codes: str) -> Figures:
    return {f"code {code}": 1.0 for code in codes} | {"squared": squared, "quantile": 12.5916, "rotation_rad": 0.01}


def test_an_answer_is_silently_wrong_outside_twice_the_stated_quantile_without_the_rows_warning():
    trials = [figures(44.0), figures(46.0), figures(46.0, "other"), figures(46.0, "named")]
    assert silently_wrong(trials, ["named"]).tolist() == [False, True, True, False]
    assert silently_wrong(trials, ["named"], always_wrong=True).tolist() == [True, True, True, False]


def test_an_answer_is_misleading_outside_the_stated_quantile_itself():
    trials = [figures(22.0), figures(23.0), figures(46.0), figures(23.0, "named")]
    assert misleading(trials, ["named"]).tolist() == [False, True, True, False]


def test_input_that_is_refused_is_not_silent():
    def refuse() -> Unsolvable:
        raise InputError("positions in furlongs")

    refused = outcome_figures(solved_or_refused(refuse), RigidTransform.identity())
    assert codes_in(refused) == {"refused"}
    assert silently_wrong([refused], [], always_wrong=True).tolist() == [False]


def test_no_pose_and_no_covariance_are_not_silent():
    none = outcome_figures(Unsolvable.reported("no-pose", "", ""), RigidTransform.identity())
    assert codes_in(none) == {"no-pose"}
    assert silently_wrong([none], [], always_wrong=True).tolist() == [False]
    assert silently_wrong([figures(44.0) | {"squared": None}], []).tolist() == [False]
    assert silently_wrong([figures(float("nan"))], []).tolist() == [True]


@pytest.mark.parametrize("freedom", [8.0, 30.0, 200.0])
def test_the_outer_quantile_follows_from_the_stated_one(freedom):
    stated, outer = (6.0 * fdtri(6.0, freedom, level) for level in (0.95, 0.999))
    assert quantile_999(stated) == pytest.approx(outer, rel=1e-6)
    assert quantile_999(12.591587243743977) == pytest.approx(22.4577, abs=1e-3)


def test_the_upper_limit_is_that_of_the_binomial_distribution():
    assert highest_share(0, 3000) == pytest.approx(0.000998, abs=1e-6)
    assert bdtr(4, 9000, highest_share(4, 9000)) == pytest.approx(0.05)
    assert highest_share(5, 5) == 1.0


@pytest.mark.parametrize("key", sorted(set(ALL) - _SLOW))
def test_every_row_can_be_drawn_and_solved(key):
    measured = measure_adversary(key, 3)
    assert silent(ALL[key], [measured]).shape == (1,)
    assert "rotation_rad" in measured or codes_in(measured)


def test_every_warning_of_a_row_is_described(project_root):
    described = set(
        re.findall(r"^\| `([a-z-]+)` \|", (project_root / "docs" / "warnings.md").read_text(), re.MULTILINE)
    )
    assert {code for row in ALL.values() for code in row.codes} <= described | _WITHOUT_POSE


def test_shared_errors_change_neither_the_rig_nor_the_placements():
    drawn, exact = (draw_shared(Shared("ti", 12, None, errors=errors), 4) for errors in (True, False))
    assert exact.systematic == SystematicErrors() != drawn.systematic
    assert np.array_equal(drawn.points_radar_m, exact.points_radar_m)
    assert np.array_equal(drawn.outlier, exact.outlier)


def test_one_trial_of_every_table_has_its_figures():
    case = Shared("imaging", 12, 0.01)
    assert {"squared", "stated_m", "stated_rad", "position_m"} <= set(measure_shared(case, 1))
    assert measure_flat("imaging", 10, 1)["paper_px"] is not None
    assert codes_in(measure_hand(Hand("imaging", 12, 8.0, "mirrored"), 1))
    assert measure_apart("imaging", 1)["position_m"] is not None


def test_a_flat_radars_placements_are_in_view_whatever_its_tilt():
    tilts = []
    for seed in range(8):
        simulated = draw_flat(np.random.default_rng(seed), 12, noise="ti")
        assert simulated.camera.sees(simulated.camera_from_radar @ simulated.points_radar_m).all()
        assert {pair.candidates[0].position_radar_m[2] for pair in simulated.pairs} == {0.0}
        forward = simulated.rig.radar_from_world.inverse().rotation[:, 0]
        tilts.append(np.rad2deg(np.arcsin(-forward[2])))
    assert np.std(tilts) > 3.0


def test_a_tilt_without_a_placement_in_view_is_drawn_again():
    assert len(draw_flat(np.random.default_rng([2033, 5, 777000]), 25, noise="ti").pairs) == 25


@pytest.mark.slow
def test_returns_of_two_reflectors_are_counted_by_click():
    measured = measure_returns("two-reflectors-close", 0)
    assert measured["clicks"] == 20.0
    assert measured["wrong"] is not None
    assert (measured["wrong_agreeing"] or 0.0) <= measured["wrong"] <= 1.0
