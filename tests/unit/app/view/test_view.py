"""What the screen shows for a session: texts, figures, rows, ellipses."""

import re
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.association.clustering import candidate_at
from calib_core.calibration import calibrate_pairs
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import ChosenReturn, Pair, Stamp, TimeNs, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration, DataWarning, Metrics, PairResult
from cocalib.session.applying import History, advance
from cocalib.session.events import ClickExcluded, ClickMoved, ClickPlaced, Solved, Undo
from cocalib.session.state import RecordingFacts
from cocalib.view.build import summary_lines, view
from cocalib.view.candidates import click_candidates
from cocalib.view.click_rows import ellipses_of, reprojections
from cocalib.view.figures import OPTICAL_FROM_BODY, mounting_of, pose_figures
from cocalib.view.model import View
from cocalib.view.wording import plain, sentence, with_sigma

FACTS = RecordingFacts("drive", 1_700_000_000_123_456_789 + 100_000_000 * np.arange(50), width_px=640, height_px=480)
TIMES = [TimeNs(int(time)) for time in FACTS.image_times]
CAMERA = Camera("pinhole", 640, 480, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]))
LEVEL = RigidTransform(OPTICAL_FROM_BODY, -OPTICAL_FROM_BODY @ np.array([0.05, -0.10, 0.30]))
NAN = float("nan")


def pair(name: str, *, inlier: bool = True, **more) -> PairResult:
    number = int(name[1:])
    at = {
        "pixel_px": [10.0 * number, 20.0],
        "projected_px": [10.0 * number + 3.0, 24.0],
        "point_radar_m": [3.0, 4.0, 0.0],
        "expected_covariance_px2": np.diag([4.0, 9.0]),
        "outlier_probability": 0.01 if inlier else 0.97,
    }
    return PairResult(name, inlier=inlier, **(at | more))


def calibration(*pairs: PairResult, unpaired: tuple[Unpaired, ...] = (), warnings=(), **more) -> Calibration:
    values = {
        "camera_from_radar": LEVEL,
        "covariance": np.diag([1e-4, 4e-4, 9e-4, 1e-6, 4e-6, 9e-6]),
        "metrics": Metrics(12.4321, 3.0, 13.0, n=sum(row.inlier for row in pairs), held_out_aed_px=14.0),
        "options": CalibrationOptions(),
    }
    return Calibration(camera=CAMERA, pairs=pairs, unpaired=unpaired, warnings=warnings, **(values | more))


def clicked(count: int, *steps) -> History:
    history = History()
    for number in range(1, count + 1):
        history = advance(history, ClickPlaced(TIMES[number], (10.0 * number, 20.0), "clicked"), FACTS)
    for step in steps:
        history = advance(history, step, FACTS)
    return history


def shown(count: int, outcome: Calibration | Unsolvable, *steps) -> View:
    history = clicked(count)
    history = advance(history, Solved(history.present.revision, outcome), FACTS)
    for step in steps:
        history = advance(history, step, FACTS)
    return view(history, FACTS)


FIVE = tuple(pair(f"c{number}") for number in range(1, 6))


def test_before_the_first_click_there_is_nothing():
    seen = view(History(), FACTS)
    assert (seen.stage, seen.solving, seen.has_calibration, seen.solved_revision) == ("collecting", False, False, -1)
    assert (seen.verdict.level, seen.status) == ("nothing", "")


def agreeing(seen: View) -> tuple[str, str]:
    """Return the verdict's level, and how many clicks agree of how many."""
    return seen.verdict.level, next(one.value for one in seen.metrics if one.key == "inliers")


@pytest.mark.parametrize(
    ("more", "agree"), [({}, "5 of 5"), ({"inlier": False}, "4 of 5"), ({"excluded": True}, "4 of 4")]
)
def test_a_solved_session_says_how_many_clicks_agree(more, agree):
    assert agreeing(shown(5, calibration(*FIVE[:4], pair("c5", **more)))) == ("coarse", agree)


def measured_at(name: str, *positions: tuple[float, float, float], **more) -> PairResult:
    """Return a pair that has the first of some returns."""
    candidates = tuple(candidate_at(np.array(position), NoiseOptions()) for position in positions)
    plain_pair = pair(name)
    kept = Pair(name, plain_pair.pixel_px, candidates)
    return replace(plain_pair, point_radar_m=np.array(positions[0]), measured=kept, **more)


