"""Lines of equal uncertainty in the image, with their labels: marching squares over an uncertainty map."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from calib_core.arrays import Values
from calib_core.diagnostics.uncertainty_map import MAP_DISTANCES_M, uncertainty_map
from calib_core.results import Calibration
from cocalib.view.wording import plain

_MOST_LEVELS = 6
_STEPS = (1.0, 2.0, 5.0, 10.0)
_SERIES = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
_WIDE = 4.0
"""From this ratio of the largest to the smallest value on, levels grow by factors instead of equal steps."""
_DECIMALS_PX = 1

_Edge: TypeAlias = tuple[bool, int, int]
"""An edge of the grid: whether it runs along a row, then row and column of its first corner."""


@dataclass(frozen=True, slots=True)
class Contour:
    """One line of equal uncertainty.

    Attributes:
        label: for display, with its unit.
        points_px: (u, v) along the line.
    """

    label: str
    points_px: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class ContourMap:
    """Where points at one distance may appear.

    Attributes:
        label: of the distance, such as "20 m".
        words: the same in one or two sentences.
        contours: in order of their levels; empty if the uncertainty is unknown, or nearly the same everywhere.
    """

    label: str
    words: str
    contours: tuple[Contour, ...]


def contour_maps(calibration: Calibration) -> tuple[ContourMap, ...]:
    """Return the maps for 5, 20 and 60 m."""
    used = [np.linalg.norm(pair.point_radar_m) for pair in calibration.pairs if pair.inlier]
    farthest_m = float(max(used)) if used else float("nan")
    return tuple(_contour_map(calibration, distance_m, farthest_m) for distance_m in MAP_DISTANCES_M)


def _contour_map(calibration: Calibration, distance_m: float, farthest_m: float) -> ContourMap:
    found = uncertainty_map(calibration, distance_m)
    known = found.semi_major_px[np.isfinite(found.semi_major_px)]
    label = f"{distance_m:g} m"
    if not len(known):
        return ContourMap(label, "This method states no uncertainty, so there is nothing to draw.", ())
    lines = tuple(
        Contour(f"{level:g} px", line)
        for level in _levels(float(known.min()), float(known.max()))
        for line in contour_lines(found.columns_px, found.rows_px, found.semi_major_px, level)
    )
    words = (
        f"A point {label} away appears within {plain(known.min(), 2)} px of its drawn place where the image is surest, "
        f"and within {plain(known.max(), 2)} px at worst (95 %, pose only)."
    )
    if distance_m > farthest_m:
        words += f" The farthest pair is at {plain(farthest_m)} m: this is extrapolated."
    return ContourMap(label, words, lines)


def _levels(low_px: float, high_px: float) -> list[float]:
    """Return round levels between two values, at most six."""
    if not 0.0 < low_px < high_px:
        return []
    if high_px < _WIDE * low_px:
        power = 10.0 ** np.floor(np.log10((high_px - low_px) / _MOST_LEVELS))
        step_px = next(step * power for step in _STEPS if (high_px - low_px) / (step * power) <= _MOST_LEVELS)
        steps = range(int(low_px / step_px) + 1, int(np.ceil(high_px / step_px)))
        return [round(step * step_px, 6) for step in steps]
    powers = range(int(np.floor(np.log10(low_px))), int(np.ceil(np.log10(high_px))) + 1)
    levels = [step * 10.0**power for power in powers for step in _SERIES if low_px < step * 10.0**power < high_px]
    return levels[:: -(-len(levels) // _MOST_LEVELS)]


def contour_lines(
    columns: Values, rows: Values, heights: np.ndarray, level: float
) -> Iterator[tuple[tuple[float, float], ...]]:
    """Yield the lines on which a function on a grid has a value, interpolated along the edges of the cells.

    Args:
        columns: (c,) of the grid.
        rows: (r,) of the grid.
        heights: (r, c) values; cells with NaN at a corner are left out.
        level: the value.
    """
    links = _links(heights, level)
    starts = sorted(
        links, key=lambda edge: (len(links[edge]) != 1, edge)
    )  # open lines from their ends, then closed ones
    for start in starts:
        edge: _Edge | None = start if links[start] else None
        line = []
        while edge is not None:
            line.append(_crossing(edge, columns, rows, heights, level))
            following = links[edge].pop() if links[edge] else None
            if following is not None:
                links[following].remove(edge)
            edge = following
        if len(line) > 1:
            yield tuple(line)


def _links(heights: np.ndarray, level: float) -> dict[_Edge, list[_Edge]]:
    """Return which crossed edges a line connects, cell by cell; each link is in both of its edges."""
    above = heights > level
    corners = np.stack([heights[:-1, :-1], heights[:-1, 1:], heights[1:, 1:], heights[1:, :-1]])
    mixed = np.stack([above[:-1, :-1], above[:-1, 1:], above[1:, 1:], above[1:, :-1]])
    crossed = np.isfinite(corners).all(axis=0) & mixed.any(axis=0) & ~mixed.all(axis=0)
    links: dict[_Edge, list[_Edge]] = defaultdict(list)
    for row, column in zip(*(places.tolist() for places in np.nonzero(crossed)), strict=True):
        around = mixed[:, row, column].tolist()
        edges = [(True, row, column), (False, row, column + 1), (True, row + 1, column), (False, row, column)]
        cut = [edges[side] for side in range(4) if around[side] != around[(side + 1) % 4]]
        if len(cut) == 4 and (corners[:, row, column].mean() > level) != around[0]:
            cut = [cut[3], cut[0], cut[1], cut[2]]  # a saddle whose middle belongs to the other two corners
        for first, second in zip(cut[::2], cut[1::2], strict=True):
            links[first].append(second)
            links[second].append(first)
    return links


def _crossing(edge: _Edge, columns: Values, rows: Values, heights: np.ndarray, level: float) -> tuple[float, float]:
    """Return where a line crosses an edge."""
    along_row, row, column = edge
    next_row, next_column = (row, column + 1) if along_row else (row + 1, column)
    here, there = heights[row, column], heights[next_row, next_column]
    share = (level - here) / (there - here)
    u = columns[column] + share * (columns[next_column] - columns[column])
    v = rows[row] + share * (rows[next_row] - rows[row])
    return round(float(u), _DECIMALS_PX), round(float(v), _DECIMALS_PX)
