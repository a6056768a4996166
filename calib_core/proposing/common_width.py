"""The width that what stood in the dwells has in common, and how far chance goes: both are measured on the recording itself.

Where the dwells agree on no mounting at the width that is thought of, others are tried. Chance is what wrong deals reach: each
dwell is shown the images of another time and looks there for what has the width at its own range, over the same widths and with
the same prior of the mounting, so that looking at many widths is paid for.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Values, freeze
from calib_core.camera import Camera
from calib_core.options import CalibrationOptions
from calib_core.proposing.candidate_rays import apart_in_time, candidate_rays
from calib_core.proposing.dwell_views import DwellView, reflector_width_px, with_blobs, with_seen_apexes
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.proposing.mounting_prior import mounting_prior
from calib_core.proposing.pose_agreement import refined_poses, rotation_consensus
from calib_core.proposing.still_images import FrameSource

_WIDTHS_M = (0.17, 0.24, 0.34, 0.47, 0.66)
"""From small trihedrals to boards around them; a blob is found at a fifth more or less than its width."""
_WIDTH_STEP = 1.15
"""Factor between the widths at which an image is searched."""
_DEALS = 20
_LEAST_DEALS = 4
"""Fewer different deals, as of three dwells, say nothing about chance."""
_SIGMAS = 4.0
"""Standard deviations above the mean that the best of many poses reaches by chance in about one of 300 recordings: by the
distribution of maxima (Gumbel's), exp(-(4 / 0.78 + 0.58))."""
_TRIED, _REFINED = 400, 2
"""Rotations that are compared about each start, and how many of them are refined: only the score counts."""


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
    def probability(self) -> float:
        """Probability that the agreement is no chance: one half where chance hardly goes, by all deals and by their spread."""
        if len(self.by_chance) < _LEAST_DEALS:
            return 0.0
        spread = max(float(self.by_chance.std()), 1.0)
        bound = max(float(self.by_chance.max()), float(self.by_chance.mean()) + _SIGMAS * spread)
        return 1.0 / (1.0 + float(np.exp(np.clip((bound - self.score) / spread, -50.0, 50.0))))


def common_width(
    views: Sequence[DwellView],
    camera: Camera,
    options: CalibrationOptions,
    *,
    stopped: Callable[[], bool] = lambda: False,
) -> CommonWidth | None:
    """Find the width at which the dwells agree best on one mounting, and how far wrong deals go; None if it is stopped.

    Args:
        views: of all placements, at least one; those without a change map keep their candidates.
        camera: the intrinsics.
        options: of the calibration.
        stopped: asked before each deal.
    """
    search = _Search(views, camera, options, {})
    width_m, score = search.best(np.arange(len(views)))
    by_chance = [search.best(images)[1] for images in _deals(views) if not stopped()]
    return None if stopped() else CommonWidth(width_m, score, np.array(by_chance))


def at_width(view: DwellView, frames: FrameSource, camera: Camera, reflector_m: float) -> DwellView:
    """Return a view with the candidates of a width; the same one if it has no change map.

    Args:
        view: of a dwell.
        frames: of the camera.
        camera: its intrinsics.
        reflector_m: the width.
    """
    if not view.change.size:
        return view
    wide = replace(view, width_px=reflector_width_px(view.placement, camera, reflector_m))
    return with_seen_apexes(with_blobs(wide), frames)


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """The views, and the candidates of each of their images at the widths that were asked for by now."""

    views: Sequence[DwellView]
    camera: Camera
    options: CalibrationOptions
    known: dict[tuple[int, int], tuple[ImageCandidate, ...]]

    def best(self, images: Indices) -> tuple[float, float]:
        """Return the width at which the dwells agree best with images (n,) of these rows, and the score of the best pose."""
        return max(((width_m, self._score(images, width_m)) for width_m in _WIDTHS_M), key=lambda found: found[1])

    def _score(self, images: Indices, reflector_m: float) -> float:
        dealt = [self._seen(row, image, reflector_m) for row, image in enumerate(images.tolist())]
        rays = candidate_rays(dealt, self.camera, self.options)
        prior = mounting_prior(self.options, is_flat=rays.is_flat)
        rough = rotation_consensus(rays, prior, most=_REFINED, tried=_TRIED)
        nothing = float(np.log(rays.missing).sum())
        return float(refined_poses(rays, prior, rough).scores.max()) if len(rough) else nothing

    def _seen(self, row: int, image: int, reflector_m: float) -> DwellView:
        """Return a dwell with what has the width at its range in the image of a dwell."""
        view, shown = self.views[row], self.views[image]
        width_px = reflector_width_px(view.placement, self.camera, reflector_m)
        step = round(np.log(width_px) / np.log(_WIDTH_STEP))
        if (image, step) not in self.known:
            wide = replace(shown, width_px=_WIDTH_STEP**step)
            self.known[image, step] = (with_blobs(wide, rough=True) if shown.change.size else shown).candidates
        return replace(view, width_px=width_px, candidates=self.known[image, step])


def _deals(views: Sequence[DwellView]) -> list[Indices]:
    """Return different deals of the images (n,), each to dwells of other times as far as there are any."""
    from scipy.optimize import linear_sum_assignment

    rng = np.random.default_rng(0)
    n, together = len(views), ~apart_in_time(views)
    orders = {tuple(linear_sum_assignment(rng.random((n, n)) + n * together)[1].tolist()) for _ in range(_DEALS)}
    return [np.array(order) for order in sorted(orders) if not together[np.arange(n), list(order)].any()]
