"""The words of a few representative views, in one file: `python -m tests.unit.app.view.test_words` writes them again."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from calib_core.diagnostics.next_placement import Coverage, Place
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import LeftOutImage
from calib_core.measurements import Unpaired, Unsolvable
from calib_core.results import Calibration, DataWarning, NextPlacement, PairResult
from calib_core.results.actions import (
    Action,
    CalibrateLens,
    ChooseReturn,
    ClickFirst,
    ClickMore,
    ConfirmAssumptions,
    Export,
    FollowHint,
    MeasureCameraPosition,
    PlaceReflector,
    ReduceError,
    ReviewPairs,
    SetOption,
    SpreadPlacements,
    Stop,
)
from calib_core.results.systematic_errors import SystematicErrorResult
from calib_core.words.outcomes import OUTCOMES, in_sentences
from calib_core.words.systematic_errors import ERRORS
from calib_core.words.unpaired import UNPAIRED
from calib_core.words.verdict import words_of
from calib_core.words.warnings import ROWS
from cocalib.session.applying import History
from cocalib.session.events import ClickExcluded
from cocalib.view.build import view
from cocalib.view.following import Pace, advice_words, pace_words
from cocalib.view.model import View
from tests.unit.app.view.test_view import ASKING, EVERY_STATE, FACTS, FIVE, UNSEEN, calibration, clicked, pair, shown

KEPT = Path(__file__).with_name("words.txt")


def _views() -> Iterator[tuple[str, View]]:
    yield "nothing clicked", view(History(), FACTS)
    for count in (1, 3, 4):
        yield f"clicks: {count}", view(clicked(count), FACTS)
    yield "four clicks, one excluded", view(clicked(4, ClickExcluded("c2", True)), FACTS)
    yield "five clicks agree", shown(5, calibration(*FIVE))
    yield "four of five agree", shown(5, calibration(*FIVE[:4], pair("c5", inlier=False)))
    yield "one excluded", shown(5, calibration(*FIVE[:4], pair("c5", excluded=True)))
    yield "being checked", shown(5, calibration(*FIVE, checking=True))
    yield (
        "no pose",
        shown(5, Unsolvable.reported("no-pose", "only 3 of 5 pairs agree on any pose", "spread the placements")),
    )
    yield "no intrinsics", shown(1, Unsolvable("no-camera"))
    yield "clicks that the radar did not see", shown(5, UNSEEN)
    yield "a click in every state", shown(5, EVERY_STATE, ClickExcluded("c3", True))
    yield "a click that two returns fit", shown(5, calibration(*FIVE[:4], ASKING))
    yield (
        "a warning",
        shown(5, calibration(*FIVE, warnings=(DataWarning.reported("few-pairs", "only 5 pairs", "add some"),))),
    )
    yield "too few pairs", shown(3, Unsolvable("too-few-pairs", {"used": 2, "needed": 4, "excluded": 1, "unpaired": 0}))
    yield "one of four does not fit", shown(4, Unsolvable("no-pose", {"agreeing": 3, "pairs": 4}))
    yield "a pair that may be wrong", shown(5, calibration(*FIVE[:4], _SUSPECT))
    two_poses = (DataWarning("two-poses", {**_AWAY, "sigmas": 48.0}),)
    for gain, may_stop in ((1.2, False), (1.01, False), (1.0, True)):
        best = replace(_best(8.0, -3.0, may_stop=may_stop), gain=gain)
        outcome = calibration(*FIVE, warnings=two_poses, next_placement=best)
        yield f"two poses fit five pairs, and a further placement: {gain}", shown(5, outcome)
    yield "a large error", shown(9, _large(*_NINE))
    yield "a large error, and a pair that may be wrong", shown(9, _large(*_NINE[:-1], replace(_SUSPECT, id="c9")))


_AWAY = {"away_deg": 12.0, "away_cm": 84.0}
_SUSPECT = pair("c5", outlier_probability=0.2)
_NINE = tuple(pair(f"c{number}") for number in range(1, 10))


def _large(*pairs: PairResult, **more: Any) -> Calibration:
    return calibration(*pairs, covariance=np.diag([0.04, 0.04, 0.04, 1e-3, 1e-3, 1e-3]), **more)


def _best(x_m: float, y_m: float, *, may_stop: bool) -> NextPlacement:
    return NextPlacement(np.array([x_m, y_m, 0.0]), np.array([1.0, 2.0]), 1.2, may_stop)


def _while_following() -> Iterator[str]:
    yield "# a recording that is still being written: how fresh it is, and where to go next"
    yield pace_words(Pace("live"))
    yield pace_words(Pace("live", age_s=0.42))
    yield pace_words(Pace("live", every_s=2.13, age_s=2.5))
    yield pace_words(Pace("live", every_s=0.2))
    yield pace_words(Pace("quiet", quiet_s=12.4))
    yield pace_words(Pace("complete"))
    yield pace_words(Pace("ended", problem="Drive.mcap: was truncated."))
    yield advice_words(Coverage(11, Place("left", 10.0, 15.0), one_height=False), None)
    yield advice_words(Coverage(22, Place("right", 2.0, 5.0), one_height=True), None)
    yield advice_words(Coverage(21, None, one_height=False), None)
    yield advice_words(Coverage(6, Place("left", 2.0, 5.0), one_height=False), _best(8.0, -3.0, may_stop=False))
    yield advice_words(Coverage(1, None, one_height=False), _best(8.0, 0.1, may_stop=True))


def _lines(name: str, seen: View) -> Iterator[str]:
    yield f"# {name}"
    yield f"status: {seen.status or 'none'}"
    yield f"verdict: {seen.verdict.word}{seen.verdict.line}"
    yield f"action: {seen.verdict.action}"
    if seen.advice is not None:
        yield f"advice: {seen.advice.words}"
    yield from (f"{one.key}: {one.name}. {one.hint}" for one in seen.metrics)
    yield from (f"{row.id}: {row.note}" for row in seen.clicks if row.note)


_DAMAGE = DataWarning.reported("damaged-file", "radar.bag: chunk 7 is damaged", "copy it again")
_SCALE = SystematicErrorResult("azimuth_scale", 0.012, 0.009, 0.02, True, 0.51, 0.05)
_SCORES = {"score": 31.0, "by_chance": 25.0, "rival": 29.0}
_BOARD = Board("checkerboard", 9, 6, 0.025)
_IMAGE = {"clicks": 9, "width_px": 640, "height_px": 480}
_OFF_MIDDLE = {"principal_point_px": (646.0, 471.0), "width_px": 1280, "height_px": 720}
_STATED: tuple[DataWarning | Unsolvable | Unpaired, ...] = (
    DataWarning("agreeing-outliers", {"ids": ["c3", "c4"], "in_time": ""}),
    DataWarning("agreeing-outliers", {"ids": ["c3", "c4"], "in_time": "first"}),
    *(
        DataWarning("angle-scale", {"error": error, "value": value, "sigma": 0.01, "flat": flat, "measured": flat})
        for error, value, flat in (
            ("azimuth_scale", 0.03, True),
            ("azimuth_scale", -0.03, False),
            ("elevation_scale", 0.03, False),
        )
    ),
    DataWarning("behind-camera", {"ids": ["c1"], "pairs": 9}),
    DataWarning("camera-far-away", {"expected_m": 1.0, "solved_m": 7.2}),
    DataWarning("camera-far-away", {**_AWAY, "expected_m": 1.0, "sigmas": 9.0, "here_m": 0.4, "there_m": 1.9}),
    DataWarning("camera-position-contradicted", {"away_cm": 31.0, "sigmas": 7.0}),
    DataWarning(
        "camera-position-contradicted", {"away_cm": 31.0, "sigmas": 7.0, "misread": "position", "unit": "level"}
    ),
    DataWarning("camera-position-doubtful", {"away_cm": 31.0, "sigmas": 3.7, "one_in": 250, "weight": 0.96}),
    DataWarning(
        "carried-forward", {"turned_deg": {"pitch": 0.02, "yaw": 1.02, "roll": -0.1}, "sha256": "0123456789abcdef"}
    ),
    DataWarning(
        "camera-turned",
        {"turned_deg": 0.171, "last_s": 40.0, "first_s": 2590.0, "ids": ("c1", "c2"), "before": True},
    ),
    DataWarning("choices-unused", {"clicks": 1}),
    DataWarning("clock-bias-suspected", {"ids": ["c1", "c2"], "clicks": 9, "offset_s": 0.4}),
    DataWarning("clock-bias-suspected", {"ids": ["c1", "c2"], "clicks": 9, "offset_s": -0.4}),
    DataWarning(
        "clocks-apart",
        {"shifted_agreeing": 18, "shifted_clicks": 19, "placements": 1, "agreeing": 5, "clicks": 20, "apart_s": 8.5},
    ),
    DataWarning(
        "clocks-apart",
        {"shifted_agreeing": 18, "shifted_clicks": 19, "placements": 1, "agreeing": 5, "clicks": 20, "apart_s": 0.0},
    ),
    DataWarning("damaged-recording", {"lost": 2, "share": 0.02, "damage": _DAMAGE}),
    DataWarning("damaged-recording", {"lost": 0, "share": 0.12, "damage": _DAMAGE}),
    DataWarning("radar-missing", {"lost": 6, "clicks": 20, "damage": _DAMAGE}),
    DataWarning("radar-mostly-missing", {"lost": 11, "clicks": 20, "damage": None}),
    DataWarning("few-pairs", {"agreeing": 5, "pairs": 5, "needed": 8, "clear": True}),
    DataWarning("few-pairs", {"agreeing": 5, "pairs": 5, "needed": 8, "clear": False}),
    DataWarning("few-pairs", {"agreeing": 5, "pairs": 6, "needed": 8, "clear": False}),
    DataWarning(
        "flat-radar",
        {"forward_cm": 9, "left_cm": 4, "yaw_deg": 0.4, "image_px": 5, "up_cm": 30, "pitch_deg": 2, "roll_deg": 2},
    ),
    DataWarning("handedness-assumed", {"within_m": 1.0}),
    DataWarning("handedness-open"),
    DataWarning("intrinsics-suspected", {"focal_length": 0.02, "sigma": 0.004, "beside": [("azimuth", "azimuth^3")]}),
    DataWarning("intrinsics-suspected", {"distortion_px": 9.0, "sigma": 2.0}),
    DataWarning("excluded-by-residual", {"ids": ["c3", "c9"], "aed_px": 8.1, "all_aed_px": 9.7}),
    DataWarning("intrinsics-suspected", {"refined_too_far": [replace(_SCALE, name="focal_length", value=0.2)]}),
    DataWarning("intrinsics-suspected", {**_OFF_MIDDLE, "mode": "4:3"}),
    DataWarning("lens-or-radar-scale", {"change": 0.02, "sigma": 0.01, "scales": [_SCALE]}),
    DataWarning("lost-returns", {"lost": 3, "read": 60, "where": "the radar around the clicks"}),
    DataWarning("many-outliers", {"ids": [f"c{number}" for number in range(1, 9)], "pairs": 20}),
    DataWarning(
        "algorithm-1-contradicted",
        {"chi2_per_degree": 239.4, "agreeing": 2, "inliers": 5, "pairs": 20, "threshold_px": 8.0},
    ),
    DataWarning("mirrored-axes", {"log_likelihood_ratio": 9.0}),
    DataWarning("mirrored-axes", {"camera_m": -0.7, "radar_m": 0.9}),
    DataWarning("no-consensus", {"agreeing": 5, "pairs": 20}),
    DataWarning("nobody-confirmed", {"placed": 4, "clicks": 9, "confidence": 0.93}),
    DataWarning("one-pair-decides", {"pair": "c7", "loss": 9.0}),
    DataWarning("pixels-suspected", {**_IMAGE, "outside": 4, "exchanged": True}),
    DataWarning("pixels-suspected", {**_IMAGE, "outside": 4, "pair": "c7", "pixel_px": [900.0, 20.0]}),
    DataWarning("pixels-suspected", {**_IMAGE, "reach": (0.48, 0.45)}),
    DataWarning("pixels-suspected", {**_OFF_MIDDLE, "mode": ""}),
    DataWarning("radar-axes-suspected", {"side": "left", "behind": 3, "pairs": 9}),
    DataWarning("repeated-placements", {"pairs": 9, "places": 4}),
    DataWarning("residuals-too-large", {"chi2_per_degree": 9.0}),
    DataWarning(
        "radar-in-vehicle-frame",
        {
            "frame": "base_link",
            "by_name": "body",
            "by_data": "unknown",
            "mounted": False,
            "stated": False,
            "place_m": (),
        },
    ),
    DataWarning("principal-point-off", {"right": 0.068, "down": -0.081}),
    DataWarning("one-row", {"row_px": 540.2, "spread_px": 2.6}),
    DataWarning("placement-ranges", {"chosen": 3, "by_score": 17, "region_m": 1.0}),
    DataWarning("shared-error-suspected", {"error": "click_down_px", "value": 9.0, "sigma": 2.0, "prior_sigma": 2.0}),
    DataWarning(
        "shared-error-suspected",
        {
            "quantity": "azimuth",
            "shape": "range",
            "largest": 0.02,
            "largest_sigma": 0.004,
            "beside": [("column", "range")],
        },
    ),
    DataWarning("shared-error-suspected", {"step": "move", "size": 0.1, "before": "c7", "after": "c8"}),
    DataWarning("shared-error-suspected", {"step": "turn", "size": 0.02, "before": "c7", "after": "c8"}),
    DataWarning(
        "shared-error-suspected", {"step": "turn", "size": 0.02, "before": "c7", "after": "c8", "by_number": True}
    ),
    DataWarning("smooth-angle-errors", {"growth": 3.0, "uncertain_lens": False}),
    DataWarning("two-poses", {**_AWAY, "sigmas": 48.0}),
    DataWarning("two-poses", {**_AWAY, "sigmas": 48.0, "other_returns": ["c2", "c5"]}),
    DataWarning("two-poses", {**_AWAY, "probability": 0.2}),
    DataWarning("two-poses", {**_AWAY, "agreeing": ["c2", "c5"], "pairs": 9}),
    DataWarning("uncertain-association", {"ids": ["c2"]}),
    DataWarning("units-suspected", {"nearest": 300.0, "farthest": 4000.0, "unit": "centimeters", "factor": 0.01}),
    DataWarning("units-suspected", {"camera_away": 40.0}),
    DataWarning("weak-geometry", {"rotation_deg": 3.0, "position_cm": 40.0, "paper": True}),
    DataWarning("weak-geometry", {"rotation_deg": 3.0, "position_cm": 40.0}),
    DataWarning(
        "bent-board", {"bends_mm": {"bend along the rows": (-1.3, 0.1), "twist": (0.4, 0.1)}, "modelled": True}
    ),
    DataWarning("few-views", {"views": 5}),
    DataWarning("large-residuals", {"rms_px": 1.4}),
    DataWarning("lens-folds-back", {"share": 0.07}),
    DataWarning("little-covered", {"share": 0.46}),
    DataWarning("principal-point-far", {"point_px": (200.0, 240.0), "middle_px": (319.5, 239.5)}),
    DataWarning("several-series", {"series": {"left": 12, "right": 13}}),
    DataWarning("skewed-views", {"skew_px": 2.1, "share": 0.31}),
    DataWarning("unequal-focal-lengths", {"fx_px": 700.0, "fy_px": 735.0}),
    DataWarning("unequal-squares", {"stretch": 0.02, "sigma": 0.001, "modelled": False}),
    DataWarning("weak-focal-length", {"sigma": 0.03}),
    DataWarning("no-camera"),
    DataWarning("boxes-note", {"source": "boxes.json", "note": "boxes are scaled by 0.5"}),
    DataWarning("mostly-moving", {"unfitted": 30, "scans": 40}),
    DataWarning("no-doppler", {"assumed": False}),
    DataWarning("no-doppler", {"assumed": True}),
    DataWarning("no-paired-clicks"),
    DataWarning("no-paired-clicks", {"clicks": 3, "first": Unpaired("no-scan", id="c1")}),
    DataWarning("no-target-in-a-box"),
    DataWarning("no-target-in-a-box", {"targets": 7}),
    DataWarning("no-targets", {"max_range_m": 200.0}),
    DataWarning("sparse-frames", {"frames": "scans", "apart_s": 0.75, "longest_s": 0.5}),
    DataWarning("turned-from-boxes", {"axis": "yaw", "turned_deg": -27.0}),
    DataWarning("turned-from-boxes", {"axis": "pitch", "turned_deg": 2.5, "low_deg": 2.0, "high_deg": 3.25}),
    Unsolvable("degenerate-placements", {"placements": 5}),
    Unsolvable("degenerate-placements", {"placements": 3, "clicks": 9, "needed": 4}),
    Unsolvable("mirrored-axes", {"agreeing": 3, "pairs": 9}),
    Unsolvable("no-consensus", {"pairs": 9, "threshold_px": 8.0}),
    Unsolvable(
        "no-pose", {"agreeing": 3, "pairs": 9}, suspected=(DataWarning("units-suspected", {"camera_away": 40.0}),)
    ),
    Unsolvable("points-in-one-line", {"pairs": 9}),
    Unsolvable("refinement-diverged"),
    Unsolvable("too-few-pairs", {"used": 2, "needed": 4, "excluded": 1, "unpaired": 0}),
    Unsolvable("stopped"),
    Unsolvable("unreadable", {"why": "radar.bag: chunk 7 is damaged"}),
    Unsolvable("unreadable", {"why": "left01.png: the file is cut off", "images": 20}),
    Unsolvable("useless-lens-covariance"),
    Unsolvable("useless-lens-covariance", {"parameter": "fx_px", "value_px": 700.0, "sigma_px": 400.0}),
    Unsolvable("internal-error", {"fault": "ZeroDivisionError: by zero"}),
    Unsolvable("no-camera"),
    Unsolvable("no-clicks"),
    Unsolvable("no-frames"),
    Unsolvable("no-frames-in-placements", {"placements": 9, "first_s": -90.0, "last_s": -12.0}),
    *(
        Unsolvable("not-confident", {"why": why, "placements": 4})
        for why in ("few-placements", "no-mounting", "fading")
    ),
    *(Unsolvable("not-confident", {"why": why, **_SCORES, "confidence": 0.41}) for why in ("chance", "rival")),
    Unsolvable("not-confident", {"why": "few-certain", "certain": 4, "placements": 9, "needed": 6}),
    Unsolvable("not-confident", {"contradiction": DataWarning("handedness-open")}),
    Unsolvable("not-confident", {"camera_away_m": 1.2}),
    Unsolvable("nothing-proposed", {"placements": 9}),
    Unsolvable("too-few-placements", {"placements": 1, "needed": 3}),
    Unsolvable("few-views", {"views": 2, "needed": 3, "left_out": [LeftOutImage(7, "image 7", "blurred")]}),
    Unsolvable("few-views", {"views": 7, "needed": 8, "halves": True}),
    Unsolvable("mixed-sizes", {"counts": [((640, 480), 9), ((320, 240), 8)]}),
    Unsolvable("no-board", {"board": _BOARD, "searched": 20, "views": 0}),
    Unsolvable("no-board", {"board": Board("charuco", 8, 11, 0.03, 0.02), "searched": 20, "views": 1}),
    Unsolvable("no-lens", {"views": 9, "why": "pinhole: no focal length explains the views", "model": "auto"}),
    Unsolvable("no-lens", {"views": 9, "why": "pinhole: no focal length explains the views", "model": "pinhole"}),
    Unsolvable("no-pictures"),
    Unsolvable(
        "other-board", {"board": _BOARD, "searched": 20, "views": 1, "corners": (8, 5), "shown": 6, "asked": 13}
    ),
    Unsolvable("parallel-views", {"turned_deg": 3.0, "focal_px": 700.0, "sigma": 0.4}),
    Unsolvable("unknown-focal-length", {"focal_px": 700.0, "sigma": 0.2, "rms_px": 0.3, "model": "pinhole"}),
    Unpaired("chosen-return-missing", {"range_m": 9.0, "azimuth_deg": -12.0}, id="c1"),
    Unpaired("no-scan", id="c1"),
    Unpaired("no-scan", {"gap_s": 2.0, "allowed_s": 0.5}, id="c1"),
    Unpaired("no-static-return", {"scans": 30, "within_s": 1.5}, id="c1"),
    Unpaired(
        "no-static-return",
        {"scans": 30, "within_s": 1.5, "fastest_mps": 0.2, "nearest_m": 0.5, "farthest_m": 60.0},
        id="c1",
    ),
    Unpaired("no-static-return", {"paper": True, "fastest_mps": 0.1, "farthest_m": 60.0}, id="c1"),
    Unpaired("nothing-in-range", {"returns": 7, "region_m": 1.0}, id="c1"),
    Unpaired("no-z-score-inlier", {"returns": 7, "z_score_threshold": 1.0}, id="c1"),
)
_ACTIONS: tuple[Action, ...] = (
    *(ClickMore(count) for count in (None, 1, 3)),
    ClickMore(3, or_export=True),
    ClickFirst(),
    ClickFirst(placements_known=True),
    PlaceReflector((4.5, 2.1, 0.0), 1.2),
    ReviewPairs(("c1", "c2")),
    ChooseReturn(("c2",)),
    MeasureCameraPosition(),
    SpreadPlacements("edges"),
    SetOption("method", "default"),
    SetOption("gating.max_range_m"),
    CalibrateLens(),
    *(ReduceError(name, measured=measured) for name in ERRORS for measured in (False, True)),
    ConfirmAssumptions(),
    Export(),
    Stop(),
)


def _rows() -> Iterator[str]:
    yield "# what the core finds: warnings, outcomes and clicks without a radar position"
    yield from (f"{type(stated).__name__} {stated.code}: {in_sentences(stated)}" for stated in _STATED)
    yield "# what to do"
    yield from dict.fromkeys(f"{type(action).__name__}: {words_of(action)}." for action in _ACTIONS)


def words() -> str:
    pages = [*(_lines(name, seen) for name, seen in _views()), _while_following(), _rows()]
    return "\n\n".join("\n".join(lines) for lines in pages) + "\n"


def test_every_row_of_words_is_on_the_page():
    for kind, rows in ((DataWarning, ROWS), (Unsolvable, OUTCOMES), (Unpaired, UNPAIRED)):
        assert {stated.code for stated in _STATED if isinstance(stated, kind)} == set(rows)
    assert {type(action) for action in _ACTIONS} == set(get_args(Action)) - {FollowHint}


def test_the_words_of_the_views_are_those_that_were_kept():
    assert words() == KEPT.read_text(encoding="utf-8"), "run: python -m tests.unit.app.view.test_words"


if __name__ == "__main__":
    KEPT.write_text(words(), encoding="utf-8")
