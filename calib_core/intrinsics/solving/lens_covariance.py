"""How well lens and board shape are known, if the errors of corners in one view belong together."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from calib_core.arrays import Values, frozen_array
from calib_core.intrinsics.solving.adjustment import Reduced

_NORMAL_95 = 1.959963984540054
_LEAST_FREEDOM = 1.5
_LEAST_SHARE = 0.1  # of the variance that independent corners would give


@dataclass(frozen=True, slots=True, eq=False)
class SharedCovariance:
    """The covariance of the free numbers of lens and warp.

    Attributes:
        matrix: (q, q); 1.96 standard deviations contain the truth in 95 % of cases.
        freedom: (q,) degrees of freedom with which each variance was estimated.
    """

    matrix: np.ndarray
    freedom: Values

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", frozen_array(self.matrix, (None, None)))
        object.__setattr__(self, "freedom", frozen_array(self.freedom, (None,)))

    def chances(self, values: Values, first: int = 0) -> Values:
        """Return how likely values as far from zero are, if the truth is zero: (n,).

        Args:
            values: (n,) estimates of the free numbers from one on.
            first: the number of that one.
        """
        places = slice(first, first + len(values))
        freedom = self.freedom[places]
        sigma = np.sqrt(np.diag(self.matrix)[places]) / _grown(freedom)
        return np.asarray(2.0 * stats.t.sf(np.abs(values) / np.maximum(sigma, 1e-300), freedom))


def shared_covariance(at: Reduced) -> SharedCovariance:
    """Estimate the covariance from how much the views contradict each other, not from how much their corners do.

    Errors of corners in one view belong together: blur, light, motion under a rolling shutter and the detector shift
    neighbours alike, so that counting corners would state too little. Views are independent. Their scores g_v give the
    variance of the estimate (White's sandwich over clusters), each freed of what the fit has already taken up of its own
    view (Bell and McCaffrey's CR2), and Student's quantile with their degrees of freedom accounts for the number of views.

    Args:
        at: the normal equations of each view, at the estimate.
    """
    information = at.information.sum(axis=0) + at.prior
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    values = np.maximum(values, values[-1] * 1e-15)
    white = scale[:, None] * vectors / np.sqrt(values)  # white @ white.T is the inverse of the information
    shares = white.T @ at.information @ white  # (v, q, q); they sum to one
    own, axes = np.linalg.eigh(shares)
    gains = 1.0 / np.sqrt(np.maximum(1.0 - own, 1e-3))
    freed = (axes * gains[:, None, :]) @ np.swapaxes(axes, 1, 2)  # (1 - share)^(-1/2)
    scores = (freed @ (white.T @ at.gradients.T).T[:, :, None])[:, :, 0]
    middle = _at_least(scores.T @ scores, _LEAST_SHARE * at.noise_px2)
    known = at.prior @ white
    middle = middle + known.T @ known  # what is pulled has a standard deviation of about one
    freedom = _degrees_of_freedom(white, shares, freed)
    grown = _grown(freedom)
    matrix = (white @ middle @ white.T) * np.outer(grown, grown)
    return SharedCovariance((matrix + matrix.T) / 2.0, freedom)


def _at_least(middle: np.ndarray, least: float) -> np.ndarray:
    """Return a covariance with a variance of at least so much in each direction.

    Few views leave directions in which none contradicts another, and so do views that repeat each other; that is no knowledge.
    """
    values, axes = np.linalg.eigh(middle)
    return np.asarray((axes * np.maximum(values, least)) @ axes.T)


def _grown(freedom: Values) -> Values:
    """Return the ratio of Student's quantile of 95 % to the normal one."""
    return np.asarray(stats.t.ppf(0.975, freedom) / _NORMAL_95)


def _degrees_of_freedom(white: np.ndarray, shares: np.ndarray, freed: np.ndarray) -> Values:
    """Return Satterthwaite's degrees of freedom (q,) of the variances, for errors that are alike in all corners."""
    loads = np.einsum("vab,ib->via", freed, white)  # of each view on each parameter
    mixed = np.einsum("vab,vib->via", shares, loads)
    products = -np.einsum("uia,via->iuv", mixed, mixed)
    rows = np.arange(len(shares))
    products[:, rows, rows] += np.einsum("via,via->iv", loads, mixed)
    trace = np.einsum("ivv->i", products)
    return np.asarray(np.maximum(trace**2 / np.maximum(np.square(products).sum(axis=(1, 2)), 1e-300), _LEAST_FREEDOM))
