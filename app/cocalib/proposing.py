"""From a recording to proposals: placements, what the images show there, how the two fit; and the same in the background."""

import logging
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import Literal, Protocol, TypeAlias

import numpy as np

from calib_core.arrays import TimesNs, Vector2
from calib_core.association.gating import static_returns
from calib_core.association.placements import Placement, find_placements, in_stretches
from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.measurements import NS_PER_S, RadarScans, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, GatingOptions
from calib_core.proposing import DwellView, FrameSource, Proposals, ViewProgress, dwell_views, proposals_of
from calib_core.proposing.appearance import Appearance, appearance_of, likeness_elsewhere, with_appearance
from calib_core.proposing.chance import OTHER_WIDTHS, Chance, at_width, chance_of
from calib_core.proposing.dwell_views import has_changed
from calib_core.proposing.proposing import LEAST_CONFIDENCE
from calib_core.words.outcomes import outcome_remark
from cocalib.platform.error_boundary import error_boundary
from cocalib.platform.process import go_last

REFLECTOR_M = 0.24
"""Width of the reflector if nothing is said of it [m]."""
_BESIDE = 0.6
"""A click farther than so many widths from everything that changed is not on the reflector, if one is seen there."""
_LEAST_PLACEMENTS = 3
"""What changed in a dwell shows against at least two others."""
_SHORTEST_NS = 2 * NS_PER_S
"""A recording that is shorter is not searched: a few dense clouds in vain would take minutes."""
_STOPPED = Unsolvable("stopped")


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
    """Find where the reflector stood, and where the images show it there.

    Args:
        recording: with a radar and a camera.
        camera: the intrinsics; without them the outcome says that they are missing.
        options: of the calibration.
        confirmed: clicks that a person placed or accepted; each shows what the reflector looks like.
        placements: where the radar saw something stand still, if that is known already.
        reflector_m: width of the reflector [m]; without a click, others are tried where nothing is found with it.
        progress: called with what is done next, in words, and while the images are looked at.
        stopped: asked often; once it is true there are no proposals.

    Raises:
        CalibrationError: the recording cannot be read.
    """
    if camera is None or not len(recording.image_times):
        return Unsolvable("no-camera" if camera is None else "no-frames")
    if placements is None:
        if progress is not None:
            progress("searching the radar scans for placements")
        placements = _placements(recording, options.gating, stopped)
    missing = _STOPPED if stopped() else _missing(placements, recording)
    if missing is not None:
        return missing
    views = dwell_views(placements, recording, camera, reflector_m=reflector_m, progress=progress, stopped=stopped)
    if stopped():
        return _STOPPED
    found = proposed_again(views, recording, camera, options, confirmed=confirmed)
    if found[1].ranked or any(click.counts for click in confirmed):
        return found
    return _at_other_widths(found, recording, camera, options, stopped)


def _at_other_widths(
    found: tuple[tuple[DwellView, ...], Proposals],
    frames: FrameSource,
    camera: Camera,
    options: CalibrationOptions,
    stopped: Callable[[], bool],
) -> tuple[tuple[DwellView, ...], Proposals]:
    """Propose at the width that what changed in the images has in common; what was found before if it may be chance."""
    known = found[1].chance
    chance = chance_of(found[0], camera, options, widths=OTHER_WIDTHS, known=known, stopped=stopped)
    if chance is None or chance.probability < LEAST_CONFIDENCE:
        return found
    views = tuple(at_width(view, frames, chance.wider) for view in found[0])
    return views, proposals_of(views, camera, options, chance=chance)


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
    looks = appearances_of(counting, views, frames, camera)
    found = with_appearance(views, looks, frames, camera)
    return found, proposals_of(found, camera, options, confirmed=counting)


