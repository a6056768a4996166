# SPDX-License-Identifier: Apache-2.0
"""Take a radar's known errors out of the positions that it reports. Written by cocalib; copy it into your software.

    correction = RadarCorrection.read("folder of the pack")
    x, y, z = correction.corrected((8.0, 1.5, 0.4))  # one position [m]
    points = correction.corrected_array(points)  # an array (n, 3) of positions [m]; needs NumPy

Then apply the pose: p_camera = R p_radar + t. Positions are in the radar frame: x forward, y left, z up [m].
Azimuth is positive to the left, elevation is positive upwards.

`RadarCorrection.read` needs radar_correction.csv and, if that names one, the file of the angle map, in one folder.
Python 3.8 or later; only the standard library unless `corrected_array` is called.
"""

from __future__ import annotations

import csv
import math
from bisect import bisect_right
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union  # noqa: UP035 - Python 3.8 needs them


@dataclass(frozen=True)
class AngleMap:
    """Corrections to the radar's angles on a grid of directions: linear in between, constant beyond the edge.

    Attributes:
        azimuth_rad: of the columns, ascending.
        elevation_rad: of the rows, ascending.
        add_azimuth_rad: by row, then column: what to add to a measured azimuth.
        add_elevation_rad: the same for the elevation.
    """

    azimuth_rad: Sequence[float]
    elevation_rad: Sequence[float]
    add_azimuth_rad: Sequence[Sequence[float]]
    add_elevation_rad: Sequence[Sequence[float]]

    @classmethod
    def read(cls, path: Union[str, Path]) -> AngleMap:  # noqa: UP007
        """Read radar_angle_map.csv: one line for each direction of the grid, row by row.

        Raises:
            ValueError: it is not a grid of two or more rows and columns.
        """
        lines = _csv_rows(path)
        azimuth_rad = sorted({float(line["azimuth_rad"]) for line in lines})
        elevation_rad = sorted({float(line["elevation_rad"]) for line in lines})
        columns = len(azimuth_rad)
        if min(columns, len(elevation_rad)) < 2 or len(lines) != columns * len(elevation_rad):
            raise ValueError(f"{path}: not a grid of directions; copy it from the pack again")
        lines.sort(key=lambda line: (float(line["elevation_rad"]), float(line["azimuth_rad"])))
        tables = [
            [[float(line[name]) for line in lines[first : first + columns]] for first in range(0, len(lines), columns)]
            for name in ("add_azimuth_rad", "add_elevation_rad")
        ]
        return cls(azimuth_rad, elevation_rad, *tables)

    def corrected(self, point_m: Sequence[float]) -> Tuple[float, float, float]:  # noqa: UP006
        """Return a position (x, y, z) [m] with its angles corrected and its range kept."""
        range_m, azimuth_rad, elevation_rad = _polar(point_m)
        column, across = _cell(self.azimuth_rad, azimuth_rad)
        row, up = _cell(self.elevation_rad, elevation_rad)
        add_rad = []
        for table in (self.add_azimuth_rad, self.add_elevation_rad):
            lower = table[row][column] * (1.0 - across) + table[row][column + 1] * across
            upper = table[row + 1][column] * (1.0 - across) + table[row + 1][column + 1] * across
            add_rad.append(lower * (1.0 - up) + upper * up)
        return _cartesian(range_m, azimuth_rad + add_rad[0], elevation_rad + add_rad[1])

    def corrected_array(self, points_m: Any) -> Any:
        """Return positions (n, 3) [m] with their angles corrected, as a NumPy array."""
        import numpy as np

        x, y, z = np.asarray(points_m, dtype=np.float64).reshape(-1, 3).T
        range_m, azimuth, elevation = np.sqrt(x * x + y * y + z * z), np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
        columns, rows = np.asarray(self.azimuth_rad), np.asarray(self.elevation_rad)
        column = np.clip(np.searchsorted(columns, azimuth, side="right") - 1, 0, len(columns) - 2)
        row = np.clip(np.searchsorted(rows, elevation, side="right") - 1, 0, len(rows) - 2)
        across = np.clip((azimuth - columns[column]) / (columns[column + 1] - columns[column]), 0.0, 1.0)
        up = np.clip((elevation - rows[row]) / (rows[row + 1] - rows[row]), 0.0, 1.0)
        add = np.stack([self.add_azimuth_rad, self.add_elevation_rad])
        lower = add[:, row, column] * (1.0 - across) + add[:, row, column + 1] * across
        upper = add[:, row + 1, column] * (1.0 - across) + add[:, row + 1, column + 1] * across
        azimuth, elevation = np.stack([azimuth, elevation]) + lower * (1.0 - up) + upper * up
        level_m = range_m * np.cos(elevation)
        return np.stack([level_m * np.cos(azimuth), level_m * np.sin(azimuth), range_m * np.sin(elevation)], axis=1)


