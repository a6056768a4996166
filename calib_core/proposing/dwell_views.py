"""Dwell views: what the camera saw while the radar's target stood still, and what changed there against the other dwells."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib_core.arrays import Indices, Values, Vector2, freeze
from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.measurements import TimeNs
from calib_core.proposing.image_candidates import ImageCandidate, blobs, full_image, with_apexes
from calib_core.proposing.still_images import (
    FrameSource,
    StillImage,
    channel_gains,
    frames_within,
    in_same_light,
    local_light,
    seen_frames,
    stack_median,
    still_images,
)

_SETTLED = 9
"""Once so many dwells are seen, further ones hardly change what is said about one of them."""
_REMEMBERED = 24
"""Dwells whose still images are kept in memory, the last ones."""
_NEAREST_M = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class DwellView:
    """A placement that the radar found, as the camera saw it.

    Attributes:
        placement: when and where the radar saw something stand still.
        frames: (k,) numbers of the frames that were looked at; empty if the camera recorded none.
        image_time: stamp of the frame in which a person is shown the proposal.
        image: (h, w, 3) uint8, the median of those frames, reduced; empty without frames, and forgotten after many dwells.
        factor: width of the full image over that of `image`.
        candidates: places that changed, the strongest first.
        stills: the same image for each set of placements that stood together; one if no other stood meanwhile.
        width_px: of the reflector at that range, in the full image.
        clear: numbers of the few frames that are most like `image`: nobody walks past in them.
        change: (k, h, w) uint8, how far each pixel of the k stills lies from what the other dwells show there.
    """

    placement: Placement
    frames: Indices
    image_time: TimeNs
    image: np.ndarray
    factor: float
    candidates: tuple[ImageCandidate, ...] = ()
    stills: tuple[StillImage, ...] = ()
    width_px: float = float("nan")
    clear: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    change: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0), np.uint8))

    def __post_init__(self) -> None:
        freeze(self, np.int64, frames=(None,), clear=(None,))


@dataclass(frozen=True, slots=True, eq=False)
class ViewProgress:
    """How far the images are looked at.

    Attributes:
        done: dwells with candidates.
        count: of all.
        views: with candidates as far as they can be said by now.
    """

    done: int
    count: int
    views: tuple[DwellView, ...]


def dwell_views(
    placements: Sequence[Placement],
    frames: FrameSource,
    camera: Camera,
    *,
    reflector_m: float = 0.24,
    progress: Callable[[ViewProgress], None] | None = None,
    stopped: Callable[[], bool] | None = None,
) -> tuple[DwellView, ...]:
    """Look at the images of every dwell, and find what changed in each.

    Args:
        placements: as the radar shows them.
        frames: of the camera.
        camera: its intrinsics.
        reflector_m: width of the reflector.
        progress: called after each dwell with candidates.
        stopped: whether to return what there is by now.
    """
    views: list[DwellView] = []
    done, last = 0, len(placements) - 1
    for number, placement in enumerate(placements):
        if stopped is not None and stopped():
            break
        views.append(_median_view(number, placements, frames, reflector_width_px(placement, camera, reflector_m)))
        while done < len(views) and (len(views) > _SETTLED or number == last):
            if stopped is not None and stopped():
                break
            views[done] = with_seen_apexes(_with_blobs(done, views), frames)
            done += 1
            if progress is not None:
                progress(ViewProgress(done, len(placements), tuple(views)))
        views[:-_REMEMBERED] = [_without_images(view) for view in views[:-_REMEMBERED]]
    return tuple(views)


def reflector_width_px(placement: Placement, camera: Camera, reflector_m: float) -> float:
    """Return how wide the reflector is in the full image at the range of a placement.

    Args:
        placement: of the radar.
        camera: its intrinsics.
        reflector_m: width of the reflector.
    """
    range_m = max(float(np.linalg.norm(placement.position_radar_m)), _NEAREST_M)
    return reflector_m / range_m * float(camera.matrix_px[0, 0])


def _median_view(number: int, placements: Sequence[Placement], frames: FrameSource, width_px: float) -> DwellView:
    """Take the median of a few frames of a dwell."""
    placement = placements[number]
    seen = seen_frames(frames_within(placement, frames.image_times), frames)
    middle = TimeNs((placement.start + placement.end) // 2)
    if not seen.images:
        empty = np.zeros((0, 0, 3), np.uint8)
        return DwellView(placement, seen.numbers, middle, empty, 1.0, width_px=width_px)
    stills = still_images(number, placements, seen, frames.image_times)
    image = stills[0].image if len(stills) == 1 else stack_median(seen.images)
    clear = seen.clearest(image)
    shown = clear[int(np.argmin(np.abs(frames.image_times[clear] - middle)))]
    image_time = TimeNs(int(frames.image_times[shown]))
    return DwellView(
        placement, seen.numbers, image_time, image, seen.factor, stills=stills, width_px=width_px, clear=clear
    )


def _with_blobs(number: int, views: Sequence[DwellView]) -> DwellView:
    """Find what differs from the other dwells nearest in time."""
    view = views[number]
    others = [
        still
        for other in views
        for still in other.stills
        if still.image.shape == view.image.shape and number not in still.standing
    ]
    others = sorted(others, key=lambda still: abs(still.time - view.image_time))[:_OTHERS]
    if not view.stills or len(others) < _LEAST_OTHERS:
        return view
    usual = _Usual.of(view.stills[0].image, others)
    return with_blobs(replace(view, change=usual.changes_of(view.stills)))


def with_blobs(view: DwellView, *, rough: bool = False) -> DwellView:
    """Find the places of the reflector's width among the pixels that changed.

    Args:
        view: with its changes.
        rough: the strongest only, in images so far reduced that the reflector is still a few pixels wide.
    """
    reduced = 1 << int(np.log2(max(view.width_px / view.factor / _ROUGH_PX, 1.0))) if rough else 1
    factor = view.factor * reduced
    width_px = view.width_px / factor
    response = _response(_reduced(view.change, reduced), width_px)
    found = blobs(response, width_px, most=_ROUGH_MOST) if rough else blobs(response, width_px)
    return replace(
        view,
        candidates=tuple(
            replace(one, pixel_px=(one.pixel_px + 0.5) * factor - 0.5, sigma_px=one.sigma_px * factor) for one in found
        ),
    )


def _reduced(changes: np.ndarray, factor: int) -> np.ndarray:
    """Return change maps (k, h, w) smaller by a whole factor; rows and columns that are left over at the ends are cut off."""
    count, height, width = changes.shape
    height, width = height // factor, width // factor
    parts = changes[:, : height * factor, : width * factor].reshape(count, height, factor, width, factor)
    return changes if factor == 1 else parts.mean(axis=(2, 4)).astype(np.uint8)


def width_seen_px(view: DwellView, pixel_px: Vector2) -> float:
    """Return how wide the thing is that changed at a pixel: as the reflector is thought to be, unless another width stands out.

    Args:
        view: of the dwell.
        pixel_px: (2,) of the full image, on the thing.
    """
    if not view.change.size:
        return view.width_px
    widths_px, shown = _contrast_by_width(view, pixel_px)
    best = int(np.argmax(shown))
    stands_out = shown[best] > max(_STANDS_OUT * shown[0], _LEAST_SIGMAS)
    other = abs(np.log(widths_px[best] / widths_px[0])) > np.log(_STANDS_OUT)
    return float(widths_px[best]) * view.factor if stands_out and other else view.width_px


def has_changed(view: DwellView, pixel_px: Vector2) -> bool:
    """Return whether something of any width changed at a pixel (2,) of the full image."""
    return bool(view.change.size) and bool(_contrast_by_width(view, pixel_px)[1].max() > _LEAST_SIGMAS)


def _contrast_by_width(view: DwellView, pixel_px: Vector2) -> tuple[Values, Values]:
    """Return widths, the reflector's first, and how much a thing of each stands out at a pixel."""
    middle = np.round((np.asarray(pixel_px) + 0.5) / view.factor - 0.5).astype(int)
    thought_px = view.width_px / view.factor
    widths_px = thought_px * np.geomspace(1.0 / _WIDEST, _WIDEST, _WIDTHS)
    widths_px = np.append(
        thought_px, widths_px[(widths_px >= _NARROWEST_PX) & (widths_px < 0.3 * view.change.shape[1])]
    )
    return widths_px, np.array([_shown_at(view, middle, width_px) for width_px in widths_px.tolist()])


