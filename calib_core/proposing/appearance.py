"""The look of the reflector that a person confirmed, found again in the images of other dwells."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Vector2, freeze
from calib_core.camera import Camera
from calib_core.proposing.apex import Apex, find_apex
from calib_core.proposing.apex_refinement import full_image
from calib_core.proposing.dwell_views import DwellView, width_seen_px, with_blobs
from calib_core.proposing.image_candidates import ImageCandidate, Surroundings
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
_LOOKS = 2
"""How many looks are tried in a dwell: those of the most similar size."""
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
    seen = _with_surroundings(view, frames)
    near = sorted(looks, key=lambda look: _unlike_in_size(look, view.width_px))[:_LOOKS]
    rough = [(_best_match(one, near, view.width_px, _ROUGH_WIDTH_PX, 1.0), one) for one in seen]
    rough.sort(key=lambda pair: -pair[0].likeness)
    candidates: list[ImageCandidate] = []
    size_px = np.array([camera.width_px, camera.height_px])
    for index, (match, candidate) in enumerate(rough):
        moved = replace(candidate, likeness=match.likeness)
        if index < _REFINED:
            fine = _best_match(candidate, [match.look], view.width_px, _FINE_WIDTH_PX, _FINER)
            moved = _moved(candidate, fine, view.width_px)
        inside = bool(((moved.pixel_px > -0.5) & (moved.pixel_px < size_px - 0.5)).all())
        if inside and all(
            np.hypot(*(moved.pixel_px - other.pixel_px)) > _APART * view.width_px for other in candidates
        ):
            candidates.append(moved)
    strongest = max((one.strength for one in candidates), default=1.0)
    candidates.sort(key=lambda one: -(one.likeness + _STRENGTH * one.strength / strongest + _APEX * one.has_apex))
    return replace(view, candidates=tuple(candidates))


def _with_surroundings(view: DwellView, frames: FrameSource) -> list[ImageCandidate]:
    """Return the candidates of which the image is known; frames are decoded only where it was not kept."""
    if all(candidate.surroundings is not None for candidate in view.candidates):
        return list(view.candidates)
    image = full_image(view.clear if len(view.clear) else view.frames, frames)
    if image is None:
        return []
    whole = Surroundings(image, np.zeros(2))
    return [
        candidate if candidate.surroundings is not None else replace(candidate, surroundings=whole)
        for candidate in view.candidates
    ]


def _unlike_in_size(look: Appearance, width_px: float) -> float:
    """Return how badly a look suits a size: a larger one shows more than a smaller one."""
    ratio = float(np.log(look.width_px / width_px))
    return ratio if ratio >= 0.0 else -2.0 * ratio


@dataclass(frozen=True, slots=True, eq=False)
class _Match:
    """Where a look is found near a candidate, and how alike it is there."""

    pixel_px: Vector2
    likeness: float
    look: Appearance


def _best_match(
    candidate: ImageCandidate, looks: Sequence[Appearance], width_px: float, at_width_px: float, finer: float
) -> _Match:
    fine = min(finer, at_width_px / width_px)
    return max((_match(candidate, look, width_px, fine) for look in looks), key=lambda match: match.likeness)


def _match(candidate: ImageCandidate, look: Appearance, width_px: float, fine: float) -> _Match:
    """Correlate a look with the surroundings of a candidate, at the scale of its range and `fine` times finer."""
    import cv2

    assert candidate.surroundings is not None, "given by _with_surroundings"
    template, mask = _template(look, width_px * fine)
    half_px = _REACH * width_px + template.shape[0] / (2.0 * fine)
    surroundings, corner_px = _resampled(candidate.surroundings, candidate.pixel_px, half_px, fine)
    scores = cv2.matchTemplate(surroundings, template, cv2.TM_CCOEFF_NORMED, mask=mask)
    scores[~np.isfinite(scores)] = -1.0
    row, column = (int(v) for v in np.unravel_index(int(np.argmax(scores)), scores.shape))
    peak = np.array([column, row]) + _below_a_pixel(scores, row, column) + 0.5 * (template.shape[0] - 1)
    return _Match(corner_px + peak / fine, float(np.clip(scores[row, column], -1.0, 1.0)), look)


def _moved(candidate: ImageCandidate, match: _Match, width_px: float) -> ImageCandidate:
    """Move a candidate to where the look is found, and on to an apex there that may be what was clicked."""
    look, likeness = match.look, match.likeness
    carried_px = look.sigma_px * width_px / look.width_px
    sigma_px = float(np.hypot(carried_px, _CARRIED_PX + _CARRIED * width_px * (1.0 - likeness)))
    reach_px = max(_LEAST_SNAP_PX, _AGREES * width_px) if look.at_apex else min(2.0 * sigma_px, _AGREES * width_px)
    if likeness >= _LEAST_LIKENESS:
        if candidate.has_apex and float(np.hypot(*(candidate.pixel_px - match.pixel_px))) <= reach_px:
            return replace(candidate, likeness=likeness)
        assert candidate.surroundings is not None, "given by _with_surroundings"
        corner_px = candidate.surroundings.corner_px
        near_px = match.pixel_px - corner_px
        apex = find_apex(candidate.surroundings.image, near_px, reach_px=reach_px, size_px=width_px)
        if isinstance(apex, Apex):
            at_px = corner_px + apex.pixel_px
            return replace(candidate, pixel_px=at_px, sigma_px=apex.sigma_px, likeness=likeness, has_apex=True)
    return replace(candidate, pixel_px=match.pixel_px, sigma_px=sigma_px, likeness=likeness, has_apex=False)


def _template(look: Appearance, width_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the look at another size, its confirmed pixel in the middle, and the disc that is compared: float32."""
    import cv2

    scale = width_px / look.width_px
    patch: np.ndarray = look.patch.astype(np.float32)
    if scale < 1.0:
        patch = cv2.GaussianBlur(patch, (0, 0), max(0.01, 0.35 * np.sqrt(1.0 / scale**2 - 1.0)))
    half = max(3, int(np.ceil(_HALF * width_px)))
    middle = np.array(look.patch.shape[1::-1]) // 2 + look.offset_px
    move = np.array([[scale, 0.0, half - scale * middle[0]], [0.0, scale, half - scale * middle[1]]])
    side = (2 * half + 1, 2 * half + 1)
    template = cv2.warpAffine(patch, move, side, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    disc = (np.hypot(x, y) <= _DISC * width_px).astype(np.float32)
    return template, np.repeat(disc[..., None], 3, axis=2)


def _resampled(
    surroundings: Surroundings, centre_px: Vector2, half_px: float, fine: float
) -> tuple[np.ndarray, Vector2]:
    """Return the surroundings of a pixel on a grid `fine` times finer, and where that grid begins in the full image."""
    import cv2

    half = int(np.ceil(half_px * fine))
    corner_px = np.asarray(centre_px) - half / fine
    part: np.ndarray = surroundings.image.astype(np.float32)
    if fine < 1.0:
        part = cv2.GaussianBlur(part, (0, 0), 0.35 * np.sqrt(1.0 / fine**2 - 1.0))
    begin_px = corner_px - surroundings.corner_px
    move = np.array([[1.0 / fine, 0.0, begin_px[0]], [0.0, 1.0 / fine, begin_px[1]]])
    side = (2 * half + 1, 2 * half + 1)
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(part, move, side, flags=flags, borderMode=cv2.BORDER_REPLICATE), corner_px


def _below_a_pixel(scores: np.ndarray, row: int, column: int) -> Vector2:
    """Return the peak of the parabolas through a maximum and its neighbours, from that maximum: column, row."""
    offsets = []
    for place, line in ((column, scores[row]), (row, scores[:, column])):
        offset = 0.0
        if 0 < place < len(line) - 1:
            before, here, after = (float(line[place + k]) for k in (-1, 0, 1))
            bend = before - 2.0 * here + after
            offset = float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0
        offsets.append(offset)
    return np.array(offsets)
