"""How far out an estimate may be if its covariance was itself estimated: quantiles of Hotelling's T2 in six dimensions."""

DIMENSIONS = 6
FALSE_RATE = 1e-4
"""How often a sound calibration is named by one test: the point beyond which a change or a vehicle is."""

_MOST_FREEDOM = 1e7


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
