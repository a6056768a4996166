"""The review: influence and leave-one-out distances, why a pair uses its return, and two solutions compared."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.calibration import calibrate_pairs, preview_pairs
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.check.report import check
from calib_core.interchange.format import imported
from calib_core.measurements import ChosenReturn, TimeNs
from calib_core.results import Calibration
from cocalib.session.applying import History, advance
from cocalib.session.events import ClickPlaced, Solved
from cocalib.session.state import RecordingFacts
from cocalib.view.review import compared, pair_review, previous_calibration, review_of, solution_of
from cocalib.view.wording import sentence


@pytest.fixture(scope="module")
def drawn() -> SimulatedPairs:
    return simulate_pairs(12, rng=np.random.default_rng(11), outlier_share=0.1, decoys=2)


@pytest.fixture(scope="module")
def solved(drawn: SimulatedPairs) -> Calibration:
    return solve(drawn)


def solve(drawn: SimulatedPairs, excluded: frozenset[str] = frozenset()) -> Calibration:
    return calibrate_pairs(drawn.pairs, drawn.camera, excluded=excluded).unwrap()


def test_influence_orders_the_pairs_as_leaving_each_out_does(drawn, solved):
    inliers = [pair for pair in solved.pairs if pair.inlier]
    information = np.linalg.inv(solved.covariance)
    moved = []
    for pair in inliers:
        without = preview_pairs([other for other in drawn.pairs if other.id != pair.id], drawn.camera)
        error = without.camera_from_radar.error_from(solved.camera_from_radar)
        moved.append(float(np.sqrt(error @ information @ error)))
    stated = np.array([pair.influence for pair in inliers])
    ranks = [np.argsort(np.argsort(values)) for values in (stated, moved)]

    assert np.corrcoef(*ranks)[0, 1] > 0.7
    assert int(np.argmax(stated)) in np.argsort(moved)[-3:]


def test_held_out_distances_give_the_held_out_metric(solved):
    held_out_px = {row.id: row.held_out_px for row in review_of(solved, 3).rows}
    agreeing = [held_out_px[pair.id] for pair in solved.pairs if pair.inlier]
    mean_px = np.mean([value for value in agreeing if value is not None])
    assert mean_px == pytest.approx(solved.metrics.held_out_aed_px, abs=0.01)


def test_without_noise_model_nothing_is_expected(solved):
    unknown = np.full((2, 2), np.nan)
    pairs = tuple(replace(pair, expected_covariance_px2=unknown) for pair in solved.pairs)
    review = review_of(replace(solved, pairs=pairs), 3)

    assert "%" not in str(review.words)
    assert review_of(None, -1).rows == ()


def test_a_pair_says_which_of_its_candidates_it_uses(solved):
    for pair in solved.pairs:
        told = pair_review(solved, pair.id)
        assert f"{np.linalg.norm(pair.point_radar_m):.2f} m" in str(told.why)
    assert "held_out" in {fact.key for fact in told.facts}


def test_a_pair_whose_return_the_pose_picked_against_the_radar_s_own_score_says_so(solved):
    told = [
        str(pair_review(solved, pair.id).why)
        for pair in solved.pairs
        if pair.inlier and pair.measured is not None and pair.candidate != 0
    ]

    assert told
    assert all("radar alone prefers" in why for why in told)


def test_a_calibration_compared_with_itself_differs_by_nothing(solved):
    both = compared(4, solution_of("now", solved), solution_of("again", solved))

    assert [row.text.split()[0] for row in both.rows[:5]] == ["0"] * 5
    assert "agree: chi2 0 <= " in both.verdict
    assert all(mark.a_px == mark.b_px for mark in both.marks)


def test_the_page_and_the_check_command_state_the_same_figures(drawn, solved):
    other = solve(drawn, frozenset({solved.pairs[0].id}))
    both = compared(4, solution_of("now", solved), solution_of("without", other))
    printed = check(imported(CalibrationFile(other)), against=imported(CalibrationFile(solved))).lines()

    for row in both.rows:
        assert f"compared with the other: {row.label}: {row.text}" in printed


def test_a_difference_is_judged_as_the_check_command_judges_it(solved):
    error = np.array([0.0, 0.0, 0.0, 0.0, 5.0 * np.sqrt(solved.covariance[4, 4]) + 0.05, 0.0])
    far = replace(solved, camera_from_radar=solved.camera_from_radar.perturbed(error))
    vague = replace(far, covariance=solved.covariance * 1e4)
    silent = replace(far, covariance=np.full((6, 6), np.nan))

    for other, agree in ((far, False), (vague, True), (silent, False)):
        both = compared(4, solution_of("a", solved), solution_of("b", other))
        report = check(imported(CalibrationFile(other)), against=imported(CalibrationFile(solved)))
        assert report.judgement.agree == agree
        assert both.verdict == sentence(f"the two {'agree' if agree else 'differ'}: {report.judgement.text}")


def test_a_solution_without_pairs_draws_those_of_the_other(solved):
    error = np.array([0.0, 0.0, 0.0, 0.0, 0.02, 0.0])
    from_file = replace(solved, camera_from_radar=solved.camera_from_radar.perturbed(error), pairs=())
    both = compared(4, solution_of("now", solved), solution_of("file", from_file))

    assert {mark.id for mark in both.marks} == {pair.id for pair in solved.pairs}
    assert any(mark.a_px != mark.b_px for mark in both.marks)


def test_the_answer_before_the_last_change_is_found(solved):
    facts = RecordingFacts("drive", 10**9 * np.arange(1, 50), width_px=1920, height_px=1080)
    earlier = replace(solved)
    history = advance(History(), ClickPlaced(TimeNs(10**9), (10.0, 20.0), "clicked"), facts)
    history = advance(history, Solved(history.present.revision, earlier), facts)
    assert previous_calibration(history) is None
    history = advance(history, ClickPlaced(TimeNs(2 * 10**9), (10.0, 20.0), "clicked"), facts)
    history = advance(history, Solved(history.present.revision, solved), facts)

    assert previous_calibration(history) is earlier


def test_a_return_chosen_by_hand_is_told(solved):
    pair = next(pair for pair in solved.pairs if pair.inlier and pair.measured is not None and pair.candidate == 0)
    first, *rest = pair.measured.candidates
    chosen = ChosenReturn(tuple(first.position_radar_m.tolist()))
    by_hand = replace(pair, measured=replace(pair.measured, candidates=(first,), set_aside=tuple(rest), chosen=chosen))
    told = pair_review(replace(solved, pairs=(by_hand,)), pair.id)

    assert "chosen by hand" in str(told.why)
