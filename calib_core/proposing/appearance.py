"""The look of the reflector that a person confirmed, found again in the images of other dwells."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Vector2, freeze
from calib_core.camera import Camera
from calib_core.proposing.apex import Apex, find_apex
from calib_core.proposing.dwell_views import DwellView, width_seen_px, with_blobs
from calib_core.proposing.image_candidates import ImageCandidate, full_image
from calib_core.proposing.still_images import FrameSource

_HALF = 0.75
"""Half the side of the patch, in widths of the reflector."""
_DISC = 0.62
"""Radius of the disc around the centre that is compared, in widths."""
_REACH = 0.7
"""How far from a candidate the look is searched, in widths."""
_FINER = 4.0
_ROUGH_WIDTH_PX, _FINE_WIDTH_PX = 24.0, 64.0
"""How wide a reflector is at most when candidates are compared roughly, and then at most four times finer than recorded."""
_REFINED = 4
_APART = 0.3
"""Widths between two candidates at least."""
_CLICK_SIGMA_PX = 1.0
_SNAP, _LEAST_SNAP_PX = 0.1, 2.0
"""How far from a click an apex is still what was clicked, in widths."""
_AGREES = 0.2
"""How far from where the look is found an apex is still the same, in widths."""
_LEAST_LIKENESS = 0.3
_STRENGTH, _APEX = 0.1, 0.1
"""What the strongest change, and an apex, add to a likeness when candidates are ranked."""
_CARRIED_PX, _CARRIED = 0.5, 0.05
"""Standard deviation of a place found by its look: in pixels, and in widths where nothing is alike."""


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """What the reflector looks like around the pixel that a person confirmed.

    Attributes:
        patch: (n, n, 3) uint8 of the full image; its middle pixel is nearest to the confirmed one.
        offset_px: (2,) from that middle to the confirmed pixel.
        width_px: of the reflector there.
        sigma_px: of the confirmed pixel per axis.
        at_apex: whether it is where three sheets meet, so that the apex is what to look for elsewhere.
        larger: how many times wider than thought the reflector is: elsewhere, too.
    """

    patch: np.ndarray
    offset_px: Vector2
    width_px: float
    sigma_px: float
    at_apex: bool
    larger: float = 1.0

    def __post_init__(self) -> None:
        freeze(self, offset_px=(2,))


def appearance_of(view: DwellView, frames: FrameSource, pixel_px: Vector2) -> Appearance | None:
    """Take the look of the reflector at a confirmed pixel; None if no frame of the dwell can be read.

    Args:
        view: of the dwell.
        frames: of the camera.
        pixel_px: (2,) confirmed.
    """
    import cv2

    image = full_image(view.clear, frames)
    if image is None:
        return None
    pixel_px = np.asarray(pixel_px, dtype=np.float64)
    width_px = width_seen_px(view, pixel_px)
    reach_px = max(_LEAST_SNAP_PX, _SNAP * width_px)
    apex = find_apex(image, pixel_px, reach_px=reach_px, size_px=width_px)
    at_apex = isinstance(apex, Apex)
    at_px, sigma_px = (apex.pixel_px, apex.sigma_px) if isinstance(apex, Apex) else (pixel_px, _CLICK_SIGMA_PX)
    middle = np.round(at_px)
    side = 2 * max(4, int(np.ceil(_HALF * width_px)) + 2) + 1
    patch = cv2.getRectSubPix(image, (side, side), (float(middle[0]), float(middle[1])))
    return Appearance(patch, at_px - middle, width_px, sigma_px, at_apex, width_px / view.width_px)


def with_appearance(
    views: Sequence[DwellView], looks: Sequence[Appearance], frames: FrameSource, camera: Camera
) -> tuple[DwellView, ...]:
    """Find the look again near the candidates of each view, the most alike first.

    Args:
        views: of all dwells.
        looks: of the confirmed reflectors; without any the views stay as they are.
        frames: of the camera.
        camera: its intrinsics; candidates outside its image are left out.
    """
    if not looks:
        return tuple(views)
    return tuple(_looked_at(view, looks, frames, camera) for view in views)


def likeness_elsewhere(look: Appearance, views: Sequence[DwellView], frames: FrameSource, camera: Camera) -> float:
    """Return how alike the more similar half of dwells shows the thing, at the sizes that follow from their ranges.

    Args:
        look: of a click.
        views: of other dwells; those without images show nothing.
        frames: of the camera.
        camera: its intrinsics.
    """
    found = with_appearance([view for view in views if view.candidates], [look], frames, camera)
    likeness = sorted(
        (max((candidate.likeness for candidate in view.candidates), default=0.0) for view in found), reverse=True
    )
    return float(np.mean(likeness[: (len(likeness) + 1) // 2])) if likeness else 0.0


def _looked_at(view: DwellView, looks: Sequence[Appearance], frames: FrameSource, camera: Camera) -> DwellView:
    """Compare all candidates roughly, and refine those most alike; of another width than thought, they are found again."""
    larger = float(np.median([look.larger for look in looks]))
    if larger != 1.0 and view.change.size:
        view = with_blobs(replace(view, width_px=larger * view.width_px))
    image = full_image(view.clear, frames) if view.candidates else None
    if image is None:
        return replace(view, candidates=())
    look = min(looks, key=lambda one: _unlike_in_size(one, view.width_px))
    least = min(1.0, _ROUGH_WIDTH_PX / view.width_px)
    rough = [replace(one, likeness=_match(image, one, look, view.width_px, least)[0]) for one in view.candidates]
    rough.sort(key=lambda one: -one.likeness)
    candidates: list[ImageCandidate] = []
    size_px = np.array([camera.width_px, camera.height_px])
    for index, candidate in enumerate(rough):
        moved = _moved(image, candidate, look, view.width_px) if index < _REFINED else candidate
        inside = bool(((moved.pixel_px > -0.5) & (moved.pixel_px < size_px - 0.5)).all())
        if inside and all(
            np.hypot(*(moved.pixel_px - other.pixel_px)) > _APART * view.width_px for other in candidates
        ):
            candidates.append(moved)
    strongest = max((one.strength for one in candidates), default=1.0)
    candidates.sort(key=lambda one: -(one.likeness + _STRENGTH * one.strength / strongest + _APEX * one.has_apex))
    return replace(view, candidates=tuple(candidates))


def _unlike_in_size(look: Appearance, width_px: float) -> float:
    """Return how badly a look suits a size: a larger one shows more than a smaller one."""
    ratio = float(np.log(look.width_px / width_px))
    return ratio if ratio >= 0.0 else -2.0 * ratio


def _match(
    image: np.ndarray, candidate: ImageCandidate, look: Appearance, width_px: float, fine: float
) -> tuple[float, Vector2]:
    """Return how alike a look is near a candidate, at the scale of its range and `fine` times finer, and where it is most."""
    import cv2

    half = max(3, int(np.ceil(_HALF * width_px * fine)))
    middle_px = np.array(look.patch.shape[1::-1]) // 2 + look.offset_px
    template = _resampled(look.patch, middle_px, half, width_px * fine / look.width_px)
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    disc = (np.hypot(x, y) <= _DISC * width_px * fine).astype(np.float32)
    reach = int(np.ceil(_REACH * width_px * fine))
    around = _resampled(image, candidate.pixel_px, half + reach, fine)
    scores = cv2.matchTemplate(around, template, cv2.TM_CCOEFF_NORMED, mask=np.repeat(disc[..., None], 3, axis=2))
    scores[~np.isfinite(scores)] = -1.0
    _, likeness, _, peak = cv2.minMaxLoc(scores)
    return min(likeness, 1.0), candidate.pixel_px + (np.array(peak) - reach) / fine


def _moved(image: np.ndarray, candidate: ImageCandidate, look: Appearance, width_px: float) -> ImageCandidate:
    """Move a candidate to where the look is found, and on to an apex there that may be what was clicked."""
    likeness, found_px = _match(image, candidate, look, width_px, min(_FINER, _FINE_WIDTH_PX / width_px))
    carried_px = look.sigma_px * width_px / look.width_px
    sigma_px = float(np.hypot(carried_px, _CARRIED_PX + _CARRIED * width_px * (1.0 - likeness)))
    reach_px = max(_LEAST_SNAP_PX, _AGREES * width_px) if look.at_apex else min(2.0 * sigma_px, _AGREES * width_px)
    if likeness >= _LEAST_LIKENESS:
        if candidate.has_apex and float(np.hypot(*(candidate.pixel_px - found_px))) <= reach_px:
            return replace(candidate, likeness=likeness)
        apex = find_apex(image, found_px, reach_px=reach_px, size_px=width_px)
        if isinstance(apex, Apex):
            at_px, sigma_px = apex.pixel_px, apex.sigma_px
            return replace(candidate, pixel_px=at_px, sigma_px=sigma_px, likeness=likeness, has_apex=True)
    return replace(candidate, pixel_px=found_px, sigma_px=sigma_px, likeness=likeness, has_apex=False)


def _resampled(image: np.ndarray, centre_px: Vector2, half: int, finer: float) -> np.ndarray:
    """Return what lies around a pixel, `finer` times finer: (2 half + 1, 2 half + 1, 3) float32."""
    import cv2

    reach = int(np.ceil(half / finer)) + 4
    middle = np.round(centre_px)
    part = cv2.getRectSubPix(image, (2 * reach + 1, 2 * reach + 1), (float(middle[0]), float(middle[1])))
    part = part.astype(np.float32)
    if finer < 1.0:
        part = cv2.GaussianBlur(part, (0, 0), max(0.01, 0.35 * np.sqrt(1.0 / finer**2 - 1.0)))
    begin = reach + np.asarray(centre_px) - middle - half / finer
    move = np.array([[1.0 / finer, 0.0, begin[0]], [0.0, 1.0 / finer, begin[1]]])
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(part, move, (2 * half + 1, 2 * half + 1), flags=flags, borderMode=cv2.BORDER_REPLICATE)