NEAR_M, BEHIND_M = (6.0, 0.5, 0.0), (7.2, 0.6, 0.0)
ASKING = measured_at("c5", NEAR_M, BEHIND_M, inlier=False, outlier_probability=0.5, rival=1)


def test_a_click_that_two_returns_fit_asks_for_one_of_them():
    outcome = calibration(*FIVE[:4], ASKING)
    assert not any(str(line).startswith("disagrees") for line in summary_lines(outcome))
    offered = click_candidates(advance(clicked(5), Solved(5, outcome), FACTS).present, ASKING.measured)
    assert [offered.rows[i].position_m for i in offered.asked] == [NEAR_M, BEHIND_M], (
        "both answers, the one in use first"
    )
    assert [re.findall(r"[\d.]+ m", offered.rows[i].answer) for i in offered.asked] == [["6.0 m"], ["7.2 m"]]
    chosen = replace(ASKING.measured, chosen=ChosenReturn(NEAR_M))
    assert click_candidates(advance(clicked(5), Solved(5, outcome), FACTS).present, chosen).asked == (), "answered once"


def test_a_return_that_the_camera_does_not_see_is_not_offered_unless_it_is_in_use():
    ahead_m, aside_m = (6.0, 0.5, 0.0), (1.0, 5.0, 0.0)
    for returns_m, offered_m in (
        ((ahead_m, (7.0, 0.5, 0.0), aside_m), [ahead_m, (7.0, 0.5, 0.0)]),
        ((aside_m, ahead_m), [aside_m, ahead_m]),
    ):
        outcome = calibration(*FIVE[:4], measured_at("c5", *returns_m))
        session = advance(clicked(5), Solved(5, outcome), FACTS).present
        assert [row.position_m for row in click_candidates(session, outcome.pairs[4].measured).rows] == offered_m


UNSEEN = Unsolvable.reported(
    "too-few-pairs",
    "3 of at least 4 pairs",
    "click more",
    tuple(
        Unpaired.reported(name, "no-scan", "the nearest radar scan is 9.00 s away", "check that both clocks agree")
        for name in ("c1", "c3")
    ),
)
EVERY_STATE = calibration(
    pair("c1"),
    pair("c2", inlier=False),
    pair("c3", inlier=False, excluded=True),
    unpaired=(Unpaired.reported("c4", "no-scan", "the radar has no scan here", "click where both recordings overlap"),),
)


@pytest.mark.parametrize(
    ("count", "outcome", "stage"),
    [
        (
            5,
            Unsolvable.reported("no-pose", "only 3 of 5 pairs agree on any pose", "spread the placements"),
            "unsolvable",
        ),
        (1, Unsolvable.reported("no-camera", "the intrinsics are missing", "give --camera"), "unsolvable"),
        (2, Unsolvable.reported("too-few-pairs", "2 of at least 4 pairs", "click more"), "collecting"),
        (5, UNSEEN, "collecting"),
    ],
)
def test_what_more_clicks_cannot_fix_is_a_failure_and_too_few_are_none(count, outcome, stage):
    seen = shown(count, outcome)
    assert (seen.stage, seen.has_calibration) == (stage, False)


def test_each_click_has_its_state():
    assert [row.state for row in shown(5, UNSEEN).clicks] == ["unpaired", "pending", "unpaired", "pending", "pending"]
    seen = shown(5, EVERY_STATE, ClickExcluded("c3", True))
    assert [row.state for row in seen.clicks] == ["inlier", "outlier", "excluded", "unpaired", "pending"]
    included = shown(5, EVERY_STATE, ClickExcluded("c3", True), ClickExcluded("c3", False))
    assert included.clicks[2].state == "pending"


def test_figures_stay_while_a_newer_answer_is_computed():
    seen = shown(5, calibration(*FIVE), ClickMoved("c1", (13.0, 22.0)))
    assert (seen.stage, seen.solving, seen.has_calibration) == ("solving", True, True)
    assert seen.solved_revision == seen.revision - 1
    assert all(one.level != "none" for one in seen.metrics)
    assert seen.clicks[0].residual_px == pytest.approx(2.0), "it follows a moved click at once"


