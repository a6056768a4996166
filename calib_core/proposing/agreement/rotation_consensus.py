"""Rotation consensus: the mountings on which picture candidates of many dwells and the radar's directions agree.

Camera and radar stand close to each other, so directions nearly suffice: two dwells with a candidate each give a rotation, and
a rotation is as good as it explains the other dwells. All such rotations near the nominal mounting are tried.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, Values, frozen_array
from calib_core.proposing.agreement.candidate_rays import CandidateRays
from calib_core.proposing.agreement.mounting_prior import MOST_TURNED_RAD, MountingPrior

_MOST_PAIRED = 600
"""Candidates of which any two give a rotation; of more, so many are drawn by their odds."""
_MOST_TRIED = 6000
_MOST_PREDICTIONS = 1_000_000
"""Rotations times candidates that are compared."""
_LEAST_APART_RAD = np.radians(3.0)
"""Between two dwells that are to give a rotation."""
_TOLERANCE = 3.0
"""Standard deviations by which the angle between two candidates may differ from that between their dwells."""
_ROUGH = 1.6
"""Factor on the radar's standard deviations for a rotation that rests on two dwells."""
_LEVER_M = 0.1
"""What a rotation alone leaves of the lever arm, as a standard deviation."""
_SAME_RAD, _OTHER_RAD = np.radians(1.2), np.radians(4.0)
"""Between the better half of the rotations that are returned, and between the others."""


@dataclass(frozen=True, slots=True, eq=False)
class Rotations:
    """The rotations that agree with the most dwells, the best first.

    Attributes:
        rotations: (m, 3, 3) camera from radar.
        centres_radar_m: (m, 3) the camera's position that goes with each.
        scores: (m,) logarithms of how much better each explains the candidates than chance.
        tried: how many were compared.
    """

    rotations: np.ndarray
    centres_radar_m: np.ndarray
    scores: Values
    tried: int

    def __post_init__(self) -> None:
        m = len(self.scores)
        for name, shape in (("rotations", (m, 3, 3)), ("centres_radar_m", (m, 3)), ("scores", (m,))):
            object.__setattr__(self, name, frozen_array(getattr(self, name), shape))


def rotation_consensus(rays: CandidateRays, prior: MountingPrior, *, most: int = 24, seed: int = 0) -> Rotations:
    """Find the rotations that explain the most dwells; none if no two dwells agree within the mounting's reach.

    Args:
        rays: of all dwells.
        prior: of the mounting.
        most: how many to return.
        seed: of the choice of two-dwell rotations where there are too many to try all.
    """
    found: list[Rotations] = []
    for centre in prior.starts_m:
        rotations = _from_two_dwells(rays, prior, centre, np.random.default_rng(seed))
        scores = _scores(rays, prior, centre, rotations)
        kept = _best_apart(rotations, scores, most)
        found.append(Rotations(rotations[kept], np.tile(centre, (len(kept), 1)), scores[kept], len(rotations)))
    scores = np.concatenate([one.scores for one in found])
    order = np.argsort(-scores, kind="stable")[:most]
    return Rotations(
        np.concatenate([one.rotations for one in found])[order],
        np.concatenate([one.centres_radar_m for one in found])[order],
        scores[order],
        sum(one.tried for one in found),
    )


def _directions(rays: CandidateRays, centre: np.ndarray) -> np.ndarray:
    away = rays.positions_radar_m - centre
    return np.asarray(away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6))


