"""Automatic clicks: the proposals taken as they are, if image and radar agree far beyond chance; otherwise none."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.camera import Camera
from calib_core.measurements import Facts, ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing.candidate_rays import candidate_rays
from calib_core.proposing.dwell_views import DwellView
from calib_core.proposing.mounting_prior import mounting_prior
from calib_core.proposing.pose_agreement import chance_score, chance_scores, pose_agreement, reflector_log_odds
from calib_core.proposing.proposals import Proposal, Proposals

LEAST_WHOLE_CONFIDENCE = 0.9
"""Below this nothing is clicked."""
LEAST_SCORE = 25.0
"""Least score of the pose: logarithm of how much better than chance it explains the candidates.

Set on simulated recordings of development: of 650 pairs of one recording's radar and another's images the best reached 22.
Pairs drawn later with the threshold as it is are not independent of these, as they repeat the same 40 recordings;
benchmarks/proposing/accuracy.md has those of recordings that nobody had looked at.
"""
_MARGIN, _MARGIN_STEP = 2.0, 1.0
"""Score beyond what chance can reach and beyond the rival at which a pose is as probably right as not, and how fast that
changes. Of 800 later pairs of the same recordings the best reached -8.8, the worst recording 20."""
_MOST_CONFIDENCE = 0.99
"""What some hundred simulated recordings without an error can show at most."""
_RIVAL_SHARE = 0.25
"""Share of its score by which a pose must be better than its rival: residuals alone make a difference of a fifth."""
_LEAST_CLICKS = 6
_LEAST_CLICK_CONFIDENCE = 0.9
_LEAST_DWELLS = 5


@dataclass(frozen=True, slots=True)
class AutomaticClicks:
    """Clicks that nobody confirmed.

    Attributes:
        clicks: one per placement that is certain enough, in order of time, with mark "snapped".
        confidence: probability that they are the reflector's, as a whole.
        agreement: how this is known: `certain` of so many `placements` fit one mounting, with a `score` that chance reaches up to
            `by_chance` and another mounting as `rival`.
    """

    clicks: tuple[ReflectorClick, ...]
    confidence: float
    agreement: Facts


def automatic_clicks(
    proposals: Proposals, views: Sequence[DwellView], camera: Camera, options: CalibrationOptions
) -> AutomaticClicks | Unsolvable:
    """Take the proposals as clicks, if image and radar agree so well that a person is hardly needed.

    Args:
        proposals: of these views, with nothing confirmed.
        views: of all placements.
        camera: the intrinsics.
        options: as the proposals were made with.
    """
    if len(views) < _LEAST_DWELLS:
        return _refused("few-placements", placements=len(views))
    rays = candidate_rays(views, camera, options)
    prior = mounting_prior(options, is_flat=rays.is_flat)
    agreement = pose_agreement(rays, prior)
    if agreement is None:
        return _refused("no-mounting")
    if reflector_log_odds(views, agreement) < 0.0:
        return _refused("no-apex")
    chance = max(chance_score(chance_scores(rays, prior)), LEAST_SCORE)
    rival = agreement.rival_score + _RIVAL_SHARE * agreement.score
    beyond = agreement.score - max(chance, rival)
    confidence = _MOST_CONFIDENCE / (1.0 + float(np.exp(-np.clip((beyond - _MARGIN) / _MARGIN_STEP, -50.0, 50.0))))
    certain = [one for one in proposals.ranked if one.confidence >= _LEAST_CLICK_CONFIDENCE]
    scores = {"score": agreement.score, "by_chance": chance, "rival": agreement.rival_score}
    if confidence < LEAST_WHOLE_CONFIDENCE:
        return _refused("rival" if rival > chance else "chance", confidence=confidence, **scores)
    counts = {"certain": len(certain), "placements": len(views)}
    if len(certain) < _LEAST_CLICKS:
        return _refused("few-certain", needed=_LEAST_CLICKS, **counts)
    clicks = tuple(_click(one, number) for number, one in enumerate(sorted(certain, key=lambda one: one.image_time), 1))
    return AutomaticClicks(clicks, confidence, {**counts, **scores})


def _refused(why: str, **facts: float) -> Unsolvable:
    return Unsolvable("not-confident", {"why": why, **facts})


def _click(proposal: Proposal, number: int) -> ReflectorClick:
    u_px, v_px = proposal.pixel_px.tolist()
    return ReflectorClick(
        proposal.image_time, f"automatic-{number:02d}", u_px, v_px, sigma_px=proposal.sigma_px, mark="snapped"
    )
