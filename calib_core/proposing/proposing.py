"""From dwell views, and what a person confirmed so far, to proposals."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Points2
from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.proposing.candidate_rays import CandidateRays, candidate_rays
from calib_core.proposing.chance import Chance, chance_of
from calib_core.proposing.dwell_views import DwellView
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.proposing.pose_agreement import (
    PoseAgreement,
    mounting_prior,
    pose_agreement,
    reflector_log_odds,
)
from calib_core.proposing.proposals import Proposal, Proposals, Slip

LEAST_CONFIDENCE = 0.5
"""What is less probably the reflector is not proposed."""
_WEAK, _UNSURE = 0.8, 0.9
"""A proposal of less confidence comes with a reason, and with one if its apex is not seen."""
_TEMPER = 1.6
"""By how much log-odds were too large in simulated recordings, where dwells share errors that the model does not know."""
_LIKE_A_CLICK = 0.8
"""How far a likeness to what a person clicked is trusted without a pose."""
_SLIPS, _SLIP_PX, _UNREPORTED = 0.05, 50.0, 0.15
"""Share of the clicks that slip off the reflector, by how far, and share of those on one that the radar does not report."""
_MORE_LIKELY = 0.5
_FEW_DWELLS = 5
_FAR_SIGMA = 3.5
_SAME_PLACE = 3.0
"""Standard deviations between two candidates that are one place."""
_VAGUE_PX = 3.0
_VAGUE = "corner blurred"
_NO_FRAME = "no camera frame of it"
_NO_CHANGE = "no change of the reflector's size"
_NO_POSE = "image and radar agree on no pose yet; click the first two placements yourself"
_OPEN = "more clicks will help"
_A_PERSON = "it may be a person; if it is the reflector, click two placements yourself"
_ELSEWHERE = "no change where the other placements expect it"
_TWO_PLACES = "two spots are about as likely"
_TAKEN = "the only likely spot is another reflector's"
_FEW = "too few placements to compare"
_TWO_POSES = "another mounting fits nearly as well"
_CHANCE = "chance would do nearly as well; a click will tell"
_UNLIKELY = "what changed does not look like the reflector"


def proposals_of(
    views: Sequence[DwellView],
    camera: Camera,
    options: CalibrationOptions,
    *,
    confirmed: Sequence[ReflectorClick] = (),
    chance: Chance | None = None,
) -> Proposals:
    """Rank what the images show for each dwell; what is probably wrong is not proposed.

    Args:
        views: of all placements.
        camera: the intrinsics.
        options: of the calibration; nominal mounting and measured camera position are used.
        confirmed: clicks that a person placed or accepted so far; each covers its dwell.
        chance: how far it goes, if that is known already.
    """
    if not views:
        return Proposals(())
    clicks = [click for click in confirmed if click.counts]
    rays = candidate_rays(views, camera, options, confirmed=clicks)
    prior = mounting_prior(options, is_flat=rays.is_flat)
    agreement = pose_agreement(rays, prior)
    by_look = rays.of_dwells(rays.odds) if (rays.click >= 0).any() else None
    if chance is None:
        chance = chance_of(views, camera, options, confirmed=clicks)
    if chance is not None and agreement is not None:
        # deals are compared roughly: what full images do not repeat was chance
        chance = replace(chance, score=min(chance.score, agreement.score))
    rays = rays.at_first()
    judged = _Judged.of(views, rays, agreement, by_look, chance)
    covered, slips = _clicks_by_dwell(rays, judged, clicks, camera)
    marks = [(views[i].placement, clicks[row]) for i, rows in covered.items() for row in rows]
    ranked: list[Proposal] = []
    unproposed: list[tuple[Placement, str]] = []
    for i, view in enumerate(views):
        if i in covered:
            continue
        proposal = judged.proposal(i)
        if proposal is None:
            unproposed.append((view.placement, judged.reason(i)))
        elif (marked := _marked(proposal, view, marks)) is None:
            ranked.append(proposal)
        else:
            range_m = np.linalg.norm(marked.position_radar_m)
            unproposed.append((view.placement, f"its place is marked already, at the placement of {range_m:.1f} m"))
    ranked.sort(key=lambda one: (-one.confidence, one.placement.start))
    return Proposals(tuple(ranked), tuple(unproposed), agreement, chance, judged.reflectors, slips)


def _clicks_by_dwell(
    rays: CandidateRays, judged: "_Judged", clicks: Sequence[ReflectorClick], camera: Camera
) -> tuple[dict[int, list[int]], tuple[Slip, ...]]:
    """Return the dwells with the rows of their confirmed clicks: each click is of the one of its dwells that it suits best.

    If something else there is probably the reflector, the click slipped off it, or is of none: the radar shows another one then.
    """
    covered: dict[int, list[int]] = {}
    slips = []
    for row, click in enumerate(clicks):
        dwells, which = np.nonzero(rays.click == row)
        if not len(dwells):
            continue
        fits = judged.probability[dwells, which] + 1e-6 * rays.odds[dwells, which]
        dwell = int(dwells[np.argmax(fits)])
        others = np.where(rays.click[dwell] < 0, judged.probability[dwell], 0.0)
        if others.max() >= LEAST_CONFIDENCE:
            pixel_px = judged.candidate(dwell, int(np.argmax(others))).pixel_px
            off_px = float(np.hypot(*(pixel_px - [click.u_px, click.v_px])))
            if not _is_slip(off_px, camera):
                continue
            slips.append(Slip(click.id, off_px))
        covered.setdefault(dwell, []).append(row)
    return covered, tuple(slips)


def _is_slip(off_px: float, camera: Camera) -> bool:
    """Return whether a click so far from the reflector is more probably meant for it than for another one, anywhere."""
    density = np.exp(-0.5 * (off_px / _SLIP_PX) ** 2) / (2.0 * np.pi * _SLIP_PX**2)
    return bool(_SLIPS * density > _UNREPORTED / (camera.width_px * camera.height_px))


def _marked(proposal: Proposal, view: DwellView, own: Sequence[tuple[Placement, ReflectorClick]]) -> Placement | None:
    """Return the placement at the same time with a click on the proposed place: the radar saw one reflector twice."""
    for placement, click in own:
        apart_px = np.hypot(*(proposal.pixel_px - [click.u_px, click.v_px]))
        overlaps = placement.start <= view.placement.end and view.placement.start <= placement.end
        if overlaps and apart_px <= 0.5 * view.width_px:
            return placement
    return None


@dataclass(frozen=True, slots=True, eq=False)
class _Judged:
    """The dwells with the probability of each candidate.

    Attributes:
        views: of all placements.
        rays: their candidates, each at its first position.
        agreement: the pose; None if there is none.
        probability: (n, k) of each candidate, the pose's own probability included.
        trusted: probability that the pose is right, and that reflectors stood there.
        reflectors: the second of these alone.
        taken: (n, k) candidates that show what another dwell of the same time chose.
    """

    views: Sequence[DwellView]
    rays: CandidateRays
    agreement: PoseAgreement | None
    probability: Points2
    trusted: float
    reflectors: float
    taken: np.ndarray

    @classmethod
    def of(
        cls,
        views: Sequence[DwellView],
        rays: CandidateRays,
        agreement: PoseAgreement | None,
        by_look: Points2 | None,
        chance: Chance | None,
    ) -> "_Judged":
        """Weigh the candidates by the pose of all dwells, as far as it is trusted, and by their likeness to what was clicked."""
        from scipy.special import expit

        trusted, reflectors, probability = 0.0, 1.0, np.zeros_like(rays.odds)
        if agreement is not None and chance is not None:
            trusted = agreement.pose_probability * chance.probability
            if by_look is None:
                reflectors = float(expit(reflector_log_odds(views, agreement)))
                trusted *= reflectors if reflectors >= _MORE_LIKELY else 0.0
            probability = trusted * agreement.probability
        if by_look is not None:
            probability = probability + (1.0 - trusted) * _LIKE_A_CLICK * by_look * _compared_with_click(views, rays)
        probability = _tempered(probability)
        taken = _taken_by_others(views, rays, probability)
        sure = np.where(taken, 0.0, probability)
        return cls(views, rays, agreement, sure, trusted, reflectors, taken)

    def proposal(self, i: int) -> Proposal | None:
        """Propose the most probable candidate of a dwell; None if it is probably wrong."""
        view, probability = self.views[i], self.probability[i]
        order = [k for k in np.argsort(-probability, kind="stable").tolist() if self._is_candidate(i, k)]
        if not order or probability[order[0]] < LEAST_CONFIDENCE:
            return None
        candidates = tuple(self.candidate(i, k) for k in order)
        confidence = round(float(min(probability[order[0]], 1.0)), 9)  # as many digits as any processor gives
        best = candidates[0]
        is_vague = best.sigma_px > _VAGUE_PX or (confidence < _UNSURE and not best.has_apex)
        reason = self.reason(i) if confidence < _WEAK else _VAGUE if is_vague else ""
        return Proposal(view.placement, view.image_time, best.pixel_px, best.sigma_px, confidence, candidates, reason)

    def candidate(self, i: int, k: int) -> ImageCandidate:
        """Return the candidate of a column, which is no click."""
        return self.views[i].candidates[k - int((self.rays.click[i] >= 0).sum())]

    def _is_candidate(self, i: int, k: int) -> bool:
        """Return whether a column is one of the view's candidates, not a click or padding."""
        return bool(self.rays.odds[i, k] > 0.0 and self.rays.click[i, k] < 0)

    def reason(self, i: int) -> str:
        """Say why a dwell's most probable candidate is not certain, as a clause."""
        view, odds = self.views[i], self.rays.odds[i]
        if not view.candidates:
            return _NO_CHANGE if len(view.frames) else _NO_FRAME
        if self.taken[i].any() and self.probability[i].max() < LEAST_CONFIDENCE:
            return _TAKEN
        if self.reflectors < _MORE_LIKELY:
            return _A_PERSON
        if self.agreement is None or self.trusted < _MORE_LIKELY:
            return self._without_pose()
        if self.agreement.off_sigma[i][odds > 0.0].min(initial=np.inf) > _FAR_SIGMA:
            return _ELSEWHERE
        ranked = np.sort(self.agreement.probability[i])[::-1]
        if len(ranked) > 1 and ranked[1] > 0.5 * ranked[0]:
            return _TWO_PLACES
        of_pose = _CHANCE if self.agreement.pose_probability >= _WEAK else _TWO_POSES
        return _UNLIKELY if self.trusted >= _UNSURE else of_pose

    def _without_pose(self) -> str:
        if (self.rays.click >= 0).any():
            return _OPEN
        return _NO_POSE if len(self.rays) >= _FEW_DWELLS else _FEW