def test_a_preview_is_shown_as_being_checked():
    preview = calibration(*FIVE, checking=True)
    for outcome in (preview, replace(preview, checking=False)):
        seen = shown(5, outcome)
        assert (seen.checking, seen.solving) == (outcome.checking, outcome.checking)
        assert agreeing(seen)[1] == "5 of 5"


def test_the_view_says_what_can_be_undone_and_redone():
    seen = view(clicked(2, Undo()), FACTS)
    assert (seen.can_undo, seen.can_redo) == (True, True)
    assert not view(clicked(1), FACTS).can_redo


def test_a_row_says_where_the_click_is_before_any_answer():
    (row,) = view(clicked(1), FACTS).clicks
    assert (row.id, row.frame, row.image_time, row.u_px, row.v_px) == ("c1", 1, Stamp.of(TIMES[1]), 10.0, 20.0)
    assert (row.state, row.projected_px, row.residual_px, row.note) == ("pending", None, None, "")


def test_a_row_of_a_solved_pair_carries_residual_position_and_ellipse():
    row = shown(5, calibration(*FIVE)).clicks[0]
    assert (row.state, row.projected_px, row.residual_px) == ("inlier", (13.0, 24.0), 5.0)
    assert row.range_m == pytest.approx(5.0)
    assert row.azimuth_deg == pytest.approx(53.1301, abs=1e-4)
    assert row.elevation_deg == pytest.approx(0.0)
    assert row.ellipse.semi_major_px == pytest.approx(3.0 * 2.447747, rel=0.005)
    assert row.outlier_probability == pytest.approx(0.01)


def test_a_radar_position_behind_the_camera_has_no_reprojection():
    row = shown(1, calibration(pair("c1", inlier=False, projected_px=[NAN, NAN], outlier_probability=NAN))).clicks[0]
    assert (row.projected_px, row.residual_px, row.outlier_probability) == (None, None, None)
    assert "behind the camera" in row.note


def test_every_figure_has_a_value_and_a_sentence_that_explains_it():
    seen = shown(5, calibration(*FIVE))
    figures = {figure.key: figure for figure in (*seen.metrics, *seen.pose)}
    assert figures["aed"].value == "12.4"
    assert figures["inliers"].value == "5 of 5"
    assert figures["camera_x"].value == "5.0 ± 3.0"
    assert list(figures) == [
        *("aed", "held_out_aed", "cdsd", "rms", "inliers"),
        *("camera_x", "camera_y", "camera_z", "roll", "pitch", "yaw"),
    ]
    assert all(figure.hint.endswith(".") and len(figure.hint) > 20 for figure in figures.values())


def test_smooth_angle_errors_of_the_radar_are_a_figure_if_correcting_them_helps():
    simulated = simulate_pairs(30, rng=np.random.default_rng(7), noise=NoiseOptions(2.0, 0.008, 0.1, 0.25))
    solved = calibrate_pairs(simulated.pairs, simulated.camera).unwrap()
    assert "radar_angles" not in {figure.key for figure in pose_figures(solved)}
    bent = []
    for pair in simulated.pairs:
        polar = polar_from_cartesian(pair.candidates[0].position_radar_m)
        polar[2] += np.deg2rad(1.5) * np.cos(9.0 * polar[1])
        bent.append(replace(pair, candidates=(candidate_at(cartesian_from_polar(polar), NoiseOptions()),)))
    figure = pose_figures(calibrate_pairs(bent, simulated.camera).unwrap())[-1]
    assert figure.key == "radar_angles"
    assert 0.5 < float(figure.value.removeprefix("up to ")) < 3.0


@pytest.mark.parametrize(
    ("metrics", "cdsd", "held_out", "level"),
    [
        (Metrics(12.0, NAN, 13.0, n=1), "–", "–", "plain"),
        (Metrics(2.0, 1.0, 2.1, n=5, held_out_aed_px=6.0), "1.00", "6.00", "warning"),
    ],
    ids=["not computed", "depends on single pairs"],
)
def test_a_figure_that_was_not_computed_is_a_dash_and_one_that_warns_stands_out(metrics, cdsd, held_out, level):
    figures = {figure.key: figure for figure in shown(5, calibration(*FIVE, metrics=metrics)).metrics}
    assert (figures["cdsd"].value, figures["held_out_aed"].value) == (cdsd, held_out)
    assert figures["held_out_aed"].level == level