def appearances_of(
    clicks: Sequence[ReflectorClick], views: Sequence[DwellView], frames: FrameSource, camera: Camera
) -> list[Appearance]:
    """Return what confirmed clicks show; nothing of one that lies in no dwell, or no frame of which can be read.

    A click beside the reflector shows nothing either: the same would be found beside the others. How large the reflector is
    depends on the range, so on which of the dwells of its time a click is of: on that with which the other dwells show the same.

    Args:
        clicks: that count, the first one first.
        views: of all placements, as `dwell_views` found them.
        frames: of the camera.
        camera: the intrinsics.
    """
    looks: list[Appearance] = []
    for click in clicks:
        pixel_px = np.array([click.u_px, click.v_px])
        view = view_at(click.image_time, pixel_px, views)
        if view is None or _is_beside(click, view):
            continue
        others = [one for one in _meanwhile(click.image_time, views) if one is not view and has_changed(one, pixel_px)]
        shown = [look for one in (view, *others) if (look := appearance_of(one, frames, pixel_px)) is not None]
        if len({round(float(np.log(look.larger)), 1) for look in shown}) < 2:
            looks += shown[:1]
        elif looks:
            looks.append(min(shown, key=lambda look: abs(np.log(look.larger / looks[0].larger))))
        else:
            elsewhere = [one for one in views if not one.placement.start <= click.image_time <= one.placement.end]
            looks.append(max(shown, key=lambda look: likeness_elsewhere(look, elsewhere, frames, camera)))
    return looks


def view_at(image_time: TimeNs, pixel_px: Vector2, views: Sequence[DwellView]) -> DwellView | None:
    """Return the view of the dwell that a pixel of a frame is of; None if none of that time was looked at.

    Of two reflectors that stood at once, that with a candidate nearer to the pixel.

    Args:
        image_time: stamp of the frame.
        pixel_px: (2,) in it.
        views: of all placements.
    """
    return min(_meanwhile(image_time, views), key=lambda view: _distance_px(view, pixel_px), default=None)


def _meanwhile(image_time: TimeNs, views: Sequence[DwellView]) -> list[DwellView]:
    return [view for view in views if view.placement.start <= image_time <= view.placement.end and len(view.frames)]


def _is_beside(click: ReflectorClick, view: DwellView) -> bool:
    """Return whether a click is far from every place that changed while a reflector is seen at one of them."""
    off_px = _distance_px(view, np.array([click.u_px, click.v_px]))
    return off_px > _BESIDE * view.width_px and any(candidate.has_apex for candidate in view.candidates)


def _distance_px(view: DwellView, pixel_px: np.ndarray) -> float:
    return min((float(np.linalg.norm(candidate.pixel_px - pixel_px)) for candidate in view.candidates), default=np.inf)


def _placements(recording: RecordedFrames, gating: GatingOptions, stopped: Callable[[], bool]) -> tuple[Placement, ...]:
    """Search a whole recording, one stretch after another if it is long: memory stays bounded."""
    windows = takewhile(lambda _: not stopped(), recording.radar_windows())
    return tuple(
        placement
        for stretch in in_stretches(static_returns(window, gating) for window in windows)
        if len(stretch) and stretch.times_ns[-1] - stretch.times_ns[0] >= _SHORTEST_NS
        for placement in find_placements(stretch, gating)
    )


def _missing(placements: Sequence[Placement], recording: RecordedFrames) -> Unsolvable | None:
    """Say why there can be no proposals; None if there can."""
    if len(placements) < _LEAST_PLACEMENTS:
        return Unsolvable("too-few-placements", {"placements": len(placements), "needed": _LEAST_PLACEMENTS})
    times = recording.image_times
    seen = [
        np.searchsorted(times, placement.start) < np.searchsorted(times, placement.end, side="right")
        for placement in placements
    ]
    if not any(seen):
        first_s, last_s = ((int(time) - int(placements[0].start)) / NS_PER_S for time in (times[0], times[-1]))
        span = {"first_s": first_s, "last_s": last_s}
        return Unsolvable("no-frames-in-placements", {"placements": len(placements), **span})
    return None


