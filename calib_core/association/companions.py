"""Companions: an object that stands behind the reflector at every placement, such as the cart that carries it.

It appears and leaves with the reflector, and it may echo more, so neither amplitude nor novelty tells which of the two was
clicked. Both get nearly the same score, and the geometry of all pairs decides. The nearer one is preferred a little: what
stands in front of a reflector hides it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, frozen_array
from calib_core.association.alternatives import alternative_rows
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.measurements import Candidate, Pair
from calib_core.radar import direction_cosines

_LEAST_SCORE = 0.05  # relative to the best of the pair
_LEAST_PAIRS = 4
_LEAST_SHARE = 0.6  # of the pairs
_SAME_OFFSET_M = 0.25
_LEAST_OFFSET_M = 0.3
_MOST_OFFSET_M = 4.0
_MOST_ASIDE = 4.0  # steps in u: behind the reflector, not next to it
_NEARER = 1.5  # how much more plausible the nearer one is, in each pair


@dataclass(frozen=True, slots=True, eq=False)
class Companion:
    """Two returns that stand at the same distance from each other in most pairs.

    Attributes:
        offset_m: range of the farther one minus that of the nearer one.
        near: (n,) the nearer candidate of each pair; -1 where the two were not found.
        far: (n,) the farther one.
    """

    offset_m: float
    near: Indices
    far: Indices

    def __post_init__(self) -> None:
        for name in ("near", "far"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (len(self.near),), dtype=np.int64))


@dataclass(frozen=True, slots=True)
class _Offset:
    """The range from a nearer candidate to a farther one of the same pair."""

    offset_m: float
    near: int
    far: int


def find_companion(pairs: Sequence[Pair]) -> Companion | None:
    """Find the offset in range at which most pairs have a second plausible candidate; None if there is none.

    Args:
        pairs: with all their candidates, as the radar gave them or as a calibration kept them.
    """
    found = [_offsets(pair.candidates) for pair in pairs]
    offsets = np.array([one.offset_m for own in found for one in own])
    owner = np.array([i for i, own in enumerate(found) for _ in own], dtype=np.int64)
    if not len(offsets):
        return None
    close = np.abs(offsets[:, None] - offsets) <= _SAME_OFFSET_M
    counts = [len(np.unique(owner[row])) for row in close]
    most = int(np.argmax(counts))
    if counts[most] < max(_LEAST_PAIRS, _LEAST_SHARE * len(pairs)):
        return None
    offset_m = float(np.median(offsets[close[most]]))
    near, far = np.full(len(pairs), -1), np.full(len(pairs), -1)
    for i, own in enumerate(found):
        best = min(own, key=lambda one: abs(one.offset_m - offset_m), default=None)
        if best is not None and abs(best.offset_m - offset_m) <= _SAME_OFFSET_M:
            near[i], far[i] = best.near, best.far
    return Companion(offset_m, near, far)


def _offsets(candidates: Sequence[Candidate]) -> list[_Offset]:
    """Return the offsets between the best candidate and every other plausible one behind or in front of it."""
    cosines = direction_cosines(np.array([one.position_radar_m for one in candidates]))
    scores = np.array([one.score for one in candidates])
    best = int(np.argmax(scores))
    rows = []
    for k in np.flatnonzero(scores >= _LEAST_SCORE * scores[best]).tolist():
        behind_m, aside = cosines[k, :2] - cosines[best, :2]
        if _LEAST_OFFSET_M <= abs(behind_m) <= _MOST_OFFSET_M and abs(aside) <= _MOST_ASIDE * CLUSTER_SCALE[1]:
            near, far = (best, k) if behind_m > 0 else (k, best)
            rows.append(_Offset(abs(float(behind_m)), near, far))
    return rows


def balanced_pairs(pairs: Sequence[Pair]) -> tuple[Pair, ...]:
    """Give the reflector and its companion, if there is one, nearly the same score in every pair.

    Args:
        pairs: one per click; the scores of the two keep their sum.
    """
    companion = find_companion(pairs)
    if companion is None:
        return tuple(pairs)
    return tuple(
        pair if near < 0 else replace(pair, candidates=_balanced(pair.candidates, near, far))
        for pair, near, far in zip(pairs, companion.near.tolist(), companion.far.tolist(), strict=True)
    )


def _balanced(candidates: tuple[Candidate, ...], near: int, far: int) -> tuple[Candidate, ...]:
    """Divide the scores of two candidates between them; the alternatives of each share what it gets."""
    alternatives = alternative_rows([one.alternative_of for one in candidates])
    both = sum(candidates[k].score for k in {*alternatives[near].tolist(), *alternatives[far].tolist()})
    scores: dict[int, float] = {}
    for k, share in ((far, 1.0 / (1.0 + _NEARER)), (near, _NEARER / (1.0 + _NEARER))):
        scores |= dict.fromkeys(alternatives[k].tolist(), both * share / len(alternatives[k]))
    balanced = [replace(one, score=scores.get(k, one.score)) for k, one in enumerate(candidates)]
    return tuple(sorted(balanced, key=lambda one: -one.score))
