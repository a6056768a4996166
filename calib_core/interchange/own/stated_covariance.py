"""The covariance of a fleet's prior in our files, checked before anything rests on it."""

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.errors import InputError
from calib_core.interchange.own.documents import Matrix66 as StatedMatrix

_SYMMETRIC = 1e-6
"""The largest difference allowed between two entries that ought to be equal, as a share of the two sigmas' product."""
_DEFINITE = 1e-12
"""The smallest eigenvalue allowed of the correlation matrix; below, its inverse is rounding."""


def stated_covariance(rows: StatedMatrix, *, source: str, place: str = "covariance") -> Matrix66:
    """Return a covariance (6, 6) of a pose, exactly symmetric.

    Args:
        rows: as the file states it.
        source: the name of the file in error messages.
        place: the key that holds it.

    Raises:
        InputError: no distribution has this covariance.
    """
    stated = np.array(rows)
    variances = np.diagonal(stated)
    if not (np.isfinite(stated).all() and (variances > 0.0).all()):
        raise InputError(
            f"{source}: {place}: a variance on the diagonal is not positive; write it in m^2 and rad^2, all six above zero"
        )
    sigma = np.sqrt(variances)
    correlation = stated / sigma[:, None] / sigma
    if np.abs(correlation - correlation.T).max() > _SYMMETRIC:
        raise InputError(f"{source}: {place}: is not symmetric; write the whole matrix, rows and columns alike")
    if np.linalg.eigvalsh(0.5 * (correlation + correlation.T))[0] < _DEFINITE:
        raise InputError(
            f"{source}: {place}: is not positive definite; its entries contradict each other, write it with all its digits"
        )
    return np.asarray(0.5 * (stated + stated.T))
