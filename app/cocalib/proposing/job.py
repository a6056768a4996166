"""Proposing in the background: the pictures are looked at once, and each confirmed click is carried to the other placements."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.measurements import ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import DwellView, Proposals, ViewProgress, proposals_of
from calib_core.proposing.look import Look, with_look
from cocalib.platform.error_boundary import error_boundary
from cocalib.proposing.finding import RecordedFrames, find_proposals, looks_of

ProposingStage: TypeAlias = Literal["off", "looking", "comparing", "ready", "failed"]
_EARLY = (3, 6)
_EVERY = 4
"""After so many dwells, and after each further four, there are new proposals."""
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


@dataclass(frozen=True, slots=True, eq=False)
class ProposingSnapshot:
    """How far the proposals are.

    Attributes:
        stage: what is being done.
        done: placements whose pictures were looked at, or compared with what was clicked.
        count: of all.
        problem: why there are no proposals, if the stage is "failed".
        hint: what to do about it.
        views: of the placements, in their order, as far as they are known.
        proposals: as far as they can be made; they stay while better ones are being found.
    """

    stage: ProposingStage = "off"
    done: int = 0
    count: int = 0
    problem: str = ""
    hint: str = ""
    views: tuple[DwellView, ...] = ()
    proposals: Proposals = field(default_factory=lambda: Proposals(()))


class ProposingJob:
    """Proposes in a thread of its own. Every method may be called from any thread."""

    def __init__(self, recording: RecordedFrames, changed: Callable[[], None]) -> None:
        """Set up the job.

        Args:
            recording: with a radar and a camera.
            changed: called after every change, without any lock held.
        """
        self._recording = recording
        self._changed = changed
        self._news = threading.Condition()
        self._wish: ProposingWish | None = None
        self._answered: ProposingWish | None = None
        self._thread: threading.Thread | None = None
        self._snapshot = ProposingSnapshot()
        self._closed = False
        self._seen: tuple[DwellView, ...] = ()
        self._seen_for: ProposingWish | None = None
        self._looks: dict[tuple[object, ...], Look | None] = {}
        self._carried: list[DwellView] = []
        self._carried_from: list[tuple[object, ...]] = []

    @property
    def snapshot(self) -> ProposingSnapshot:
        """The present state."""
        return self._snapshot

    def ask(self, wish: ProposingWish) -> None:
        """Propose for this wish instead of the last one; returns immediately. Pictures are not looked at again in vain."""
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
        """Look at the pictures unless that is done; then propose, and carry what was clicked."""
        if self._seen_for is None or not _same_pictures(self._seen_for, wish):
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
                self._set(wish, stage="failed", problem=found.reason, hint=found.hint, proposals=Proposals(()))
                return
            self._seen, self._seen_for = found[0], wish
            self._carried, self._carried_from = list(found[0]), [()] * len(found[0])
            self._looks.clear()
        self._carry(wish)

    def _carry(self, wish: ProposingWish) -> None:
        """Find the look of the first clicks in one dwell after the other, the most confident first; newer wishes join in."""
        proposed_for, since = None, 0
        while self._is_wanted(wish) and (newest := self._wish) is not None and newest.camera is not None:
            self._answered = newest
            first = sorted(newest.confirmed, key=lambda click: (len(click.id), click.id))[:_LOOKS]
            key = tuple((click.id, click.image_time, click.u_px, click.v_px) for click in first)
            looks = [look for click in first if (look := self._look(click)) is not None]
            if not looks:
                self._carried, self._carried_from = list(self._seen), [key] * len(self._seen)
            left = [number for number in self._in_turn(newest) if self._carried_from[number] != key]
            if newest is not proposed_for or since >= _EVERY or not left:
                self._propose(newest, self._carried)
                proposed_for, since = newest, 0
                left = [number for number in self._in_turn(newest) if self._carried_from[number] != key]
            done = len(self._seen) - len(left)
            self._set(newest, stage="comparing" if left else "ready", done=done, count=len(self._seen), problem="")
            if not left:
                return
            number, since = left[0], since + 1
            seen = self._seen[number : number + 1]
            self._carried[number : number + 1] = with_look(seen, looks, self._recording, newest.camera)
            self._carried_from[number] = key

    def _in_turn(self, wish: ProposingWish) -> list[int]:
        """Return the numbers of the dwells that wait for a click, in the order of the proposals."""
        now = self._snapshot.proposals
        number = {id(view.placement): at for at, view in enumerate(self._seen)}
        order = [*(one.placement for one in now.ranked), *(one for one, _ in now.unproposed)]
        return [at for one in order if (at := number.get(id(one), -1)) >= 0 and at not in wish.dismissed]

    def _look(self, click: ReflectorClick) -> Look | None:
        key = (click.id, click.image_time, click.u_px, click.v_px)
        if key not in self._looks:
            self._looks[key] = next(iter(looks_of(click, self._seen, self._recording)), None)
        return self._looks[key]

    def _take(self, progress: ViewProgress | str) -> None:
        wish = self._wish
        if wish is None or isinstance(progress, str):
            return
        if progress.done in _EARLY or progress.done % _EVERY == 0:
            self._propose(wish, progress.views, done=progress.done, count=progress.count)
        else:
            self._set(wish, done=progress.done, count=progress.count)

    def _propose(self, wish: ProposingWish, views: Sequence[DwellView], **changes: object) -> None:
        if wish.camera is None:
            return
        kept = [view for number, view in enumerate(views) if number not in wish.dismissed]
        found = proposals_of(kept, wish.camera, wish.options, confirmed=wish.confirmed)
        self._set(wish, views=tuple(views), proposals=found, **changes)

    def _is_wanted(self, wish: ProposingWish) -> bool:
        """Whether looking at the pictures for this wish serves the newest one, too."""
        newest = self._wish
        return not self._closed and newest is not None and _same_pictures(newest, wish)

    def _failed(self, line: str) -> None:
        _log.warning("nothing could be proposed: %s", line)
        self._set(self._wish, stage="failed", problem=line, hint="")

    def _set(self, wish: ProposingWish | None, **changes: object) -> None:
        """Change the snapshot, unless proposing was stopped meanwhile."""
        with self._news:
            if self._wish is None or wish is None:
                return
            self._snapshot = replace(self._snapshot, **changes)  # type: ignore[arg-type]
        self._changed()


def _same_pictures(one: ProposingWish, other: ProposingWish) -> bool:
    """Return whether two wishes need the same placements looked at with the same camera."""
    return one.camera is other.camera and one.placements is other.placements
