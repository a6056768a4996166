"""Views that are mirror images of each other: copies of one picture, one of them with left and right exchanged."""

import numpy as np
from scipy.spatial import cKDTree

from calib_core.arrays import Values
from calib_core.intrinsics.solving.view_stack import ViewStack

_COPY_SHARE = (
    0.7  # of the residuals; corners of two pictures taken apart differ by 1.4 times these, those of copies by less
)
_LEAST_COPY_PX = 0.05
_FARTHEST_PX = 2.0
_LEAST_APART_PX = 2.0


def mirror_twins(stack: ViewStack, typical_px: float) -> tuple[tuple[int, int], ...]:
    """Return the pairs of views whose corners coincide once left and right are exchanged.

    Views that hardly differ from their own mirror image are no pair: which of them is mirrored does not matter.

    Args:
        stack: the views, with whatever ids their corners have: a mirrored board is often read in another order.
        typical_px: root mean square of the residuals of good views.
    """
    corners = [stack.pixels_px[row][:, stack.weights[row] > 0].T for row in range(len(stack))]
    mirrored = [np.array([stack.size_px[0] - 1.0, 0.0]) + points * [-1.0, 1.0] for points in corners]
    largest = max(_COPY_SHARE * typical_px, _LEAST_COPY_PX)
    pairs = []
    for first, points in enumerate(corners):
        for second in range(first + 1, len(corners)):
            if not len(points) or len(points) != len(corners[second]):
                continue
            if np.abs(points.mean(axis=0) - mirrored[second].mean(axis=0)).max() > _FARTHEST_PX:
                continue
            apart = _distances_px(points, mirrored[second])
            alike = apart.max() <= _FARTHEST_PX and float(np.sqrt(np.mean(apart**2))) <= largest
            if alike and _distances_px(points, corners[second]).max() > _LEAST_APART_PX:
                pairs.append((first, second))
    return tuple(pairs)


def _distances_px(points: Values, others: Values) -> Values:
    """Return the distance (n,) of each point (n, 2) to the nearest of the others (m, 2)."""
    return np.asarray(cKDTree(others).query(points)[0])