def _tempered(probability: Points2) -> Points2:
    """Return probabilities as they were borne out, nearer to one half."""
    from scipy.special import expit, logit

    return np.asarray(expit(logit(np.minimum(probability, 1.0 - 1e-6)) / _TEMPER))


def _compared_with_click(views: Sequence[DwellView], rays: CandidateRays) -> np.ndarray:
    """Return which candidates (n, k) were compared with what a person clicked."""
    alike = np.zeros(rays.odds.shape, dtype=np.bool_)
    for i, view in enumerate(views):
        first = int((rays.click[i] >= 0).sum())
        alike[i, first : first + len(view.candidates)] = [
            np.isfinite(candidate.likeness) for candidate in view.candidates
        ]
    return alike & (rays.odds > 0.0)


def _taken_by_others(views: Sequence[DwellView], rays: CandidateRays, probability: Points2) -> np.ndarray:
    """Return which candidates (n, k) are the place of another dwell at the same time, to which it belongs more probably."""
    taken = np.zeros(rays.odds.shape, dtype=np.bool_)
    order = np.argsort(-probability.max(axis=1), kind="stable").tolist()
    for index, i in enumerate(order):
        free = np.where(taken[i], 0.0, probability[i])
        k = int(np.argmax(free))
        if free[k] < LEAST_CONFIDENCE:
            continue
        for j in order[index + 1 :]:
            one, other = views[i].placement, views[j].placement
            if one.start < other.end and other.start < one.end:
                off = np.linalg.norm(rays.rays[j] - rays.rays[i, k], axis=1)
                taken[j] |= off < _SAME_PLACE * np.hypot(rays.sigma_rad[j], rays.sigma_rad[i, k])
    return taken