ProposingStage: TypeAlias = Literal["off", "looking", "comparing", "ready", "failed"]
_FIRST, _EVERY = 4, 4
"""From so many dwells on there may be proposals, tried each time twice as many are seen; while a look is carried, after every
fourth."""
_LOOKS = 3
"""The first clicks show what the reflector looks like; with these, further ones tell where it is, but nothing new of its look."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class ProposingWish:
    """What to propose for.

    Attributes:
        camera: the intrinsics; None if there are none.
        options: of the calibration.
        placements: where the radar saw something stand still.
        clicks: of the session.
        dismissed: numbers of the placements that are not the reflector.
    """

    camera: Camera | None
    options: CalibrationOptions
    placements: tuple[Placement, ...]
    clicks: tuple[ReflectorClick, ...] = ()
    dismissed: frozenset[int] = frozenset()

    @property
    def confirmed(self) -> tuple[ReflectorClick, ...]:
        """The clicks that count."""
        return tuple(click for click in self.clicks if click.counts)


@dataclass(frozen=True, slots=True)
class ProposingProgress:
    """How far proposing is.

    Attributes:
        stage: what is being done.
        done: placements whose images were looked at, or compared with what was clicked.
        count: of all.
        problem: why there are no proposals, if the stage is "failed".
        hint: what to do about it.
    """

    stage: ProposingStage = "off"
    done: int = 0
    count: int = 0
    problem: str = ""
    hint: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class ProposingSnapshot:
    """The proposals at one moment.

    Attributes:
        progress: how far they are.
        views: of the placements, in their order, as far as they are known.
        proposals: as far as they can be made; they stay while better ones are being found.
    """

    progress: ProposingProgress = ProposingProgress()
    views: tuple[DwellView, ...] = ()
    proposals: Proposals = field(default_factory=lambda: Proposals(()))


@dataclass(frozen=True, slots=True)
class _Patient:
    """A recording whose images are decoded when nothing more urgent is going on."""

    recording: RecordedFrames
    wait: Callable[[], None]

    @property
    def image_times(self) -> TimesNs:
        return self.recording.image_times

    def image(self, index: int, /) -> np.ndarray:
        self.wait()
        return self.recording.image(index)

    def radar_windows(self) -> Iterable[RadarScans]:
        return self.recording.radar_windows()


class ProposingJob:
    """Proposes in a thread of its own. Every method may be called from any thread."""

    def __init__(
        self, recording: RecordedFrames, changed: Callable[[], None], wait: Callable[[], None] = lambda: None
    ) -> None:
        """Set up the job.

        Args:
            recording: with a radar and a camera.
            changed: called after every change, without any lock held.
            wait: called before each image and each proposing; returns when nothing more urgent is going on.
        """
        self._recording = _Patient(recording, wait)
        self._wait = wait
        self._changed = changed
        self._news = threading.Condition()
        self._wish: ProposingWish | None = None
        self._answered: ProposingWish | None = None
        self._thread: threading.Thread | None = None
        self._snapshot = ProposingSnapshot()
        self._closed = False
        self._seen: tuple[DwellView, ...] = ()
        self._seen_for: ProposingWish | None = None
        self._chance: Chance | None = None
        self._appearances: tuple[tuple[object, ...], list[Appearance]] = ((), [])
        self._carried: list[DwellView] = []
        self._carried_from: list[tuple[object, ...]] = []

    @property
    def snapshot(self) -> ProposingSnapshot:
        """The present state."""
        return self._snapshot

    def ask(self, wish: ProposingWish) -> None:
        """Propose for this wish instead of the last one; returns immediately. Images are not looked at again in vain."""
        with self._news:
            if self._closed:
                return
            self._wish = wish
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="proposing", daemon=True)
                self._thread.start()
            self._news.notify()

    def stop(self) -> None:
        """Propose nothing until the next wish."""
        with self._news:
            self._wish = None
            self._snapshot = ProposingSnapshot()
        self._changed()

    def close(self) -> None:
        """Stop, and wait until the thread has ended; nothing can be asked for any more."""
        with self._news:
            self._closed = True
            self._news.notify()
            thread = self._thread
        if thread is not None:
            thread.join()

    def _run(self) -> None:
        go_last()
        while True:
            with self._news:
                self._news.wait_for(lambda: self._closed or self._wish not in (None, self._answered))
                wish = self._answered = self._wish
                if self._closed or wish is None:
                    return
            with error_boundary("proposing where the reflector stood", self._failed):
                try:
                    self._answer(wish)
                except CalibrationError as error:
                    self._failed(str(error))

    def _answer(self, wish: ProposingWish) -> None:
        """Look at the images unless that is done; then propose, and carry what was clicked."""
        if self._seen_for is None or not _same_images(self._seen_for, wish):
            self._chance = None
            self._set(wish, stage="looking", done=0, count=len(wish.placements), problem="", hint="")
            found = find_proposals(
                self._recording,
                wish.camera,
                wish.options,
                placements=wish.placements,
                progress=self._take,
                stopped=lambda: not self._is_wanted(wish),
            )
            if not self._is_wanted(wish):
                return
            if isinstance(found, Unsolvable):
                said = outcome_remark(found)
                self._set(wish, Proposals(()), stage="failed", problem=str(said.message), hint=str(said.hint))
                return
            self._seen, self._seen_for, self._chance = found[0], wish, found[1].chance
            self._carried, self._carried_from = list(found[0]), [()] * len(found[0])
            self._appearances = ((), [])
        self._carry(wish)

    def _carry(self, wish: ProposingWish) -> None:
        """Find the look of the first clicks in one dwell after the other, the most confident first; newer wishes join in."""
        proposed_for, since = None, 0
        while self._is_wanted(wish) and (newest := self._wish) is not None and newest.camera is not None:
            self._answered = newest
            first = sorted(newest.confirmed, key=lambda click: (len(click.id), click.id))[:_LOOKS]
            key = tuple((click.id, click.image_time, click.u_px, click.v_px) for click in first)
            if self._appearances[0] != key:
                self._appearances = (key, appearances_of(first, self._seen, self._recording, newest.camera))
            looks = self._appearances[1]
            if not looks:
                self._carried, self._carried_from = list(self._seen), [key] * len(self._seen)
            left = [number for number in self._in_turn(newest) if self._carried_from[number] != key]
            if newest is not proposed_for or since >= _EVERY or not left:
                known = self._snapshot.proposals.chance if newest is proposed_for and left else None
                self._propose(newest, self._carried, chance=known if newest.confirmed else self._chance)
                proposed_for, since = newest, 0
                left = [number for number in self._in_turn(newest) if self._carried_from[number] != key]
            done = len(self._seen) - len(left)
            self._set(newest, stage="comparing" if left else "ready", done=done, count=len(self._seen), problem="")
            if not left:
                return
            number, since = left[0], since + 1
            seen = self._seen[number : number + 1]
            self._carried[number : number + 1] = with_appearance(seen, looks, self._recording, newest.camera)
            self._carried_from[number] = key

    def _in_turn(self, wish: ProposingWish) -> list[int]:
        """Return the numbers of the dwells that wait for a click, in the order of the proposals."""
        now = self._snapshot.proposals
        number = {id(view.placement): at for at, view in enumerate(self._seen)}
        order = [*(one.placement for one in now.ranked), *(one for one, _ in now.unproposed)]
        return [at for one in order if (at := number.get(id(one), -1)) >= 0 and at not in wish.dismissed]

    def _take(self, progress: ViewProgress | str) -> None:
        wish = self._wish
        if wish is None or isinstance(progress, str):
            return
        if progress.done >= _FIRST and progress.done & (progress.done - 1) == 0:
            self._propose(wish, progress.views, done=progress.done, count=progress.count)
        else:
            self._set(wish, done=progress.done, count=progress.count)

    def _propose(
        self, wish: ProposingWish, views: Sequence[DwellView], *, chance: Chance | None = None, **changes: object
    ) -> None:
        if wish.camera is None:
            return
        self._wait()
        kept = [view for number, view in enumerate(views) if number not in wish.dismissed]
        proposals = proposals_of(kept, wish.camera, wish.options, confirmed=wish.confirmed, chance=chance)
        self._set(wish, proposals, tuple(views), **changes)

    def _is_wanted(self, wish: ProposingWish) -> bool:
        """Whether looking at the images for this wish serves the newest one, too."""
        newest = self._wish
        return not self._closed and newest is not None and _same_images(newest, wish)

    def _failed(self, line: str) -> None:
        _log.warning("nothing could be proposed: %s", line)
        self._set(self._wish, stage="failed", problem=line, hint="")

    def _set(
        self,
        wish: ProposingWish | None,
        proposals: Proposals | None = None,
        views: tuple[DwellView, ...] | None = None,
        **changes: object,
    ) -> None:
        """Change the progress, the proposals and the views if they are given, unless proposing was stopped meanwhile."""
        with self._news:
            if self._wish is None or wish is None:
                return
            now = self._snapshot
            progress = replace(now.progress, **changes)  # type: ignore[arg-type]
            self._snapshot = ProposingSnapshot(
                progress,
                now.views if views is None else views,
                now.proposals if proposals is None else proposals,
            )
        self._changed()


def _same_images(wish: ProposingWish, other: ProposingWish) -> bool:
    """Return whether two wishes need the same placements looked at with the same camera."""
    return wish.camera is other.camera and wish.placements is other.placements
