"""Chance agreement: how well a recording's dwells agree on a mounting when the radar's positions are dealt to other dwells.

What is dealt wrongly cannot agree, but for chance; how far chance goes depends on how many dwells and candidates there are, how
they gather and how coarse the radar is, and this measures it on the recording itself. Neighbours in time are exchanged too, as
whoever carries a reflector down an aisle would be taken for right by the order alone.
"""

import numpy as np

from calib_core.arrays import Indices, Values
from calib_core.proposing.agreement.candidate_rays import CandidateRays
from calib_core.proposing.agreement.mounting_prior import MountingPrior
from calib_core.proposing.agreement.pose_agreement import pose_agreement

_DEALS = 16
_SHIFTS = (1, -1, 2, -2)
_REFINED = 8
_SIGMAS = 4.0
"""Standard deviations above the mean that chance reaches in about one of 10,000 recordings."""


def chance_scores(rays: CandidateRays, prior: MountingPrior, *, seed: int = 0) -> Values:
    """Return the scores (d,) of the best poses for wrong deals of the radar's positions; at least three dwells are needed."""
    n = len(rays)
    rng = np.random.default_rng(seed)
    deals = [_deal(rng, n) for _ in range(_DEALS)]
    deals += [np.roll(np.arange(n), shift) for shift in _SHIFTS if shift % n]
    found = (pose_agreement(rays.with_radar_of(rows), prior, most=_REFINED) for rows in deals)
    return np.array([0.0 if one is None else one.score for one in found])


def chance_score(scores: Values) -> float:
    """Return the score that chance hardly exceeds: beyond all deals, and beyond their spread."""
    return float(max(scores.max(), scores.mean() + _SIGMAS * scores.std()))


def _deal(rng: np.random.Generator, n: int) -> Indices:
    """Draw a permutation that leaves nothing in its place."""
    while True:
        rows = rng.permutation(n)
        if (rows != np.arange(n)).all():
            return np.asarray(rows)