def _shown_at(view: DwellView, middle: Indices, width_px: float) -> float:
    """Return how much a thing of one width stands out whose middle lies within half a width of a pixel."""
    reach = max(2, round(0.5 * width_px))
    wide = round(_SURROUNDINGS * width_px) + reach
    left, top = np.maximum(middle - wide, 0).tolist()
    right, bottom = (middle + wide + 1).tolist()
    part = np.s_[:, top:bottom, left:right]
    response = _response(view.change[part], width_px)
    first = np.maximum(middle - reach - [left, top], 0)
    last = np.maximum(middle + reach + 1 - [left, top], first)
    return float(response[first[1] : last[1], first[0] : last[0]].max(initial=0.0))


def with_seen_apexes(view: DwellView, frames: FrameSource) -> DwellView:
    """Move the candidates of a view to the apexes that full images show there.

    Args:
        view: of a dwell.
        frames: of the camera.
    """
    image = full_image(view.clear, frames) if view.candidates else None
    if image is None:
        return view
    return replace(view, candidates=with_apexes(view.candidates, image, view.width_px))


def _without_images(view: DwellView) -> DwellView:
    """Forget what no later dwell is compared with."""
    return replace(view, image=view.image[:0], stills=()) if view.stills else view


_LEAST_OTHERS, _OTHERS = 2, 9
"""Other still images that are needed to say what changed, and how many are compared, those nearest in time."""
_LEVELS_PER_GREY = 64.0
_FLOOR_GREY = 3.0
"""Scatter of a pixel at least: compression and sensor."""
_MOST_SIGMAS = 8.0
"""A pixel counts no more than this: a bright one is no better evidence than many."""
_LEVELS_PER_SIGMA = 30.0
_ROUGH_PX, _ROUGH_MOST = 3.0, 8
"""Width of the reflector in the smallest image in which it is looked for, and how many places are kept."""
_WIDEST, _WIDTHS, _NARROWEST_PX = 6.0, 25, 4.0
"""Widths that are tried at a click: up to so many times what the reflector is thought to be, and down to that; how many."""
_STANDS_OUT, _LEAST_SIGMAS = 1.5, 1.0
"""Another width is taken if it stands out that many times more, differs by that factor, and stands out at all."""
_SURROUNDINGS = 4.0
"""How much of the image around a place its width is judged by, in widths."""
_RING = 1.2
"""Weight of the mean around the square: what is larger than a reflector, such as a person, cancels."""
_PART, _PART_COUNTS = 0.6, 0.8
"""Width of a part of the reflector that is looked for as well, and how much it counts."""
_NEXT = 1.2
"""How far on both sides of a place a limb goes on, in widths of the reflector."""
_BODY = (1.6, 3.0)
"""Width and height of what is taken for a body below a head, in widths of the reflector."""
_SPARSE = 0.4
"""What is changed by less than this share, such as the legs of a tripod, is no body."""


