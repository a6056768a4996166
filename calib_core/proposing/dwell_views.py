"""Dwell views: what the camera saw while the radar's target stood still, and what changed there against the other dwells."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib_core.arrays import Indices, frozen_array
from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.measurements import TimeNs
from calib_core.proposing.apex_refinement import full_picture, with_apexes
from calib_core.proposing.frame_source import FrameSource
from calib_core.proposing.picture_candidates import PictureCandidate, blobs
from calib_core.proposing.picture_changes import changed_places, least_others, nearest_others
from calib_core.proposing.stack_median import stack_median
from calib_core.proposing.still_pictures import StillPicture, frames_within, seen_frames, still_pictures

_SETTLED = 9
"""Once so many dwells are seen, further ones hardly change what is said about one of them."""
_EARLY = (3, 6)
"""After so many dwells the first candidates are said."""
_REMEMBERED = 24
"""Dwells whose still pictures are kept in memory, the last ones."""
_NEAREST_M = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class DwellView:
    """A placement that the radar found, as the camera saw it.

    Attributes:
        placement: when and where the radar saw something stand still.
        frames: (k,) numbers of the frames that were looked at; empty if the camera recorded none.
        image_time: stamp of the frame in which a person is shown the proposal.
        picture: (h, w, 3) uint8, the median of those frames, reduced; empty without frames, and forgotten after many dwells.
        factor: width of the full picture over that of `picture`.
        candidates: places that changed, the strongest first.
        stills: the same picture for each set of placements that stood together; one if no other stood meanwhile.
        width_px: of the reflector at that range, in the full picture.
        clear: numbers of the few frames that are most like `picture`: nobody walks past in them.
    """

    placement: Placement
    frames: Indices
    image_time: TimeNs
    picture: np.ndarray
    factor: float
    candidates: tuple[PictureCandidate, ...] = ()
    stills: tuple[StillPicture, ...] = ()
    width_px: float = float("nan")
    clear: Indices = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        object.__setattr__(self, "frames", frozen_array(self.frames, (None,), dtype=np.int64))
        object.__setattr__(self, "clear", frozen_array(self.clear, (None,), dtype=np.int64))


@dataclass(frozen=True, slots=True, eq=False)
class ViewProgress:
    """How far the pictures are looked at.

    Attributes:
        done: dwells whose pictures are decoded.
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
    """Look at the pictures of every dwell, and find what changed in each.

    Args:
        placements: as the radar shows them.
        frames: of the camera.
        camera: its intrinsics.
        reflector_m: width of the reflector.
        progress: called after each dwell.
        stopped: whether to return what there is by now.
    """
    views: list[DwellView] = []
    settled = 0
    for number, placement in enumerate(placements):
        if stopped is not None and stopped():
            break
        views.append(_seen(number, placements, frames, reflector_width_px(placement, camera, reflector_m)))
        if len(views) in _EARLY:
            views = [_with_blobs(k, views) for k in range(len(views))]
        if len(views) > _SETTLED:
            views[settled:] = [_with_candidates(k, views, frames) for k in range(settled, len(views))]
            settled = len(views)
            views[:-_REMEMBERED] = [_without_pictures(view) for view in views[:-_REMEMBERED]]
        if progress is not None:
            progress(ViewProgress(len(views), len(placements), tuple(views)))
    views[settled:] = [_with_candidates(k, views, frames) for k in range(settled, len(views))]
    return tuple(views)


def reflector_width_px(placement: Placement, camera: Camera, reflector_m: float) -> float:
    """Return how wide the reflector is in the full picture at the range of a placement.

    Args:
        placement: of the radar.
        camera: its intrinsics.
        reflector_m: width of the reflector.
    """
    range_m = max(float(np.linalg.norm(placement.position_radar_m)), _NEAREST_M)
    return reflector_m / range_m * float(camera.matrix_px[0, 0])


def _seen(number: int, placements: Sequence[Placement], frames: FrameSource, width_px: float) -> DwellView:
    """Take the median of a few frames of a dwell."""
    placement = placements[number]
    seen = seen_frames(frames_within(placement, frames.image_times), frames)
    middle = TimeNs((placement.start + placement.end) // 2)
    if not seen.pictures:
        empty = np.zeros((0, 0, 3), np.uint8)
        return DwellView(placement, seen.numbers, middle, empty, 1.0, width_px=width_px)
    stills = still_pictures(number, placements, seen, frames.image_times)
    picture = stills[0].picture if len(stills) == 1 else stack_median(seen.pictures)
    clear = seen.clearest(picture)
    shown = clear[int(np.argmin(np.abs(frames.image_times[clear] - middle)))]
    image_time = TimeNs(int(frames.image_times[shown]))
    return DwellView(
        placement, seen.numbers, image_time, picture, seen.factor, stills=stills, width_px=width_px, clear=clear
    )


def _with_blobs(number: int, views: Sequence[DwellView]) -> DwellView:
    """Find what differs from the other dwells nearest in time."""
    view = views[number]
    stills = [still for other in views for still in other.stills if still.picture.shape == view.picture.shape]
    others = nearest_others(number, view.image_time, stills)
    if not view.stills or len(others) < least_others():
        return view
    at_once = frozenset().union(*(still.standing for still in view.stills)) - {number}
    without = [still for still in others if still.standing & at_once]
    width_px = view.width_px / view.factor
    response = changed_places(view.stills, others, width_px, without=without)
    return replace(view, candidates=tuple(_full(one, view.factor) for one in blobs(response, width_px)))


def _with_candidates(number: int, views: Sequence[DwellView], frames: FrameSource) -> DwellView:
    """Find what changed, and the apexes there at full resolution."""
    view = _with_blobs(number, views)
    picture = full_picture(view.clear, frames) if view.candidates else None
    if picture is None:
        return view
    return replace(view, candidates=with_apexes(view.candidates, picture, view.width_px))


def _without_pictures(view: DwellView) -> DwellView:
    """Forget what no later dwell is compared with."""
    return replace(view, picture=view.picture[:0], stills=()) if view.stills else view


def _full(candidate: PictureCandidate, factor: float) -> PictureCandidate:
    pixel_px = (candidate.pixel_px + 0.5) * factor - 0.5
    return replace(candidate, pixel_px=pixel_px, sigma_px=candidate.sigma_px * factor)
