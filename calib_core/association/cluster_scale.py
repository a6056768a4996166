"""Cluster scale: how far apart two returns of one object may lie, from the scatter that a recording shows.

An object that stands still is reported in nearly every scan, so the nearest return of the next scan is most often the same
object. The differences between two such returns show the scatter of a single one, whatever the radar and the scene. Where
positions lie on the radar's bins, an object between two bins alternates between them, which the median does not show.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Points3, Values, Vector3
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.measurements import RadarScans
from calib_core.radar import direction_cosines

_LARGEST = 5.0  # times CLUSTER_SCALE
_STEPS_PER_SIGMA = 1.75  # a cluster reaches two steps, so three and a half standard deviations
_STEPS_PER_BIN = 0.6  # so that a cluster holds two neighbouring bins
_WITHIN = 8.0  # steps from a return to the same object's in the next scan
_MOST_SCANS = 200
_LEAST_SCANS = 4  # of each window
_LEAST_DIFFERENCES = 30
_MEDIAN_OF_DIFFERENCE = 0.954  # of two normal values, in their standard deviation
_ROUNDING = 0.01  # steps
_LEAST_UNCHANGED = 0.2  # share of the differences, for values on a lattice
_LEAST_CHANGES = 10


def cluster_scale(windows: Sequence[RadarScans]) -> Vector3:
    """Return one step of distance (3,) in range [m], u and w: CLUSTER_SCALE, or more for a radar that scatters more.

    Args:
        windows: the static returns of some parts of a recording, or of all of it.
    """
    most = max(_MOST_SCANS // max(len(windows), 1), _LEAST_SCANS)
    differences = np.concatenate([np.zeros((0, 3)), *(_differences(window, most) for window in windows)])
    if len(differences) < _LEAST_DIFFERENCES:
        return CLUSTER_SCALE
    scatter = np.median(differences, axis=0) / _MEDIAN_OF_DIFFERENCE
    bins = np.array([_bin_width(axis) for axis in differences.T])
    steps = np.maximum(_STEPS_PER_SIGMA * scatter, _STEPS_PER_BIN * bins)
    return np.asarray(CLUSTER_SCALE * np.clip(steps, 1.0, _LARGEST))


def report_spread(scans: RadarScans) -> Vector3 | None:
    """Return how far apart two reports of one return can lie (3,) in range [m], u and w; None if the scans do not show it.

    That is three and a half standard deviations of a single report, or a bin where positions lie on bins.

    Args:
        scans: consecutive ones; what moves between them does not count.
    """
    differences = _differences(scans, _MOST_SCANS)
    if len(differences) < _LEAST_DIFFERENCES:
        return None
    scatter = np.median(differences, axis=0) / _MEDIAN_OF_DIFFERENCE
    bins = np.array([_bin_width(axis) for axis in differences.T])
    return np.asarray(CLUSTER_SCALE * np.maximum(2.0 * _STEPS_PER_SIGMA * scatter, bins))


def _differences(static: RadarScans, most: int) -> Points3:
    """Return the differences (n, 3), in steps, between returns of neighbouring scans that are each other's nearest.

    Args:
        static: the static returns of some scans.
        most: how many scans to compare with the next one.
    """
    filled = np.flatnonzero(np.diff(static.first_return) > 0)
    earlier = filled[:-1][np.diff(filled) == 1]
    chosen = earlier[np.linspace(0, len(earlier) - 1, min(len(earlier), most)).round().astype(np.int64)]
    steps, first = direction_cosines(static.points_radar_m) / CLUSTER_SCALE, static.first_return
    found = [np.zeros((0, 3))]
    for k in chosen.tolist():
        now, later = steps[first[k] : first[k + 1]], steps[first[k + 1] : first[k + 2]]
        squared = sum(((a[:, None] - b) ** 2 for a, b in zip(now.T, later.T, strict=True)), start=np.zeros(1))
        after = squared.argmin(axis=1)
        here = np.arange(len(now))
        mutual = (squared.argmin(axis=0)[after] == here) & (squared[here, after] <= _WITHIN**2)
        found.append(np.abs(now[mutual] - later[after[mutual]]))
    return np.concatenate(found)


def _bin_width(differences: Values) -> float:
    """Return the width of the radar's bins: the usual smallest change of values that mostly do not change at all; else 0."""
    changed = differences[differences > _ROUNDING]
    unchanged = len(differences) - len(changed)
    if unchanged < _LEAST_UNCHANGED * len(differences) or len(changed) < _LEAST_CHANGES:
        return 0.0
    return float(np.quantile(changed, 0.25))