@dataclass(frozen=True)
class RadarCorrection:
    """What is known of a radar's errors; all zero and no map for a radar without known errors.

    Attributes:
        azimuth_scale: reported azimuth over the true one, minus 1.
        elevation_scale: the same of the elevation.
        range_bias_m: reported range minus the true one [m].
        squared_height_m2: for a radar that measures no elevation: squared height of what it sees above or below its plane.
        angle_map: None if there is none.
    """

    azimuth_scale: float = 0.0
    elevation_scale: float = 0.0
    range_bias_m: float = 0.0
    squared_height_m2: float = 0.0
    angle_map: Optional[AngleMap] = None  # noqa: UP045

    @classmethod
    def read(cls, folder: Union[str, Path] = ".") -> RadarCorrection:  # noqa: UP007
        """Read radar_correction.csv and the angle map that it names.

        Raises:
            OSError: a file cannot be read.
            ValueError: a value is missing or not a number.
        """
        path = Path(folder) / "radar_correction.csv"
        values = {line["name"]: line["value"] for line in _csv_rows(path)}
        names = ("azimuth_scale", "elevation_scale", "range_bias_m", "squared_height_m2")
        missing = [name for name in (*names, "angle_map") if name not in values]
        if missing:
            raise ValueError(f"{path}: {missing[0]} is missing; copy it from the pack again")
        map_file = values["angle_map"]
        angle_map = None if map_file == "none" else AngleMap.read(Path(folder) / map_file)
        azimuth_scale, elevation_scale, range_bias_m, squared_height_m2 = (float(values[name]) for name in names)
        return cls(azimuth_scale, elevation_scale, range_bias_m, squared_height_m2, angle_map)

    def corrected(self, reported_m: Sequence[float]) -> Tuple[float, float, float]:  # noqa: UP006
        """Return the true position (x, y, z) [m] of a reported one."""
        range_m, azimuth_rad, elevation_rad = _polar(reported_m)
        range_m -= self.range_bias_m
        if self.squared_height_m2:
            range_m = math.sqrt(max(range_m**2 - self.squared_height_m2, 0.25 * range_m**2))
        point_m = _cartesian(
            range_m, azimuth_rad / (1.0 + self.azimuth_scale), elevation_rad / (1.0 + self.elevation_scale)
        )
        return point_m if self.angle_map is None else self.angle_map.corrected(point_m)

    def corrected_array(self, reported_m: Any) -> Any:
        """Return the true positions (n, 3) [m] of reported ones, as a NumPy array."""
        import numpy as np

        x, y, z = np.asarray(reported_m, dtype=np.float64).reshape(-1, 3).T
        range_m = np.sqrt(x * x + y * y + z * z) - self.range_bias_m
        if self.squared_height_m2:
            range_m = np.sqrt(np.maximum(range_m**2 - self.squared_height_m2, 0.25 * range_m**2))
        azimuth = np.arctan2(y, x) / (1.0 + self.azimuth_scale)
        elevation = np.arctan2(z, np.hypot(x, y)) / (1.0 + self.elevation_scale)
        level_m = range_m * np.cos(elevation)
        points_m = np.stack([level_m * np.cos(azimuth), level_m * np.sin(azimuth), range_m * np.sin(elevation)], axis=1)
        return points_m if self.angle_map is None else self.angle_map.corrected_array(points_m)


def _polar(point_m: Sequence[float]) -> Tuple[float, float, float]:  # noqa: UP006
    """Return range [m], azimuth and elevation [rad]."""
    x, y, z = point_m
    return math.hypot(x, y, z), math.atan2(y, x), math.atan2(z, math.hypot(x, y))


def _cartesian(range_m: float, azimuth_rad: float, elevation_rad: float) -> Tuple[float, float, float]:  # noqa: UP006
    level_m = range_m * math.cos(elevation_rad)
    return level_m * math.cos(azimuth_rad), level_m * math.sin(azimuth_rad), range_m * math.sin(elevation_rad)


def _csv_rows(path: Union[str, Path]) -> List[Dict[str, str]]:  # noqa: UP006, UP007
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _cell(lines: Sequence[float], value: float) -> Tuple[int, float]:  # noqa: UP006
    """Return the index of the grid line below a value, and the value's share of the way to the next one, 0 to 1."""
    clamped = min(max(value, lines[0]), lines[-1])
    below = min(max(bisect_right(lines, clamped) - 1, 0), len(lines) - 2)
    return below, (clamped - lines[below]) / (lines[below + 1] - lines[below])
