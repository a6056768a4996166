"""Alternatives: some radars report two azimuths for a return and cannot tell which is true; at most one of the two is.

Both are clusters, dwells and candidates of their own, but they are one reflector: what one pair takes at one azimuth, no
other may take at the other, and they are one placement.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Flags, Indices
from calib_core.measurements import RadarScans

_LEAST_SHARE = 0.25  # of the larger one's returns: a third azimuth may take half of them, and noise some


def return_keys(scans: RadarScans) -> Indices:
    """Return a number (n,) for each return that its alternatives share, and no other return of any scan; -1 without any."""
    if scans.alternative_of is None:
        return np.full(len(scans.points_radar_m), -1, dtype=np.int64)
    width = int(scans.alternative_of.max(initial=-1)) + 1
    return np.where(scans.alternative_of >= 0, scans.scan_of_return() * width + scans.alternative_of, -1)


def first_rows(keys: Indices) -> Flags:
    """Return which returns (n,) the radar lists first among their alternatives: the likeliest, if it orders them at all."""
    first = keys < 0
    first[np.unique(keys, return_index=True)[1]] = True
    return first


def cluster_alternatives(window: RadarScans, cluster_of: Indices, count: int) -> Indices:
    """Number the clusters (count,) of a window: equal numbers are alternatives of each other, -1 has none.

    Args:
        window: the returns around one click.
        cluster_of: (n,) the cluster of each return; -1 where it is in none.
        count: of clusters.
    """
    labels = np.full(count, -1, dtype=np.int64)
    keys = return_keys(window)
    rows = np.flatnonzero((keys >= 0) & (cluster_of >= 0))
    if not len(rows):
        return labels
    known, place = np.unique(keys[rows], return_inverse=True)
    shown = np.zeros((count, len(known)), dtype=np.float32)
    shown[cluster_of[rows], place] = 1.0
    common = shown @ shown.T
    sizes = np.diagonal(common)
    return joined_labels((common >= _LEAST_SHARE * np.maximum(sizes[:, None], sizes)) & (common > 0))


def joined_labels(linked: Flags) -> Indices:
    """Number the sets (n,) that links (n, n) join, directly or through others; -1 is linked to no other."""
    labels = np.full(len(linked), -1, dtype=np.int64)
    first, second = np.nonzero(np.triu(linked | linked.T, 1))
    for one, other in zip(first.tolist(), second.tolist(), strict=True):
        known = [int(label) for label in (labels[one], labels[other]) if label >= 0]
        label = min(known) if known else int(labels.max()) + 1
        for old in known:
            labels[labels == old] = label
        labels[[one, other]] = label
    return labels


def alternative_rows(labels: Sequence[int]) -> list[Indices]:
    """Return for each entry the rows (k,) of its alternatives, its own included."""
    known = np.asarray(labels, dtype=np.int64)
    return [
        np.flatnonzero(known == label) if label >= 0 else np.array([row]) for row, label in enumerate(known.tolist())
    ]