def test_a_pose_without_covariance_is_shown_without_one():
    seen = shown(5, calibration(*FIVE, covariance=np.full((6, 6), NAN)))
    assert [figure.value for figure in seen.pose] == ["5.00", "-10.0", "30.0", "0", "0", "0"]


def test_the_residual_limit_is_the_usual_ellipse_or_ransacs_threshold():
    assert shown(5, calibration(*FIVE)).residual_limit_px == pytest.approx(3.0 * 2.447747, rel=0.005)
    blind = tuple(replace(row, expected_covariance_px2=np.full((2, 2), NAN)) for row in FIVE)
    assert shown(5, calibration(*blind)).residual_limit_px is None
    assert shown(5, calibration(*blind, options=CalibrationOptions(method="paper"))).residual_limit_px == 8.0


def test_the_summary_for_the_command_line_has_the_same_figures_and_all_warnings():
    outcome = calibration(
        *FIVE,
        warnings=(DataWarning.reported("a", "b", "c"),),
        unpaired=(Unpaired.reported("c9", "no-scan", "lost", "wait"),),
    )
    lines = tuple(map(str, summary_lines(outcome)))
    assert [line.partition(":")[0] for line in lines[:3]] == ["verdict", "assumes", "next"]
    assert lines[3].split()[-3:] == ["(AED)", "12.4", "px"]
    assert lines[-2:] == ("warning: B. C.", "unpaired: c9: Lost. Wait.")


def test_the_summary_says_a_contradiction_once():
    contradiction = DataWarning.reported("units-suspected", "in feet", "give metres")
    lines = tuple(
        map(str, summary_lines(calibration(*FIVE, warnings=(contradiction, DataWarning.reported("a", "b", "c")))))
    )
    assert (lines[0], lines[1]) == ("verdict: contradictory: in feet", "next: Give metres.")
    assert [line for line in lines if line.startswith("warning")] == ["warning: B. C."]


def test_a_plain_number_has_three_significant_digits():
    texts = {12.4321: "12.4", 0.0314159: "0.0314", 1234.6: "1235", 99.96: "100", 0.0: "0", -5.5: "-5.50", NAN: "–"}
    assert {value: plain(value) for value in texts} == texts


@pytest.mark.parametrize(
    ("value", "sigma", "text"),
    [
        (0.3142, 0.0834, "0.31 ± 0.08"),
        (0.3142, 0.0234, "0.314 ± 0.023"),
        (12.3456, 0.0999, "12.35 ± 0.10"),
        (1234.5, 57.0, "1230 ± 60"),
        (5.0, 3.5551, "5 ± 4"),
        (5.0, 3.5, "5.0 ± 3.5"),
        (-0.001, 0.2, "0.00 ± 0.20"),
        (1.0, float("inf"), "1.00"),
        (1.0, NAN, "1.00"),
        (1.0, 0.0, "1.00"),
        (NAN, 1.0, "–"),
    ],
)
def test_a_number_with_a_standard_deviation_has_the_digits_that_it_justifies(value, sigma, text):
    assert with_sigma(value, sigma) == text


def test_an_ellipse_turns_with_its_covariance():
    angle_rad = np.deg2rad(30.0)
    turn = np.array([[np.cos(angle_rad), -np.sin(angle_rad)], [np.sin(angle_rad), np.cos(angle_rad)]])
    ellipse, unknown = ellipses_of([turn @ np.diag([16.0, 1.0]) @ turn.T, np.full((2, 2), NAN)])
    assert ellipse.angle_rad == pytest.approx(angle_rad, abs=0.005)
    assert (ellipse.semi_major_px, ellipse.semi_minor_px) == pytest.approx((4 * 2.447747, 2.447747))
    assert unknown is None


