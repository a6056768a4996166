"""From a recording to proposals: the radar's placements, what the pictures show there, and how the two fit together."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import takewhile
from typing import Protocol

import numpy as np

from calib_core.arrays import Vector2
from calib_core.association.gating import static_returns
from calib_core.association.placements import Placement, find_placements, in_stretches
from calib_core.camera import Camera
from calib_core.measurements import NS_PER_S, RadarScans, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, GatingOptions
from calib_core.proposing import DwellView, FrameSource, Proposals, ViewProgress, dwell_views, proposals_of
from calib_core.proposing.look import Look, look_of, with_look

REFLECTOR_M = 0.24
"""Width of the reflector if nothing is said of it [m]."""
_BESIDE = 0.6
"""A click farther than so many widths from everything that changed is not on the reflector, if one is seen there."""
_LEAST_PLACEMENTS = 3
"""What changed in a dwell shows against at least two others."""
_SHORTEST_NS = 2 * NS_PER_S
"""A recording that is shorter is not searched: a few dense clouds in vain would take minutes."""
_STOPPED = Unsolvable("stopped", "the search for proposals was stopped", "start it again")
_CLICK = "click the reflector on the page"


class RecordedFrames(FrameSource, Protocol):
    """The part of a Recording that proposals need."""

    def radar_windows(self) -> Iterable[RadarScans]:
        """Return all scans in order of time, a few seconds at once."""
        ...


def find_proposals(
    recording: RecordedFrames,
    camera: Camera | None,
    options: CalibrationOptions,
    *,
    confirmed: Sequence[ReflectorClick] = (),
    placements: Sequence[Placement] | None = None,
    reflector_m: float = REFLECTOR_M,
    progress: Callable[[ViewProgress | str], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[tuple[DwellView, ...], Proposals] | Unsolvable:
    """Find where the reflector stood, and where the pictures show it there.

    Args:
        recording: with a radar and a camera.
        camera: the intrinsics; without them the outcome says that they are missing.
        options: of the calibration.
        confirmed: clicks that a person placed or accepted; each shows what the reflector looks like.
        placements: where the radar saw something stand still, if that is known already.
        reflector_m: width of the reflector [m].
        progress: called with what is done next, in words, and while the pictures are looked at.
        stopped: asked often; once it is true there are no proposals.

    Raises:
        CalibrationError: the recording cannot be read.
    """
    if camera is None:
        return _no_camera()
    if not len(recording.image_times):
        return Unsolvable("no-frames", "the recording contains no camera frames", "add the camera's recording")
    if placements is None:
        if progress is not None:
            progress("searching the radar scans for placements")
        placements = _placements(recording, options.gating, stopped)
    if stopped():
        return _STOPPED
    missing = _missing(placements, recording)
    if missing is not None:
        return missing
    views = dwell_views(placements, recording, camera, reflector_m=reflector_m, progress=progress, stopped=stopped)
    if stopped():
        return _STOPPED
    return proposed_again(views, recording, camera, options, confirmed=confirmed)


def proposed_again(
    views: Sequence[DwellView],
    frames: FrameSource,
    camera: Camera,
    options: CalibrationOptions,
    *,
    confirmed: Sequence[ReflectorClick] = (),
) -> tuple[tuple[DwellView, ...], Proposals]:
    """Propose from the views of the dwells: cheap enough to be called after each confirmed click.

    Args:
        views: of all placements, as `dwell_views` found them.
        frames: of the camera.
        camera: the intrinsics.
        options: of the calibration.
        confirmed: clicks that a person placed or accepted; those that do not count show nothing.

    Raises:
        CalibrationError: a frame cannot be read.
    """
    counting = [click for click in confirmed if click.counts]
    looks = [look for click in counting for look in looks_of(click, views, frames)]
    found = with_look(views, looks, frames, camera) if looks else tuple(views)
    return found, proposals_of(found, camera, options, confirmed=counting)


def looks_of(click: ReflectorClick, views: Sequence[DwellView], frames: FrameSource) -> Iterator[Look]:
    """Yield what a confirmed click shows; nothing if it lies in no dwell, or no frame of that can be read.

    A click beside the reflector shows nothing either: the same would be found beside the others.
    """
    pixel_px = np.array([click.u_px, click.v_px])
    view = view_at(click.image_time, pixel_px, views)
    beside = beside_the_reflector(click, views) is not None
    look = None if view is None or beside else look_of(view, frames, pixel_px)
    if look is not None:
        yield look


def view_at(image_time: TimeNs, pixel_px: Vector2, views: Sequence[DwellView]) -> DwellView | None:
    """Return the view of the dwell that a pixel of a frame is of; None if none of that time was looked at.

    Of two reflectors that stood at once, that with a candidate nearer to the pixel.

    Args:
        image_time: stamp of the frame.
        pixel_px: (2,) in it.
        views: of all placements.
    """
    meanwhile = [one for one in views if one.placement.start <= image_time <= one.placement.end and len(one.frames)]
    return min(meanwhile, key=lambda view: _distance_px(view, pixel_px), default=None)


def beside_the_reflector(click: ReflectorClick, views: Sequence[DwellView]) -> float | None:
    """Return how far a click is from the nearest place that changed [px], if a reflector is seen there; None if it is on it."""
    pixel_px = np.array([click.u_px, click.v_px])
    view = view_at(click.image_time, pixel_px, views)
    if view is None or not any(one.has_apex for one in view.candidates):
        return None
    off_px = _distance_px(view, pixel_px)
    return off_px if off_px > _BESIDE * view.width_px else None


def _distance_px(view: DwellView, pixel_px: np.ndarray) -> float:
    return min((float(np.linalg.norm(one.pixel_px - pixel_px)) for one in view.candidates), default=np.inf)


def _placements(recording: RecordedFrames, gating: GatingOptions, stopped: Callable[[], bool]) -> tuple[Placement, ...]:
    """Search a whole recording, one stretch after another if it is long: memory stays bounded."""
    windows = takewhile(lambda _: not stopped(), recording.radar_windows())
    return tuple(
        one
        for stretch in in_stretches(static_returns(window, gating) for window in windows)
        if len(stretch) and stretch.times_ns[-1] - stretch.times_ns[0] >= _SHORTEST_NS
        for one in find_placements(stretch, gating)
    )


def _missing(placements: Sequence[Placement], recording: RecordedFrames) -> Unsolvable | None:
    """Say why there can be no proposals; None if there can."""
    if len(placements) < _LEAST_PLACEMENTS:
        found = {0: "no placement", 1: "one placement"}.get(len(placements), f"{len(placements)} placements")
        return Unsolvable(
            "too-few-placements",
            f"the radar shows {found}, and at least {_LEAST_PLACEMENTS} are needed: a placement is a strong return that appears, "
            "stands still for two seconds or longer, and disappears",
            "let the reflector stand still for some seconds at each of ten or more places, and check with cocalib info that "
            f"the radar's topic and options are right; or {_CLICK}",
        )
    times = recording.image_times
    seen = [np.searchsorted(times, one.start) < np.searchsorted(times, one.end, side="right") for one in placements]
    if not any(seen):
        first_s, last_s = ((int(time) - int(placements[0].start)) / NS_PER_S for time in (times[0], times[-1]))
        return Unsolvable(
            "no-frames-in-placements",
            f"the camera recorded no frame during any of the {len(placements)} placements of the radar: its frames run from "
            f"{first_s:+.1f} s to {last_s:+.1f} s of the first placement",
            "check that both recordings are of the same time, and that their clocks agree",
        )
    return None


def _no_camera() -> Unsolvable:
    return Unsolvable(
        "no-camera",
        "the camera intrinsics are missing: the recording contains none that can be used",
        "calibrate the lens from a board (cocalib intrinsics), or give them with --camera FILE",
    )