def _from_two_dwells(
    rays: CandidateRays, prior: MountingPrior, centre: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the rotations (h, 3, 3) that two candidates of two dwells give, those within the mounting's reach."""
    directions = _directions(rays, centre)
    dwell, which = np.nonzero(rays.odds > 0.0)
    if len(dwell) > _MOST_PAIRED:
        odds = rays.odds[dwell, which]
        drawn = np.sort(rng.choice(len(dwell), _MOST_PAIRED, replace=False, p=odds / odds.sum()))
        dwell, which = dwell[drawn], which[drawn]
    one, other = np.triu_indices(len(dwell), 1)
    apart_rad = np.arccos(np.clip(directions @ directions.T, -1.0, 1.0))
    wide = apart_rad[dwell[one], dwell[other]] > _LEAST_APART_RAD
    one, other = one[wide], other[wide]
    seen = rays.rays[dwell, which]
    seen_rad = np.arccos(np.clip((seen[one] * seen[other]).sum(axis=1), -1.0, 1.0))
    range_m = rays.polar[dwell, 0]
    slack = _TOLERANCE * (np.hypot(*rays.sigma_polar[dwell, 1:].T) + prior.centre_sigma_m[1] / np.maximum(range_m, 1.0))
    agree = np.abs(seen_rad - apart_rad[dwell[one], dwell[other]]) < slack[one] + slack[other]
    one, other = one[agree], other[agree]
    rotations = _frames(seen[one], seen[other]) @ np.swapaxes(
        _frames(directions[dwell[one]], directions[dwell[other]]), 1, 2
    )
    cosine = 0.5 * (np.einsum("hij,ij->h", rotations, prior.rotation) - 1.0)
    near = np.flatnonzero(cosine > np.cos(MOST_TURNED_RAD))
    most = min(_MOST_TRIED, max(_MOST_PREDICTIONS // len(dwell), 500)) if len(dwell) else 0
    if len(near) > most:
        odds = rays.odds[dwell, which]
        likely = odds[one[near]] * odds[other[near]]
        near = rng.choice(near, most, replace=False, p=likely / likely.sum())
    return np.asarray(rotations[near])


def _frames(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return right-handed axes (h, 3, 3), as columns, that two directions (h, 3) each define symmetrically."""
    middle, across = one + other, np.cross(one, other)
    middle = middle / np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
    across = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
    return np.stack([middle, across, np.cross(middle, across)], axis=-1)


def _scores(rays: CandidateRays, prior: MountingPrior, centre: np.ndarray, rotations: np.ndarray) -> Values:
    """Return the log-odds (h,) of each rotation over chance, with tolerances that do not depend on it."""
    directions = _directions(rays, centre)
    scaled = rays.slopes * rays.sigma_polar[:, None, :] / np.maximum(rays.polar[:, 0], 1e-3)[:, None, None]
    across = np.einsum("nkai,ij,njl->nkal", rays.tangents, prior.rotation, scaled) * _ROUGH
    lever_rad = _LEVER_M / np.maximum(rays.polar[:, 0], 0.3)
    own = rays.sigma_rad**2 + lever_rad[:, None] ** 2
    covariance = across @ np.swapaxes(across, -1, -2) + own[..., None, None] * np.eye(2)
    whitening = np.linalg.inv(np.linalg.cholesky(covariance))
    height = np.linalg.det(whitening) / (2.0 * np.pi)
    turned = np.einsum("hij,nj->hni", rotations, directions)
    rows = whitening @ rays.tangents
    forward = np.einsum("hni,nki->hnk", turned, rays.rays)
    off = np.einsum("hni,nkai->hnka", turned, rows)
    gain = rays.odds * height / rays.density
    near = np.where(forward > 0.5, np.exp(-0.5 * (off**2).sum(axis=-1)), 0.0)
    return np.log(rays.missing + (gain * near).sum(axis=-1)).sum(axis=-1)


def _best_apart(rotations: np.ndarray, scores: Values, most: int) -> Indices:
    """Return the rows of the best rotations: half of them close together, to refine; half far apart, to compare with."""
    kept: list[int] = []
    angle_rad = np.full(len(scores), np.inf)
    for row in np.argsort(-scores, kind="stable").tolist():
        if angle_rad[row] < (_SAME_RAD if len(kept) < most // 2 else _OTHER_RAD):
            continue
        kept.append(row)
        if len(kept) == most:
            break
        cosine = 0.5 * (np.einsum("hij,ij->h", rotations, rotations[row]) - 1.0)
        angle_rad = np.minimum(angle_rad, np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.array(kept, dtype=np.int64)
