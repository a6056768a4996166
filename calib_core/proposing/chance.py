"""How far chance goes, measured on the recording itself, and the width that what stood in its dwells has in common.

Chance is what wrong deals reach: each dwell is shown the images of another time and looks there for what has the reflector's
width at its own range, with the same prior of the mounting. Where several widths are tried, the deals try them all, so that
looking at many is paid for. A click stays in its dwell, and its look with what shows it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Values, freeze
from calib_core.camera import Camera
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.proposing.candidate_rays import apart_in_time, candidate_rays
from calib_core.proposing.dwell_views import DwellView, with_blobs, with_seen_apexes
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.proposing.pose_agreement import mounting_prior, refined_poses, rotation_consensus
from calib_core.proposing.still_images import FrameSource

OTHER_WIDTHS = (0.71, 1.41, 2.0, 2.83)
"""Over the width that is thought of, from small trihedrals to boards around them; a blob is found at a fifth more or less."""
_WIDTH_STEP = 1.15
"""Factor between the widths at which an image is searched."""
_DEALS, _DRAWN = 40, 2000
"""Deals that are compared, and how many are drawn to find so many without a dwell that stays at its time."""
_GUMBEL = 0.78
"""Scale of the best of many poses by chance, in its standard deviations (Gumbel's distribution of maxima)."""
_SIGMAS, _SIGMAS_CLICKED = 4.0, 2.0
"""Standard deviations above the mean at which agreement is as probably chance as not. By chance, a recording goes there in one
case of 300, exp(-(4 / 0.78 + 0.58)), and in one of 20 where a person vouches that a reflector is seen."""
_LEAST_SPREAD = 2.0
"""Standard deviation of the deals at least: of few deals it is hardly known."""
_SAMPLED = 1.1
"""How much wider the spread is where there are more deals than are compared, so that it is an estimate: quantile of Student's
distribution with 39 degrees of freedom at one case in 300, over the normal one, times sqrt(41 / 39)."""
_TRIED, _REFINED = 400, 2
"""Rotations that are compared, and how many of them are refined: only the score counts."""


@dataclass(frozen=True, slots=True, eq=False)
class Chance:
    """How well images and radar agree on a mounting, and how well they do in wrong deals.

    Attributes:
        wider: the width at which they agree best, over the width that was thought of.
        score: logarithm of how much better the best pose explains the dwells than chance, at any width.
        by_chance: (d,) the same of wrong deals; none where no two dwells can be exchanged.
        is_clicked: a person clicked one of the dwells at least.
    """

    wider: float
    score: float
    by_chance: Values
    is_clicked: bool

    def __post_init__(self) -> None:
        freeze(self, by_chance=(None,))

    @property
    def bound(self) -> float:
        """The score at which the agreement is as probably chance as not."""
        if not len(self.by_chance):
            return float("inf")
        return float(self.by_chance.mean()) + (_SIGMAS_CLICKED if self.is_clicked else _SIGMAS) * self._spread

    @property
    def probability(self) -> float:
        """Probability that the agreement is no chance."""
        from scipy.special import expit

        return float(expit((self.score - self.bound) / (_GUMBEL * self._spread))) if len(self.by_chance) else 0.0

    @property
    def _spread(self) -> float:
        sampled = _SAMPLED if len(self.by_chance) >= _DEALS else 1.0
        return max(sampled * float(self.by_chance.std()), _LEAST_SPREAD)


def chance_of(
    views: Sequence[DwellView],
    camera: Camera,
    options: CalibrationOptions,
    *,
    confirmed: Sequence[ReflectorClick] = (),
    widths: Sequence[float] = (1.0,),
    known: Chance | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> Chance | None:
    """Find how well the dwells agree on one mounting, and how well wrong deals do; None if it is stopped.

    Args:
        views: of all placements, at least one; those without a change map, or compared with a click, keep their candidates.
        camera: the intrinsics.
        options: of the calibration.
        confirmed: clicks that count.
        widths: that are tried, over the width that was thought of.
        known: the same at widths that were tried before.
        stopped: asked before each deal.
    """
    views = sorted(views, key=lambda view: (view.placement.start, view.placement.end))
    search = _Search(views, camera, options, confirmed, widths, {})
    wider, score = search.best(np.arange(len(views)))
    by_chance = np.array([search.best(images)[1] for images in _deals(apart_in_time(views)) if not stopped()])
    if stopped():
        return None
    found = Chance(wider, score, by_chance, bool(confirmed))
    if known is None:
        return found
    return replace(max(known, found, key=lambda one: one.score), by_chance=np.maximum(known.by_chance, by_chance))


def at_width(view: DwellView, frames: FrameSource, wider: float) -> DwellView:
    """Return a view with the candidates of another width; the same one if it has no change map.

    Args:
        view: of a dwell.
        frames: of the camera.
        wider: that width over the one that was thought of.
    """
    if not view.change.size:
        return view
    return with_seen_apexes(with_blobs(replace(view, width_px=wider * view.width_px)), frames)


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """The views, and the candidates of each of their images at the widths that were asked for by now."""

    views: Sequence[DwellView]
    camera: Camera
    options: CalibrationOptions
    confirmed: Sequence[ReflectorClick]
    widths: Sequence[float]
    known: dict[tuple[int, int], tuple[ImageCandidate, ...]]

    def best(self, images: Indices) -> tuple[float, float]:
        """Return the width at which the dwells agree best with images (n,) of these rows, and the score of the best pose."""
        return max(((wider, self._score(images, wider)) for wider in self.widths), key=lambda found: found[1])

    def _score(self, images: Indices, wider: float) -> float:
        dealt = [self._seen(row, image, wider) for row, image in enumerate(images.tolist())]
        rays = candidate_rays(dealt, self.camera, self.options, confirmed=self.confirmed)
        prior = mounting_prior(self.options, is_flat=rays.is_flat)
        rough = rotation_consensus(rays, prior, most=_REFINED, tried=_TRIED)
        nothing = float(np.log(rays.missing).sum())
        return float(refined_poses(rays, prior, rough).scores.max()) if len(rough) else nothing

    def _seen(self, row: int, image: int, wider: float) -> DwellView:
        """Return a dwell with what has the width at its range in the image of a dwell."""
        view, shown = self.views[row], self.views[image]
        if not shown.change.size or any(np.isfinite(candidate.likeness) for candidate in shown.candidates):
            return replace(view, candidates=shown.candidates)
        width_px = wider * view.width_px
        step = round(np.log(width_px) / np.log(_WIDTH_STEP))
        if (image, step) not in self.known:
            self.known[image, step] = with_blobs(replace(shown, width_px=_WIDTH_STEP**step), rough=True).candidates
        return replace(view, width_px=width_px, candidates=self.known[image, step])


def _deals(apart: Flags) -> list[Indices]:
    """Return different deals of the images (n,), each to dwells of other times; those do not overlap in `apart` (n, n)."""
    n = len(apart)
    drawn = np.random.default_rng(0).random((_DRAWN, n)).argsort(axis=1)
    wrong = drawn[apart[np.arange(n), drawn].all(axis=1)]
    first = np.sort(np.unique(wrong, axis=0, return_index=True)[1])
    return list(wrong[first[:_DEALS]])
