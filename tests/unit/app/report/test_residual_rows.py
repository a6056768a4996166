"""Each sentence under a residual plot names what was planted, and nothing where nothing was."""

from dataclasses import replace

import numpy as np
import pytest

from cocalib.report.residual_rows import (
    ResidualRows,
    azimuth_sentence,
    place_sentence,
    range_sentence,
    shift_sentence,
    time_sentence,
    trend,
)
from tests.unit.app.report.planted import SIZE_PX, planted_rows


def _place(rows: ResidualRows) -> str:
    return place_sentence(rows, SIZE_PX)


@pytest.mark.parametrize(
    ("planted", "sentence", "said"),
    [
        ("range", range_sentence, "Residuals grow with range: "),
        ("azimuth", azimuth_sentence, "Residuals grow to both sides: "),
        ("left", azimuth_sentence, "Residuals grow to the left: "),
        ("column", _place, "Residuals grow to the right edge: "),
        ("middle", _place, "Residuals grow away from the middle of the image: "),
        ("time", time_sentence, "Residuals grow with time: "),
    ],
)
def test_a_planted_trend_is_named(planted, sentence, said):
    assert sentence(planted_rows(growing_with=planted)).startswith(said)
    assert sentence(planted_rows()).startswith("No trend ")


def test_a_residual_that_shrinks_with_range_points_at_the_position():
    rows = planted_rows(growing_with="range")
    turned = replace(rows, points_radar_m=rows.points_radar_m * (25.0 / rows.ranges_m - 1.0)[:, None])
    assert range_sentence(turned).startswith("Residuals shrink with range: ")
    assert "camera's position" in range_sentence(turned)


def test_a_shift_that_all_residuals_share_is_named_with_its_size():
    assert "together by (4" in shift_sentence(planted_rows(shift_px=4.0))
    assert "no direction" in shift_sentence(planted_rows())


def test_the_halves_in_a_sentence_are_those_of_the_data():
    rows = planted_rows(growing_with="range")
    middle = np.median(rows.ranges_m)
    near, far = (
        np.sqrt(np.mean(rows.lengths_px[part] ** 2)) for part in (rows.ranges_m <= middle, rows.ranges_m > middle)
    )
    assert f"{near:.3g} px (RMS) up to {middle:.3g} m and {far:.3g} px beyond" in range_sentence(rows)


def test_a_trend_is_the_rank_correlation_with_its_probability():
    values = np.array([106.0, 86, 100, 101, 99, 103, 97, 113, 112, 110])
    lengths = np.array([7.0, 2, 27, 50, 28, 29, 20, 12, 6, 17])  # Wikipedia's example of Spearman's coefficient
    found = trend(values, lengths)
    assert found.correlation == pytest.approx(-29 / 165)
    assert found.p_value == pytest.approx(0.627188, abs=1e-6)


def test_equal_values_share_their_mean_rank():
    found = trend(np.array([1.0, 1, 2, 2, 3, 3, 4, 4]), np.array([1.0, 1, 2, 2, 3, 3, 4, 4]) * 5)
    assert (found.correlation, found.p_value) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-9))


def test_chance_alone_is_seldom_called_a_trend():
    rng = np.random.default_rng(1)
    named = 0
    for _ in range(400):
        found = trend(rng.uniform(size=20), rng.uniform(size=20))
        named += found.p_value < 0.01
    assert named <= 12  # 4 expected; 12 would be four standard deviations


@pytest.mark.parametrize("sentence", [range_sentence, azimuth_sentence, _place, time_sentence, shift_sentence])
def test_few_pairs_show_no_trend_and_the_sentence_says_so(sentence):
    assert sentence(planted_rows(n=5)).startswith("5 clicks are too")
