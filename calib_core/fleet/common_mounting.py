"""The mounting that most vehicles are near, and how far each is from it: a robust start, before anything is estimated."""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Values
from calib_core.fleet.mounting_coordinates import coordinates, pose_from_coordinates
from calib_core.geometry import RigidTransform

_STEPS = 30
_MEDIAN_CHI2_3 = 2.365973884375338
_LEAST_SPREAD = 1e-6  # m and rad
_BLOCKS = (slice(0, 3), slice(3, 6))


def common_mounting(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Return the geometric median of poses: positions and rotations each in units of their median distance.

    Args:
        poses: camera_from_radar of at least one vehicle.
    """
    centre = _central(poses)
    for _ in range(2):  # coordinates are straight lines only near their origin
        vectors = np.array([coordinates(one, centre) for one in poses])
        centre = pose_from_coordinates(_geometric_median(vectors), centre)
    return centre


def robust_distances(vectors: np.ndarray, covariances: np.ndarray) -> Values:
    """Return squared distances (n,) from the origin: the scatter by the median length of positions and of rotations.

    Args:
        vectors: (n, 6) coordinates relative to the common mounting.
        covariances: (n, 6, 6) of each.
    """
    total = covariances + np.diag(np.repeat(_spreads(vectors) ** 2 / _MEDIAN_CHI2_3, 3))
    return np.asarray(np.einsum("ni,ni->n", vectors, np.linalg.solve(total, vectors[..., None])[..., 0]))


def _central(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Return the one of the poses with the smallest sum of distances to the others, in radians plus metres."""
    rotations = np.array([one.rotation for one in poses])
    positions_m = np.array([one.inverse().translation_m for one in poses])
    flat = rotations.reshape(len(poses), 9)
    angles_rad = np.arccos(np.clip((flat @ flat.T - 1.0) / 2.0, -1.0, 1.0))
    distances_m = np.linalg.norm(positions_m[:, None] - positions_m[None], axis=2)
    return poses[int(np.argmin((angles_rad + distances_m).sum(axis=1)))]


def _spreads(vectors: np.ndarray) -> np.ndarray:
    lengths = np.array([np.median(np.linalg.norm(vectors[:, block], axis=1)) for block in _BLOCKS])
    return np.maximum(lengths, _LEAST_SPREAD)


def _geometric_median(vectors: np.ndarray) -> Values:
    """Return the point (6,) with the smallest sum of distances to vectors (n, 6), by Weiszfeld's iteration."""
    median = np.zeros(6)
    for _ in range(_STEPS):
        away = vectors - median
        scaled = away / np.repeat(_spreads(away), 3)
        weights = 1.0 / np.maximum(np.linalg.norm(scaled, axis=1), 1e-3)
        median = weights @ vectors / weights.sum()
    return np.asarray(median)