def _response(change: np.ndarray, width_px: float) -> np.ndarray:
    """Return how strongly each place changed at one size, in all images (k, h, w) of a dwell: (h, w) float32 [sigmas]."""
    return np.asarray(np.min([_of_size(one, width_px) for one in change], axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class _Usual:
    """What the scene looks like without the placement, in the light of its image.

    Attributes:
        reference: (h, w, 3) uint8, the image whose light it is.
        median: (h, w, 3) float32 [grey levels].
        scatter: (h, w, 3) float32, standard deviation [grey levels].
    """

    reference: np.ndarray
    median: np.ndarray
    scatter: np.ndarray

    @classmethod
    def of(cls, reference: np.ndarray, others: Sequence[StillImage]) -> "_Usual":
        import cv2

        stack = [
            in_same_light(other.image, channel_gains(reference, other.image), levels_per_grey=_LEVELS_PER_GREY)
            for other in others
        ]
        median = stack_median(stack)
        scatter = stack_median([cv2.absdiff(one, median) for one in stack])
        return cls(
            reference,
            median.astype(np.float32) / np.float32(_LEVELS_PER_GREY),
            scatter.astype(np.float32) * np.float32(1.48 / _LEVELS_PER_GREY) + np.float32(_FLOOR_GREY),
        )

    def changes_of(self, stills: Sequence[StillImage]) -> np.ndarray:
        """Return how far each pixel of stills lies from what is usual: (k, h, w) uint8, in levels of `_LEVELS_PER_SIGMA`."""
        changes = [np.minimum(self._change_of(still.image), np.float32(_MOST_SIGMAS)) for still in stills]
        levels = [np.round(change * np.float32(_LEVELS_PER_SIGMA)).astype(np.uint8) for change in changes]
        return np.array(levels, dtype=np.uint8).reshape(len(stills), *self.median.shape[:2])

    def _change_of(self, image: np.ndarray) -> np.ndarray:
        """Return how far each pixel lies from what is usual: (h, w) float32, in standard deviations."""
        median = self.median
        if image is not self.reference:
            median = median * channel_gains(image, self.reference).astype(np.float32)
        shown = image.astype(np.float32)
        off = (shown - local_light(shown, median) * median) / self.scatter
        return np.asarray(np.sqrt(np.einsum("ijk,ijk->ij", off, off)))


def _of_size(change: np.ndarray, width_px: float) -> np.ndarray:
    """Return how far a place of about one size stands out [sigmas]; part of the reflector may look like what is behind it."""
    change = change.astype(np.float32) * np.float32(1.0 / _LEVELS_PER_SIGMA)
    whole, part = (_stands_out(change, share * width_px) for share in (1.0, _PART))
    return np.maximum(whole, np.float32(_PART_COUNTS) * part)


def _stands_out(change: np.ndarray, width_px: float) -> np.ndarray:
    """Return the mean change in a square of one size, less that around it."""
    import cv2

    side = max(3, 2 * round(0.5 * width_px) + 1)
    inner = cv2.blur(change, (side, side))
    wide = 2 * side + 1
    ring = (cv2.blur(change, (wide, wide)) * wide**2 - inner * side**2) / (wide**2 - side**2)
    more = cv2.max(np.float32(_RING) * ring, _of_a_larger_thing(change, inner, side))
    return np.asarray(inner - more)


def _of_a_larger_thing(change: np.ndarray, inner: np.ndarray, side: int) -> np.ndarray:
    """Return how much changed on both sides of each place, and in a body below or above it: the least of a limb or a head."""
    import cv2

    step = round(_NEXT * side)
    lines = [cv2.min(_moved(inner, *way), _moved(inner, -way[0], -way[1])) for way in ((step, 0), (0, step))]
    body = cv2.blur(change, (round(_BODY[0] * side) | 1, round(_BODY[1] * side) | 1))
    away = round((0.5 + 0.5 * _BODY[1]) * side)
    body = np.maximum(body - np.float32(_SPARSE * _MOST_SIGMAS), np.float32(0.0)) * np.float32(1.0 / (1.0 - _SPARSE))
    bodies = [_moved(body, 0, away), _moved(body, 0, -away)]
    return np.asarray(cv2.max(cv2.max(*lines), cv2.max(*bodies)))


def _moved(image: np.ndarray, right: int, down: int) -> np.ndarray:
    """Return what an image shows so far to the right of, and below, each pixel; 0 beyond its edges."""
    import cv2

    move = np.array([[1.0, 0.0, -right], [0.0, 1.0, -down]])
    return np.asarray(cv2.warpAffine(image, move, image.shape[1::-1], flags=cv2.INTER_NEAREST))
