"""The verdict on the page: its key, when it says done, and how many placements are left."""

import re
from dataclasses import replace

import numpy as np
import pytest

from calib_core.measurements import DataWarning, ReflectorClick, TimeNs, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, GatingOptions, NoiseOptions
from calib_core.results.actions import ClickMore, Export, ReduceError
from calib_core.results.verdict import Assumed, StatedError, Verdict, stated_error, verdict_on
from calib_core.words.text import PairPart, with_degree_signs
from calib_core.words.verdict import error_text
from cocalib.session.state import RecordingFacts, Session
from cocalib.view.build import verdict_row
from cocalib.view.click_rows import disagreement
from tests.unit.app.view.test_view import ASKING, FIVE, calibration, pair, shown

ERROR = StatedError(rotation_deg=0.3, position_cm=3.0, image_px=4.0, range_m=9.0, in_plane=False)
ASSUMED = Assumed(measured=False, not_mirrored=True, elevations=True, principal_point_px=5.0)
FACTS = RecordingFacts("drive", 1_000_000_000 * np.arange(50), width_px=640, height_px=480)


def test_done_is_said_with_the_key_that_exports():
    row = verdict_row(Verdict("good", Export(), error=ERROR), Session(), None)
    assert (row.done, row.key, row.kind) == (True, "E", "Export")
    assert (row.word, re.findall(r"[\d.]+", str(row.line))) == ("good", ["0.3", "3", "95", "4", "9"])


def test_an_action_that_an_option_does_names_it():
    for action, option in ((ReduceError("azimuth_scale", measured=False), "solving.camera_position"), (Export(), "")):
        assert verdict_row(Verdict("usable", action, error=ERROR), Session(), None).option == option
    near = CalibrationOptions(gating=GatingOptions(max_range_m=1.0))
    lost = Unsolvable.reported(
        "too-few-pairs", "no pair", "click", (Unpaired.reported("c1", "no-static-return", "no return", "widen"),)
    )
    session = Session(clicks=(ReflectorClick(TimeNs(0), "c1", 1.0, 1.0),), options=near, outcome=lost)
    assert verdict_row(verdict_on(lost), session, None).option == "gating.max_range_m"
    assert verdict_row(verdict_on(lost), replace(session, options=CalibrationOptions()), None).option == ""


def test_excluded_clicks_do_not_count_as_pairs():
    facts = {"used": 3, "needed": 4, "excluded": 2, "unpaired": 0}
    pairs = (FIVE[number].measured or ASKING.measured for number in range(5))
    few = Unsolvable("too-few-pairs", facts, pairs=tuple(pairs))
    session = Session(clicks=(ReflectorClick(TimeNs(0), "c1", 1.0, 1.0),), outcome=few)
    assert re.findall(r"\d+", str(verdict_row(verdict_on(few), session, None).line)) == ["3", "8"]


TWO_POSES = DataWarning.reported(
    "two-poses", "another pose explains the pairs almost as well", "check the return of c2"
)
OF_THE_LENS = DataWarning.reported("intrinsics-suspected", "residuals grow outwards", "check the intrinsics")
MIRRORED = DataWarning.reported("mirrored-axes", "an axis is mirrored", "turn it round")


@pytest.mark.parametrize(
    ("pairs", "warnings", "level", "line", "named"),
    [
        (FIVE, (), "early", "5 of 8 pairs; looks consistent", ()),
        (FIVE, (TWO_POSES,), "early", "5 of 8 pairs; two answers fit so far", ()),
        ((*FIVE[:4], replace(FIVE[4], outlier_probability=0.1)), (), "coarse", "5 of 8 pairs; check c5", ("c5",)),
        ((*FIVE[:4], replace(FIVE[4], inlier=False, rival=1)), (), "coarse", "4 of 8 pairs; a return is open", ()),
        ((*FIVE[:4], pair("c5", inlier=False)), (), "coarse", "4 of 8 pairs; c5 does not fit", ("c5",)),
        ((*FIVE[:4], pair("c5", inlier=False)), (TWO_POSES,), "coarse", "4 of 8 pairs; c5 does not fit", ("c5",)),
        (FIVE, (MIRRORED,), "contradictory", "", ()),
    ],
)
def test_few_pairs_are_counted_and_the_one_that_does_not_fit_is_named(pairs, warnings, level, line, named):
    row = shown(5, replace(calibration(*pairs), warnings=warnings)).verdict
    assert "early" if row.early else row.level == level
    assert str(row.line) == line or not line
    assert not re.search("°|deg|cm", str(row.line)), "so few pairs state no error"
    ids = tuple(part.pair for part in row.misfits.parts if isinstance(part, PairPart))
    assert named == (ids or row.pairs)


def test_of_four_pairs_with_a_wrong_one_a_further_placement_is_asked_for():
    lost = Unsolvable("no-pose", {"agreeing": 3, "pairs": 4})
    session = Session(clicks=(ReflectorClick(TimeNs(2 * 10**9), "c1", 1.0, 1.0),), outcome=lost)
    row = verdict_row(verdict_on(lost, left=1), session, 1)
    assert (row.level, row.early, row.key, row.kind) == ("coarse", False, "N", "FollowHint")
    two = Unsolvable("no-pose", {"agreeing": 3, "pairs": 5})
    assert verdict_row(verdict_on(two, left=1), replace(session, outcome=two), 1).level == "contradictory"


def test_an_error_that_is_large_for_want_of_pairs_is_no_alarm_while_placements_are_left() -> None:
    eight = tuple(pair(f"c{number}") for number in range(1, 9))
    error = stated_error(calibration(*eight))
    coarse = Verdict("coarse", ClickMore(3), error=error, assumed=ASSUMED)
    clicked = tuple(ReflectorClick(TimeNs(s * 10**9), f"c{s}", 1.0, 1.0) for s in (2, 12))
    odd = (*eight, pair("c9", inlier=False))
    agreeing, apart = (Session(clicks=clicked[:1], outcome=calibration(*some)) for some in (eight, odd))
    row = verdict_row(coarse, agreeing, 1)
    assert (row.early, f"within {with_degree_signs(error_text(error))}" in str(row.line)) == (True, True)
    row = verdict_row(coarse, apart, 1)
    assert (row.early, PairPart("c9") in row.misfits.parts) == (False, True), "as long as one is set aside it is named"
    assert not verdict_row(replace(coarse, cause=OF_THE_LENS), agreeing, 1).early
    assert not verdict_row(replace(coarse, error=None, unconfirmed=1), agreeing, 1).early
    assert not verdict_row(coarse, agreeing, 0).early
    doubted = replace(agreeing, outcome=calibration(*eight[:7], replace(eight[7], outlier_probability=0.1)))
    row = verdict_row(coarse, doubted, 1)
    assert (row.early, row.key) == (False, "")
    assert PairPart("c8") in row.line.parts
    assert (row.kind, row.pairs) == ("ReviewPairs", ("c8",))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (CalibrationOptions(), "Check the click"),
        (CalibrationOptions(method="paper"), "Algorithm 1"),
        (CalibrationOptions(noise=NoiseOptions(sigma_px=0.1)), "click noise far below the default"),
    ],
)
def test_the_mark_is_not_blamed_for_the_method_or_the_options(options, words):
    cause = disagreement(options)
    assert words in f"{cause.what}. {cause.action}"
