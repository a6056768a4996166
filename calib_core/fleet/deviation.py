"""How far one mounting is from the others of its kind: one test over six degrees of freedom, and its quantiles.

An estimate may be farther out if its covariance was itself estimated: the quantiles are those of Hotelling's T2.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array
from calib_core.fleet.random_effects import RandomEffects

DIMENSIONS = 6
FALSE_RATE = 1e-4
"""How often a sound calibration is named by one test: the point beyond which a change or a vehicle is."""

_WHOLE = 5.0
_MOST_OF_FREEDOM = 0.8
_AXES = ("camera forward", "camera left", "camera up", "roll", "pitch", "yaw")
_MOST_FREEDOM = 1e7
_NAMED, _MOST_NAMED = 3.0, 3
_TO_SHOWN = np.array([100.0] * 3 + [180.0 / np.pi] * 3)


@dataclass(frozen=True, slots=True, eq=False)
class Deviation:
    """A mounting compared with what the others predict of it.

    Attributes:
        coordinates: (6,) from their mean: camera forward, left, up [m], roll, pitch, yaw [rad], in the radar's axes.
        covariance: (6, 6) that is expected: scatter, uncertainty of the mean, and of this mounting's calibration.
        squared: squared Mahalanobis distance.
        limit: what it is below in all but 1 of 10,000 sound cases.
        probability: of a distance this large in a sound case.
    """

    coordinates: Values
    covariance: Matrix66
    squared: float
    limit: float
    probability: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "coordinates", frozen_array(self.coordinates, (6,)))
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))

    @property
    def is_beyond(self) -> bool:
        """Whether it is beyond the 1-in-10,000 point."""
        return self.squared > self.limit

    @property
    def text(self) -> str:
        """The axes that stand out, at least the largest, each with what is expected to scatter: "yaw 4.2 deg (± 0.4)"."""
        sigma = np.sqrt(np.diag(self.covariance))
        order = np.argsort(-np.abs(self.coordinates / sigma), kind="stable")[:_MOST_NAMED].tolist()
        named = [axis for axis in order if abs(self.coordinates[axis]) >= _NAMED * sigma[axis]] or order[:1]
        shown = [(axis, self.coordinates[axis] * _TO_SHOWN[axis], sigma[axis] * _TO_SHOWN[axis]) for axis in named]
        return ", ".join(
            f"{_AXES[axis]} {_figure(value, '+')} {'cm' if axis < 3 else 'deg'} (± {_figure(spread)})"
            for axis, value, spread in shown
        )


def _figure(value: float, sign: str = "") -> str:
    """Return two digits, or all before the point."""
    return f"{value:{sign}.2g}" if abs(value) < 99.5 else f"{value:{sign}.0f}"


def deviation(effects: RandomEffects, vector: Values, covariance: Matrix66, *, freedom: float) -> Deviation:
    """Compare one mounting with the distribution of others.

    The expected covariance is a sum of an estimated scatter (Hotelling's T2 with the degrees of freedom that the others give it)
    and of the calibration's own (6 F(6, nu) with those of its noise level); Satterthwaite's rule gives those of the sum.

    Args:
        effects: of the others.
        vector: (6,) coordinates of this one.
        covariance: (6, 6) of its calibration, in these coordinates.
        freedom: degrees of freedom of that.
    """
    away, predicted = vector - effects.mean, effects.covariance
    total = predicted + covariance
    squared = float(away @ np.linalg.solve(total, away))
    share = float(np.trace(np.linalg.solve(total, predicted))) / DIMENSIONS
    nu = 1.0 / (share**2 / min(effects.freedom, _MOST_FREEDOM) + (1.0 - share) ** 2 / freedom)
    whole = min(_WHOLE * share, _MOST_OF_FREEDOM * nu)
    limit = quantile(1.0 - FALSE_RATE, nu, whole=whole)
    return Deviation(away, total, squared, limit, tail(squared, nu, whole=whole))


def quantile(probability: float, freedom: float, *, whole: float = 0.0) -> float:
    """Return what a squared distance is below with a probability: nu p / (nu - k) F(p, nu - k), p = 6.

    Args:
        probability: 0 to 1.
        freedom: nu, degrees of freedom of the covariance, more than k.
        whole: k, how much of the covariance's shape had to be estimated: 0 if only its level (then it is 6 F(6, nu)), 5 if all of
            it (then it is Hotelling's T2).
    """
    from scipy.special import fdtri

    nu = min(freedom, _MOST_FREEDOM)
    return float(nu * DIMENSIONS / (nu - whole) * fdtri(DIMENSIONS, nu - whole, probability))


def tail(squared: float, freedom: float, *, whole: float = 0.0) -> float:
    """Return the probability that a squared distance is exceeded; the arguments are those of `quantile`."""
    from scipy.special import fdtr, fdtrc

    nu = min(freedom, _MOST_FREEDOM)
    value = squared * (nu - whole) / (nu * DIMENSIONS)
    return (
        float(fdtrc(DIMENSIONS, nu - whole, value)) if value > 1.0 else 1.0 - float(fdtr(DIMENSIONS, nu - whole, value))
    )
