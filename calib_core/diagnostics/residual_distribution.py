"""How long residuals should be under the noise model: the expected distribution behind a histogram of them."""

import numpy as np

from calib_core.arrays import Values

_ANGLES = 180


def expected_shares(covariances_px2: np.ndarray, edges_px: Values) -> Values:
    """Return the share (m,) of residuals that should be in each bin, if each is normal with its own covariance.

    A residual of covariance S is longer than d with probability

        P(d) = 1 / (2 pi sqrt(det S)) * integral over the directions w of exp(-d^2 w^T S^-1 w / 2) / (w^T S^-1 w).

    The pairs' own pull on the pose, which shortens residuals a little, is not taken out.

    Args:
        covariances_px2: (n, 2, 2) of the residuals; at least one, all finite.
        edges_px: (m + 1,) of the bins, ascending; the last may be infinite.
    """
    angles = np.arange(_ANGLES) * np.pi / _ANGLES  # opposite directions are alike
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    weights = np.einsum("ai,nij,aj->na", directions, np.linalg.inv(covariances_px2), directions)
    density = 1.0 / (weights * np.sqrt(np.linalg.det(covariances_px2))[:, None])
    squares = np.asarray(edges_px, dtype=np.float64)[:, None, None] ** 2
    longer = (density * np.exp(-0.5 * squares * weights)).mean(axis=(1, 2))
    return np.asarray(-np.diff(longer))
