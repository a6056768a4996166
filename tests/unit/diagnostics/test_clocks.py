"""Clicks that miss their dwells to one side indicate a clock offset; single hasty clicks and clicks inside a dwell do not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib_core.calibration import calibrate
from calib_core.diagnostics.clocks import clock_offset
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.options import CalibrationOptions, GatingOptions
from calib_core.results import Calibration, PairResult
from tests.rooftop import ClickedSample, read_rooftop

DWELL_S = 4.0
EVERY_S = 10.0
AHEAD_S = 3.0


@pytest.fixture(scope="module")
def rooftop(project_root: Path) -> ClickedSample:
    return read_rooftop(project_root, 8.0)


def clock_warnings(rooftop: ClickedSample, ahead_s: float) -> list[str]:
    clicks, scans, camera = rooftop
    shifted = replace(scans, times_ns=scans.times_ns + round(ahead_s * NS_PER_S))
    outcome = calibrate(clicks, shifted, camera, CalibrationOptions())
    assert isinstance(outcome, Calibration)
    return [one.message for one in outcome.warnings if one.code == "clock-bias-suspected"]


@pytest.mark.parametrize("ahead_s", [0.0, 1.0, -1.0])
def test_an_offset_that_leaves_the_clicks_in_their_dwells_gives_no_warning(
    rooftop: ClickedSample, ahead_s: float
) -> None:
    assert clock_warnings(rooftop, ahead_s) == []


@pytest.mark.parametrize(("ahead_s", "words"), [(AHEAD_S, "ahead of"), (-AHEAD_S, "behind")])
def test_stamps_that_take_the_clicks_out_of_their_dwells_are_suspected(
    rooftop: ClickedSample, ahead_s: float, words: str
) -> None:
    (text,) = clock_warnings(rooftop, ahead_s)
    assert words in text


def placed(offsets_s: list[float]) -> tuple[list[PairResult], RadarScans]:
    """Make one dwell per click, and place each click at an offset from its middle."""
    rng = np.random.default_rng(1)
    scans, pairs = [], []
    for i, offset_s in enumerate(offsets_s):
        place = np.array([3.0 + i, 0.5 * (-1) ** i, -0.5])
        middle_s = 100.0 + EVERY_S * i
        for time_s in np.arange(middle_s - DWELL_S / 2, middle_s + DWELL_S / 2, 0.1):
            nothing = np.full(1, np.nan)
            point = (place + 0.005 * rng.standard_normal(3))[None]
            time = TimeNs(round(time_s * NS_PER_S))
            scans.append(RadarScan(time, point, nothing, nothing, np.full((1, 3), np.nan)))
        click_ns = TimeNs(round((middle_s + offset_s) * NS_PER_S))
        pairs.append(PairResult(f"c{i}", np.zeros(2), np.zeros(2), place, inlier=True, image_time=click_ns))
    return pairs, RadarScans.from_scans(scans)


def test_the_offset_lies_between_what_all_clicks_allow() -> None:
    clicked_s = [-2.9, -1.7, -2.6, -2.5, -3.0]
    offset = clock_offset(*placed(clicked_s), GatingOptions())
    assert offset is not None
    assert offset.least_s == pytest.approx(3.0 - DWELL_S / 2, abs=0.11)
    assert offset.most_s == pytest.approx(1.7 + DWELL_S / 2, abs=0.21)
    assert offset.nearest_s == offset.least_s
    assert offset.outside == ("c0", "c2", "c3", "c4")
    assert offset.clicks == len(clicked_s)


def test_clicks_anywhere_inside_their_dwells_give_no_warning() -> None:
    assert clock_offset(*placed([-1.9, 1.8, 0.0, -1.0, 1.5]), GatingOptions()) is None


def test_clicks_that_miss_to_both_sides_are_not_a_clock_offset() -> None:
    assert clock_offset(*placed([-2.9, 2.8, -3.1, 3.0, -2.7, 2.9]), GatingOptions()) is None


def test_two_hasty_clicks_are_not_a_clock_offset() -> None:
    assert clock_offset(*placed([-2.9, -2.8, 0.0, 0.1, -0.2, 0.3]), GatingOptions()) is None


def test_without_scans_or_stamps_there_is_no_warning() -> None:
    pairs, scans = placed([-2.9, -3.0, -2.8])
    assert clock_offset(pairs, RadarScans(), GatingOptions()) is None
    assert clock_offset([replace(pair, image_time=None) for pair in pairs], scans, GatingOptions()) is None