def test_marks_are_rounded_to_steps_that_cannot_be_seen():
    sharp, wide = pair("c1", projected_px=[13.123456, 24.0]), pair("c2", projected_px=[13.123456, 24.0])
    wide = replace(wide, expected_covariance_px2=np.eye(2) * 40.0**2)
    unknown = replace(pair("c3", projected_px=[13.123456, 24.0]), expected_covariance_px2=np.full((2, 2), NAN))
    drawn = reprojections((sharp, wide, unknown))
    assert [row.step_px for row in drawn.values()] == [0.0625, 0.25, 2.0**-7]
    for row in drawn.values():
        assert abs(row.projected_px[0] - 13.123456) <= row.step_px / 2
    assert drawn == reprojections(
        tuple(replace(one, projected_px=one.projected_px + 1e-4) for one in (sharp, wide, unknown))
    )


def test_the_length_of_a_residual_is_right_to_its_last_decimal():
    wide = replace(pair("c1", projected_px=[13.87, 24.12]), expected_covariance_px2=np.eye(2) * 40.0**2)
    exact_px = float(np.hypot(*(wide.projected_px - wide.pixel_px)))
    assert reprojections((wide,))["c1"].distance_px == round(exact_px, 1)


def test_ninety_five_percent_of_draws_lie_in_the_ellipse():
    rng = np.random.default_rng(5)
    covariance = np.array([[9.0, 4.0], [4.0, 5.0]])
    (ellipse,) = ellipses_of([covariance])
    assert ellipse is not None
    draws = rng.multivariate_normal([0, 0], covariance, size=20_000)
    along = draws @ [np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)]
    across = draws @ [-np.sin(ellipse.angle_rad), np.cos(ellipse.angle_rad)]
    inside = (along / ellipse.semi_major_px) ** 2 + (across / ellipse.semi_minor_px) ** 2 <= 1
    assert inside.mean() == pytest.approx(0.95, abs=0.006)


@pytest.mark.parametrize(
    ("turn", "axis", "meaning"),
    [(0, [1.0, 0, 0], "tips to its right"), (1, [0, 1.0, 0], "looks down"), (2, [0, 0, 1.0], "looks left")],
)
def test_roll_pitch_and_yaw_are_turns_about_the_radar_axes(turn, axis, meaning):
    radar_from_body = rotation_exp(0.1 * np.array(axis))
    camera_from_radar = RigidTransform(OPTICAL_FROM_BODY @ radar_from_body.T, np.zeros(3))
    expected = np.zeros(3)
    expected[turn] = 0.1
    assert mounting_of(calibration(camera_from_radar=camera_from_radar)).roll_pitch_yaw_rad == pytest.approx(expected)
    ahead, left = radar_from_body[:, 0], radar_from_body[:, 1]
    assert {"tips to its right": left[2] > 0, "looks down": ahead[2] < 0, "looks left": ahead[1] > 0}[meaning]


def test_the_sigmas_of_the_mounting_are_those_of_many_perturbed_poses():
    rng = np.random.default_rng(11)
    root = 1e-3 * rng.normal(size=(6, 6))
    covariance = root @ root.T
    pose = RigidTransform(OPTICAL_FROM_BODY @ rotation_exp(np.array([0.2, -0.3, 0.5])), np.array([0.3, -0.1, 0.2]))
    mounting = mounting_of(calibration(camera_from_radar=pose, covariance=covariance))
    errors = rng.multivariate_normal(np.zeros(6), covariance, size=4000)
    drawn = [mounting_of(calibration(camera_from_radar=pose.perturbed(error))) for error in errors]
    assert np.std([one.position_m for one in drawn], axis=0) == pytest.approx(mounting.position_sigma_m, rel=0.05)
    spread = np.std([one.roll_pitch_yaw_rad for one in drawn], axis=0)
    assert spread == pytest.approx(mounting.roll_pitch_yaw_sigma_rad, rel=0.05)


def test_a_phrase_becomes_a_sentence():
    texts = {"the end": "The end.", "Really?": "Really?", "": "", "/radar is odd": "/radar is odd."}
    texts |= {"c14 suits": "c14 suits.", "solving…": "Solving…"}
    assert {phrase: sentence(phrase) for phrase in texts} == texts
