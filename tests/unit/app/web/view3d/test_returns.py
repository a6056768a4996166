"""Returns of the 3D view: their size and colour say what the legend says, and old ones fade."""

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.options import GatingOptions
from calib_core.radar import RadarErrors
from cocalib.web.messages.space_messages import RadarMap
from cocalib.web.radar_sight import Returns
from cocalib.web.view3d.extent import Extent
from cocalib.web.view3d.returns import SIZES, Colouring, map_colours, size_classes

NAN = float("nan")
EXTENT = Extent(20.0, ((0.0, 0.0), (20.0, 10.0)), -1.0, 3.0)
BACKGROUND = {False: np.array([13, 16, 20]), True: np.array([233, 236, 240])}


def returns(*rows: tuple[float, float, float, float, float], age_s: float = 0.0) -> Returns:
    """Return returns from rows of x, y, z [m], speed [m/s], SNR [dB], all of one age."""
    table = np.array(rows, dtype=float).reshape(-1, 5)
    time = TimeNs(10 * NS_PER_S)
    scan = RadarScan(
        TimeNs(time - round(age_s * NS_PER_S)), table[:, :3], table[:, 3], table[:, 4], np.full((len(table), 3), NAN)
    )
    return Returns.of(RadarScans.from_scans([scan]), time, GatingOptions(), lambda points: points)


def test_stronger_returns_are_larger_in_equal_steps_and_unknown_ones_in_the_middle():
    classes = size_classes(np.array([-5.0, 10.0, 19.9, 20.0, 29.9, 30.0, 60.0, NAN]), (10.0, 60.0))
    assert classes.tolist() == [0, 0, 0, 1, 1, 2, 4, 2]
    assert list(SIZES) == sorted(SIZES)
    assert SIZES[2] == 1.0
    assert size_classes(np.array([10.0, NAN]), None).tolist() == [2, 2], "a radar without SNR has one size"


def test_a_return_is_drawn_at_its_true_position_and_read_as_the_radar_reports_it():
    errors = RadarErrors(azimuth_scale=0.1)
    scan = RadarScan(
        TimeNs(0), np.array([[10.0, 5.0, 0.0], [NAN, 0.0, 0.0]]), np.zeros(2), np.zeros(2), np.full((2, 3), NAN)
    )
    seen = Returns.of_scan(scan, GatingOptions(), errors.corrected)
    assert len(seen) == 1, "a return without a position is not shown"
    assert seen.polar[0, 1] == pytest.approx(np.arctan2(5, 10))
    assert np.arctan2(seen.points_m[0, 1], seen.points_m[0, 0]) == pytest.approx(np.arctan2(5, 10) / 1.1)


@pytest.mark.parametrize("light", [False, True])
@pytest.mark.parametrize(
    ("colour", "low", "high", "words"),
    [
        ("speed", (5, 0, 0, 0.0, 20), (5, 0, 0, 2.0, 20), ("", "static", "moving")),
        ("range", (1, 0, 0, 0, 20), (19, 0, 0, 0, 20), ("Range", "0", "20 m")),
        ("doppler", (5, 0, 0, -3.0, 20), (5, 0, 0, 3.0, 20), ("Doppler", "-4", "+4 m/s")),
        ("amplitude", (5, 0, 0, 0, 11), (5, 0, 0, 0, 39), ("SNR", "10", "40 dB")),
        ("height", (5, 0, -0.9, 0, 20), (5, 0, 2.9, 0, 20), ("Height", "-1.0", "3.0 m")),
    ],
)
def test_colours_differ_and_the_legend_says_what_they_mean(colour, low, high, words, light):
    rule = Colouring(colour, EXTENT, (10.0, 40.0), 4.0, light)
    first, last = rule.of(returns(low, high), 0.0).astype(int)
    assert np.abs(first - last).sum() > 100
    for drawn in (first, last):
        assert np.abs(drawn - BACKGROUND[light]).sum() > 100, "visible"
    legend = rule.legend()
    assert (legend.title, legend.low, legend.high) == words


def test_old_returns_fade_into_the_background_and_those_without_doppler_or_snr_are_grey():
    rule = Colouring("speed", EXTENT, None, 1.0, light=False)
    new, old = (rule.of(returns((5, 0, 0, 0, NAN), age_s=age_s), 2.0)[0].astype(int) for age_s in (0.0, 2.0))
    assert np.abs(new - BACKGROUND[False]).sum() > 2 * np.abs(old - BACKGROUND[False]).sum()
    for colour in ("doppler", "amplitude"):
        drawn = Colouring(colour, EXTENT, (10.0, 40.0), 4.0, light=False).of(returns((5, 0, 0, NAN, NAN)), 0.0)
        assert np.ptp(drawn[0].astype(int)) < 40


@pytest.mark.parametrize("light", [False, True])
def test_what_stayed_is_drawn_stronger_than_what_came_and_went(light):
    cells = RadarMap(0.2, (1.0, 2.0), (0.0, 0.0), (0.0, 0.0), (1.0, 0.01), (12.0, 30.0), 10.0, 30.0)
    weak, strong = map_colours(cells, "amplitude", light=light).astype(int)
    assert not np.allclose(weak, strong)
    stays, came = map_colours(cells, "speed", light=light).astype(int)
    assert np.abs(stays - BACKGROUND[light]).sum() > np.abs(came - BACKGROUND[light]).sum()
