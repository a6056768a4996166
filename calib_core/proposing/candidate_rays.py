"""Candidate rays: what images and radar say of each dwell, as arrays, with the odds before any pose is known."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3, Values, freeze
from calib_core.camera import Camera
from calib_core.estimation.measurement_model import OWN_SIGMA_RAD, is_flat
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.proposing.dwell_views import DwellView
from calib_core.proposing.image_candidates import ImageCandidate
from calib_core.radar import cartesian_jacobian, polar_from_cartesian

_NONE = -1.5
"""Log-odds that no candidate is the reflector, where the strongest one that has no apex counts as 0."""
_STRENGTH, _APEX = 3.0, 3.0
"""Log-odds that a candidate gains per natural logarithm of its strength, and where three sheets meet in a point."""
_ALIKE, _LIKE = 13.0, 0.58
"""Log-odds that it gains per likeness to the confirmed reflector, above the likeness that says nothing.

They are those of a fit to simulated recordings, a little less sure.
"""
_PRESENT = 0.9
"""Share of the placements that are a reflector at one of their positions: nearly all when simulated, 8 of 12 on real scenes."""
_LEAST_MISSING = 0.03
_CLICK_IS_RIGHT = 0.85
"""Probability that a confirmed click is of a dwell, shared between those of its time: a weak reflector may give none."""
_CLICKED = 0.5
"""A candidate within so many widths of a click is what was clicked."""
_LEAST_SIGMA_PX = 1.0
_REPEATED_PX = 6.0
"""Candidates of two dwells nearer than this show the same place; what moved does not stay there."""
_REPEATED_SHARE = 0.3
"""Share of the wrong candidates that lie where other dwells have one too."""


@dataclass(frozen=True, slots=True, eq=False)
class CandidateRays:
    """Dwells at each of n positions that their returns may have, and their candidates there, padded to k with odds 0.

    Attributes:
        first: (d,) the first position of each dwell; its others follow.
        positions_radar_m: (n, 3) where the radar saw each dwell.
        polar: (n, 3) the same as range [m], azimuth and elevation [rad].
        slopes: (n, 3, 3) d position / d polar.
        sigma_polar: (n, 3) standard deviations of the polar coordinates.
        rays: (n, k, 3) unit rays of the candidates in the camera frame.
        tangents: (n, k, 2, 3) two directions across each ray.
        sigma_rad: (n, k) standard deviation of each candidate across its ray.
        odds: (n, k) probability that the candidate is the reflector, and the position the true one, before any pose is known.
        missing: (d,) probability that none is.
        density: (n, k) of wrong candidates around the candidate [1 / sr].
        click: (n, k) row of the confirmed click that the candidate is; -1 for none.
        is_flat: the radar measures no elevation.
    """

    first: Indices
    positions_radar_m: Points3
    polar: Points3
    slopes: np.ndarray
    sigma_polar: Points3
    rays: np.ndarray
    tangents: np.ndarray
    sigma_rad: Points2
    odds: Points2
    missing: Values
    density: Points2
    click: Indices
    is_flat: bool

    def __post_init__(self) -> None:
        n, k = self.odds.shape
        freeze(
            self,
            positions_radar_m=(n, 3),
            polar=(n, 3),
            slopes=(n, 3, 3),
            sigma_polar=(n, 3),
            rays=(n, k, 3),
            tangents=(n, k, 2, 3),
            sigma_rad=(n, k),
            odds=(n, k),
            missing=(len(self.first),),
            density=(n, k),
        )
        freeze(self, np.int64, click=(n, k), first=(None,))

    def __len__(self) -> int:
        return len(self.missing)

    def at_first(self) -> "CandidateRays":
        """Return each dwell at its first position only."""
        of_positions = {field.name for field in fields(self)} - {"first", "missing", "is_flat"}
        values = {name: getattr(self, name)[self.first] for name in of_positions}
        return replace(self, first=np.arange(len(self)), **values)

    def of_dwells(self, values: np.ndarray) -> np.ndarray:
        """Return the sums (..., d, k) of values (..., n, k) over the positions of each dwell: at most one of them is true."""
        return np.add.reduceat(values, self.first, axis=-2)

    def of_positions(self, values: np.ndarray) -> np.ndarray:
        """Return values (..., d) of dwells at each of their positions (..., n)."""
        return np.repeat(values, np.diff(self.first, append=len(self.odds)), axis=-1)


class _Choice(NamedTuple):
    """One candidate of a dwell: a place in the image, or a confirmed click."""

    u_px: float
    v_px: float
    sigma_px: float
    odds: float
    click: int = -1


def candidate_rays(
    views: Sequence[DwellView],
    camera: Camera,
    options: CalibrationOptions,
    *,
    confirmed: Sequence[ReflectorClick] = (),
) -> CandidateRays:
    """Collect the candidates of all dwells, and what is known of them before the dwells are compared.

    Args:
        views: of all placements, at least one.
        camera: the intrinsics.
        options: noise of the radar and of clicks.
        confirmed: clicks; one that lies within several dwells is a candidate of each.
    """
    shared_by = [sum(_is_within(click, view) for view in views) for click in confirmed]
    placements = [view.placement.at_each for view in views]
    choices = [
        [one._replace(odds=one.odds * placement.likely) for one in own]
        for view, at_each in zip(views, placements, strict=True)
        for own in [_choices(view, options, confirmed, shared_by)]
        for placement in at_each
    ]
    counts = [len(at_each) for at_each in placements]
    first = np.append(0, np.cumsum(counts)[:-1])
    most = max(1, max(len(own) for own in choices))
    values = np.array([[*own, *[_Choice(0.0, 0.0, 1.0, 0.0)] * (most - len(own))] for own in choices])
    pixels, (sigma_px, odds, click) = values[..., :2], np.moveaxis(values[..., 2:], -1, 0)
    rays, radians = _rays(pixels.reshape(-1, 2), camera)
    rays, per_px = rays.reshape(*odds.shape, 3), radians.reshape(odds.shape)
    seen = np.isfinite(rays).all(axis=-1) & np.isfinite(per_px)
    rays = np.where(seen[..., None], rays, [0.0, 0.0, 1.0])
    per_px = np.where(seen, per_px, 1.0)
    odds = np.where(seen, odds, 0.0)
    positions = np.array([placement.position_radar_m for at_each in placements for placement in at_each])
    apart = np.repeat(np.repeat(apart_in_time(views), counts, axis=0), counts, axis=1)
    polar, flat = polar_from_cartesian(positions), is_flat(positions)
    return CandidateRays(
        first=first,
        positions_radar_m=positions,
        polar=polar,
        slopes=cartesian_jacobian(polar),
        sigma_polar=np.tile(_sigma_polar(options, flat=flat), (len(positions), 1)),
        rays=rays,
        tangents=_tangents(rays),
        sigma_rad=np.maximum(sigma_px, _LEAST_SIGMA_PX) * per_px,
        odds=odds,
        missing=np.maximum(1.0 - np.add.reduceat(odds.sum(axis=1), first), _LEAST_MISSING),
        density=_density(pixels, odds, apart, camera) / per_px**2,
        click=click.astype(np.int64),
        is_flat=flat,
    )


def _sigma_polar(options: CalibrationOptions, *, flat: bool) -> Values:
    noise = options.noise
    elevation_rad = OWN_SIGMA_RAD if flat else np.deg2rad(noise.sigma_elevation_deg)
    return np.array([noise.sigma_range_m, np.deg2rad(noise.sigma_azimuth_deg), elevation_rad])


def _choices(
    view: DwellView,
    options: CalibrationOptions,
    confirmed: Sequence[ReflectorClick],
    shared_by: Sequence[int],
) -> list[_Choice]:
    """Return the candidates of a dwell with their odds; a click that can belong to no other dwell is the only one."""
    clicks = [
        _Choice(
            click.u_px,
            click.v_px,
            options.noise.sigma_px if click.sigma_px is None else click.sigma_px,
            _CLICK_IS_RIGHT / shared_by[row],
            row,
        )
        for row, click in enumerate(confirmed)
        if _is_within(click, view)
    ]
    share = _PRESENT * (1.0 - min(sum(click.odds for click in clicks), _CLICK_IS_RIGHT))
    found = []
    for one, odds in zip(view.candidates, _odds(view.candidates), strict=True):
        u_px, v_px = one.pixel_px.tolist()
        clicked = any(np.hypot(u_px - own.u_px, v_px - own.v_px) <= _CLICKED * view.width_px for own in clicks)
        found.append(_Choice(u_px, v_px, one.sigma_px, 0.0 if clicked else float(share * odds)))
    return [*(click._replace(odds=click.odds / len(clicks)) for click in clicks), *found]


def _is_within(click: ReflectorClick, view: DwellView) -> bool:
    return view.placement.start <= click.image_time <= view.placement.end


def _odds(candidates: Sequence[ImageCandidate]) -> Values:
    """Return how probably each candidate is the reflector, by what the image shows (k,)."""
    if not candidates:
        return np.zeros(0)
    strength = np.array([max(candidate.strength, 1e-6) for candidate in candidates])
    likeness = np.array([candidate.likeness for candidate in candidates])
    gains = _STRENGTH * np.log(strength / strength.max()) + _APEX * np.array(
        [candidate.has_apex for candidate in candidates]
    )
    gains = np.append(gains + np.where(np.isfinite(likeness), _ALIKE * (likeness - _LIKE), 0.0), _NONE)
    weight = np.exp(gains - gains.max())
    return np.asarray(weight[:-1] / weight.sum())


def _rays(pixels: Points2, camera: Camera) -> tuple[Points3, Values]:
    """Return the unit rays (m, 3) of pixels (m, 2), and the angle (m,) of one pixel there [rad]."""
    rays = camera.rays(pixels)
    aside = [camera.rays(pixels + step) - rays for step in ([0.5, 0.0], [0.0, 0.5])]
    return rays, np.asarray(2.0 * np.sqrt(np.linalg.norm(aside[0], axis=1) * np.linalg.norm(aside[1], axis=1)))


def _tangents(rays: np.ndarray) -> np.ndarray:
    """Return two unit vectors (..., 2, 3) across each unit ray (..., 3): about right and down in the image."""
    down = np.array([0.0, 1.0, 0.0])
    right = np.cross(down, rays)
    length = np.linalg.norm(right, axis=-1, keepdims=True)
    right = np.where(length > 1e-3, right / np.maximum(length, 1e-3), [1.0, 0.0, 0.0])
    return np.stack([right, np.cross(rays, right)], axis=-2)


def apart_in_time(views: Sequence[DwellView]) -> Flags:
    """Return which dwells (n, n) do not overlap: what stands in one is gone in the other.

    Args:
        views: of all placements.
    """
    start = np.array([view.placement.start for view in views], dtype=np.int64)
    end = np.array([view.placement.end for view in views], dtype=np.int64)
    return np.asarray((start[:, None] > end) | (start > end[:, None]))


def _density(pixels: np.ndarray, odds: Points2, apart: Flags, camera: Camera) -> Points2:
    """Return how densely wrong candidates lie around each candidate (n, k) [1 / px^2].

    They are spread evenly, and repeat themselves where something flickers.
    """
    n, k = odds.shape
    squared = ((pixels[:, :, None, None] - pixels[None, None]) ** 2).sum(axis=-1)
    others = (apart[:, None, :, None] & (odds > 0.0)[None, None]).reshape(n, 1, n, k)
    kernels = np.exp(-0.5 * squared / _REPEATED_PX**2) / (2.0 * np.pi * _REPEATED_PX**2)
    repeated = (kernels * others).sum(axis=(2, 3)) / np.maximum(others.sum(axis=(2, 3)), 1)
    evenly = (1.0 - _REPEATED_SHARE) / (camera.width_px * camera.height_px)
    return np.asarray(evenly + _REPEATED_SHARE * repeated)
