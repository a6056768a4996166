"""Lines of equal uncertainty: traced over a grid, labelled, and drawn at round values."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.simulated_pairs import simulate_pairs
from calib_core.calibration import calibrate_pairs
from cocalib.view.contours import contour_lines, contour_maps

COLUMNS, ROWS = np.linspace(0.0, 60.0, 31), np.linspace(0.0, 40.0, 21)


def test_a_hill_has_one_closed_line_per_level_and_it_is_a_circle():
    u, v = np.meshgrid(COLUMNS, ROWS)
    heights = np.hypot(u - 30.0, v - 20.0)
    (line,) = contour_lines(COLUMNS, ROWS, heights, 12.3)

    assert line[0] == line[-1]
    np.testing.assert_allclose(np.hypot(*(np.array(line) - (30.0, 20.0)).T), 12.3, atol=0.3)


def test_a_line_ends_at_cells_without_values():
    u, _ = np.meshgrid(COLUMNS, ROWS)
    heights = u.copy()
    heights[10, :] = np.nan
    above, below = sorted(contour_lines(COLUMNS, ROWS, heights, 25.0), key=lambda line: line[0][1])

    assert {point[0] for point in above + below} == {25.0}
    assert max(v for _, v in above) == ROWS[9]
    assert min(v for _, v in below) == ROWS[11]


@given(st.integers(0, 2**32 - 1), st.floats(-0.9, 0.9))
def test_every_point_of_a_line_has_its_value_and_every_crossing_is_drawn_once(seed, level):
    heights = np.random.default_rng(seed).uniform(-1.0, 1.0, (6, 7))
    columns, rows = np.arange(7.0) * 1000.0, np.arange(6.0) * 1000.0
    lines = list(contour_lines(columns, rows, heights, level))
    above = heights > level
    crossings = int((above[:, 1:] != above[:, :-1]).sum() + (above[1:] != above[:-1]).sum())

    assert sum(len(line) - (line[0] == line[-1]) for line in lines) == crossings
    for u, v in (point for line in lines for point in line):
        row, column = min(int(v // 1000), 5), min(int(u // 1000), 6)
        share_u, share_v = u / 1000 - column, v / 1000 - row
        along_row = heights[row, min(column + 1, 6)] * share_u + heights[row, column] * (1 - share_u)
        along_column = heights[min(row + 1, 5), column] * share_v + heights[row, column] * (1 - share_v)
        assert min(abs(along_row - level), abs(along_column - level)) < 1e-3


def test_a_calibration_has_labelled_lines_at_each_distance_and_says_where_it_extrapolates():
    drawn = simulate_pairs(20, rng=np.random.default_rng(7))
    maps = contour_maps(calibrate_pairs(drawn.pairs, drawn.camera).unwrap())

    assert [one.label for one in maps] == ["5 m", "20 m", "60 m"]
    assert all(one.contours and all(line.label.endswith(" px") for line in one.contours) for one in maps)
    assert "extrapolated" in maps[2].words
    assert "extrapolated" not in maps[0].words
