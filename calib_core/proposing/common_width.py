"""The width that what stood in the dwells has in common, and how far chance goes: both are measured on the recording itself.

The radar's positions are dealt to dwells of other times, neighbours among them, as whoever carries a reflector down an aisle
would be taken for right by the order alone. Every wrong deal repeats the whole search, over the same widths and with the same
prior of the mounting, so that looking at many widths is paid for. A clicked dwell keeps its position, unless too few are left.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Values, freeze
from calib_core.camera import Camera
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.proposing.candidate_rays import CandidateRays, apart_in_time, candidate_rays
from calib_core.proposing.dwell_views import DwellView, reflector_width_px, with_blobs, with_seen_apexes
from calib_core.proposing.mounting_prior import MountingPrior, mounting_prior
from calib_core.proposing.pose_agreement import quick_poses, refined_poses
from calib_core.proposing.still_images import FrameSource

REFLECTOR_M = 0.24
"""Width of the reflector [m], the paper's: it is kept if it explains at least half of what the best width does beyond chance."""
_WIDTHS_M = tuple((REFLECTOR_M * 1.2 ** np.arange(-3, 7)).tolist())
"""0.14 to 0.72 m, from small trihedrals to boards around them; a blob is found at a fifth more or less than its width."""
_DEALS = 16
_SHIFTS = (1, -1, 2, -2)
_LEAST_DEALS = 4
"""Fewer different deals, as of three dwells, say nothing about chance."""
_SIGMAS = 4.0
"""Standard deviations above the mean that the best of many poses reaches by chance in about one of 300 recordings: by the
distribution of maxima (Gumbel's), exp(-(4 / 0.78 + 0.58)). Images of other recordings reached 3.5 in 24 draws."""


@dataclass(frozen=True, slots=True, eq=False)
class CommonWidth:
    """The width at which images and radar agree best, and what wrong deals reach.

    Attributes:
        reflector_m: the width.
        score: logarithm of how much better the best pose explains the dwells than chance, at any width.
        by_chance: (d,) the same of wrong deals.
    """

    reflector_m: float
    score: float
    by_chance: Values

    def __post_init__(self) -> None:
        freeze(self, by_chance=(None,))

    @property
    def bound(self) -> float:
        """The score that chance hardly exceeds: beyond all deals, and beyond their spread; infinite if they are too few."""
        if len(self.by_chance) < _LEAST_DEALS:
            return float("inf")
        return float(max(self.by_chance.max(), self.by_chance.mean() + _SIGMAS * self.spread))

    @property
    def spread(self) -> float:
        """Standard deviation of what chance reaches, at least 1."""
        return max(float(self.by_chance.std()), 1.0) if len(self.by_chance) else 1.0

    @property
    def probability(self) -> float:
        """Probability that the agreement is no chance: one half at the bound."""
        return 1.0 / (1.0 + float(np.exp(np.clip((self.bound - self.score) / self.spread, -50.0, 50.0))))

    @property
    def is_probable(self) -> bool:
        """Whether the agreement is more probably right than chance."""
        return self.score > self.bound


def common_width(
    views: Sequence[DwellView],
    camera: Camera,
    options: CalibrationOptions,
    *,
    reflector_m: float | None = None,
    confirmed: Sequence[ReflectorClick] = (),
) -> CommonWidth:
    """Find the width at which the dwells agree best on one mounting, and how far wrong deals go.

    Args:
        views: of all placements; those without a change map keep their candidates.
        camera: the intrinsics.
        options: of the calibration.
        reflector_m: the width, if it is known.
        confirmed: clicks that count.
    """
    widths_m = _WIDTHS_M if reflector_m is None else (reflector_m,)
    views = sorted(views, key=lambda view: (view.placement.start, *view.placement.position_radar_m))
    if not any(view.change.size for view in views):
        widths_m = (REFLECTOR_M if reflector_m is None else reflector_m,)
    rays = [
        candidate_rays([_rough(view, camera, width_m) for view in views], camera, options, confirmed=confirmed)
        for width_m in widths_m
    ]
    prior = mounting_prior(options, is_flat=rays[0].is_flat)
    as_seen = np.arange(len(views))
    best, score = _best(rays, prior, as_seen)
    deals = _deals(views, np.asarray((rays[0].click >= 0).any(axis=1)))
    if len(deals) < _LEAST_DEALS:
        deals = _deals(views, np.zeros(len(views), dtype=np.bool_))
    found = CommonWidth(widths_m[best], score, np.array([_best(rays, prior, rows)[1] for rows in deals]))
    if reflector_m is None and REFLECTOR_M in widths_m:
        usual = widths_m.index(REFLECTOR_M)
        if _best(rays[usual : usual + 1], prior, as_seen)[1] > 0.5 * (score + min(found.bound, score)):
            return replace(found, reflector_m=REFLECTOR_M)
    return found


def at_width(view: DwellView, frames: FrameSource, camera: Camera, reflector_m: float) -> DwellView:
    """Return a view with the candidates of a width; the same one if that is its width, or it has no change map.

    Args:
        view: of a dwell.
        frames: of the camera.
        camera: its intrinsics.
        reflector_m: the width.
    """
    width_px = reflector_width_px(view.placement, camera, reflector_m)
    if not view.change.size or np.isclose(view.width_px, width_px):
        return view
    return with_seen_apexes(with_blobs(replace(view, width_px=width_px)), frames)


def _rough(view: DwellView, camera: Camera, reflector_m: float) -> DwellView:
    width_px = reflector_width_px(view.placement, camera, reflector_m)
    return with_blobs(replace(view, width_px=width_px), rough=True) if view.change.size else view


def _best(rays: Sequence[CandidateRays], prior: MountingPrior, rows: Indices) -> tuple[int, float]:
    """Return the width at which rough poses explain most of a deal, and the score of the best pose there."""
    dealt = [at_one_width.with_radar_of(rows) for at_one_width in rays]
    poses = [quick_poses(one, prior) for one in dealt]
    nothing = [float(np.log(one.missing).sum()) for one in dealt]
    best = int(np.argmax([own.scores.max(initial=least) for own, least in zip(poses, nothing, strict=True)]))
    if not len(poses[best]):
        return best, nothing[best]
    return best, float(refined_poses(dealt[best], prior, poses[best]).scores.max())


def _deals(views: Sequence[DwellView], stays: Flags) -> list[Indices]:
    """Return different deals of the radar's positions (n,), each to dwells of other times as far as there are any."""
    from scipy.optimize import linear_sum_assignment

    moved = np.flatnonzero(~stays)
    n = len(moved)
    together = ~apart_in_time(views)[np.ix_(moved, moved)]
    rng = np.random.default_rng(0)
    orders = [linear_sum_assignment(rng.random((n, n)) + n * together)[1] for _ in range(_DEALS)]
    orders += [np.roll(np.arange(n), shift) for shift in _SHIFTS]
    different = {tuple(order) for order in orders if not together[np.arange(n), order].any()}
    deals = []
    for order in sorted(different):
        rows = np.arange(len(views))
        rows[moved] = moved[list(order)]
        deals.append(rows)
    return deals
