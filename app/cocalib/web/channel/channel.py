"""One page's channel: reads its messages and answers them in order, without waiting for other pages."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from typing import Any, Protocol, get_args

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.association.pairing import RadarSource
from calib_core.errors import CalibrationError, InputError
from calib_core.measurements import Candidate, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.proposing.apex import Apex, NoApex, find_apex
from calib_core.results import Calibration
from cocalib.platform.error_boundary import error_boundary
from cocalib.session.events import Step
from cocalib.session.state import Session
from cocalib.solving.solving import window_candidates
from cocalib.view.candidates import PairCandidates, click_candidates, pair_of_click
from cocalib.view.wording import sentence
from cocalib.web.channel.dropped_file import sorted_file
from cocalib.web.channel.hub import Hub
from cocalib.web.channel.opening_service import opening_answers
from cocalib.web.channel.outbox import NewestWins, Outbox, Shown
from cocalib.web.channel.radar_survey import placements_at
from cocalib.web.channel.review import ReviewService
from cocalib.web.channel.space_feed import SpaceFeed
from cocalib.web.frames import Frame, FrameStore
from cocalib.web.messages.incoming import (
    BoxesWanted,
    Command,
    CursorMoved,
    FileDropped,
    FrameWanted,
    Hello,
    ImportWanted,
    Incoming,
    MovingBoxesWanted,
    ProposingSwitch,
    ReviewRequest,
    SnapWanted,
    ViewpointWanted,
    ViewWanted,
    parse,
    request_of,
)
from cocalib.web.messages.lens_messages import LensCalibrate, LensCancel, LensUse
from cocalib.web.messages.opening_messages import OpeningCommand
from cocalib.web.messages.outgoing import Done, Problem, Snapped, encode, encode_frame
from cocalib.web.radar_sight import look_of, overlay_of
from cocalib.web.view3d.scene import TabScene

_GREET_EVERY_S = 0.25
"""Minimum time between two greetings of one page, and between two whole Views that it asks for [s]."""


class Socket(Protocol):
    """The part of a WebSocket that a channel needs."""

    async def recv(self) -> str | bytes: ...  # noqa: D102
    async def send(self, message: str | bytes, /) -> None: ...  # noqa: D102


class Channel:
    """One page. Runs on the event loop."""

    def __init__(self, hub: Hub) -> None:
        self.outbox = Outbox()
        self.scene: TabScene | None = None
        self._hub = hub
        self._cursor = CursorMoved(0)
        self._shown: Shown | None = None
        self._greetings = NewestWins(self._greet, self._report)
        self._views = NewestWins(self._show_whole, self._report)
        self._frames = NewestWins(self._send_frame, self._report)
        self._overlay = NewestWins(self._send_overlay, self._report)
        self._space = NewestWins(self._draw_space, self._report)
        self._review = ReviewService(hub.workspace, hub.recording, lambda: hub.camera, self.outbox, self._report)
        self._space_feed = SpaceFeed(hub)
        self._candidates = NewestWins(self._send_candidates, self._report)
        self._forward = True
        self._has_candidates = False
        self._handlers: Mapping[type, Callable[[Any], Awaitable[None] | None]] = {
            Hello: self._greetings.give,
            ViewWanted: self._views.give,
            FrameWanted: self._frames.give,
            CursorMoved: self._move,
            ViewpointWanted: self._look_from,
            SnapWanted: self._snap,
            ImportWanted: self._import,
            FileDropped: self._sort,
            ProposingSwitch: hub.proposing.switch,
            BoxesWanted: hub.boxes.take,
            MovingBoxesWanted: hub.boxes.find,
            LensCalibrate: hub.lens.calibrate,
            LensCancel: hub.lens.cancel,
            LensUse: hub.lens.use,
            **dict.fromkeys(get_args(ReviewRequest), self._review.give),
        }
        """What is done with each command; every other one is a step of the session."""

    async def run(self, socket: Socket) -> None:
        """Serve the page until it disconnects; the socket's exception is then raised to the caller."""
        self._hub.tabs.add(self)
        sending = asyncio.create_task(self.outbox.deliver(socket.send))
        reading = asyncio.create_task(self._read(socket))
        try:
            done, _ = await asyncio.wait({sending, reading}, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            self._hub.tabs.discard(self)
            for worker in (self._greetings, self._views, self._frames, self._overlay, self._space, self._candidates):
                worker.close()
            self._review.close()
            for task in (sending, reading):
                task.cancel()
            await asyncio.gather(sending, reading, return_exceptions=True)

    @property
    def is_playing(self) -> bool:
        """Whether the page plays now."""
        return self._cursor.playing

    def show(self) -> None:
        """Send the newest View, or what differs from the one that the page has."""
        self.outbox.put(self._view_text, kind="view")

    def refresh(self) -> None:
        """Draw again: cursor or session have changed, or the 3D view is connected. A page that plays shows no candidates."""
        self._overlay.give(self._cursor)
        self._space.give(self._cursor)
        if not self._cursor.playing:
            self._candidates.give(self._cursor)

    async def _read(self, socket: Socket) -> None:
        while True:
            text = await socket.recv()
            with error_boundary("a page's message", partial(self._refuse, text)):
                try:
                    await self._take(parse(text))
                except CalibrationError as error:
                    self._refuse(text, str(error))

    def _report(self, line: str) -> None:
        self.outbox.put(encode(Problem(sentence(line))))

    def _refuse(self, text: str | bytes, reason: str) -> None:
        self.outbox.put(encode(Problem(sentence(reason), request=request_of(text))))

    async def _take(self, incoming: Incoming) -> None:
        """Carry out a command, or answer a message about the choice of a recording."""
        if not isinstance(incoming.command, OpeningCommand):
            await self._obey(incoming.command)
            if incoming.request is not None:
                self.outbox.put(encode(Done(incoming.request)))
            return
        for text in await opening_answers(self._hub.opening_service, incoming):
            self.outbox.put(text)

    async def _obey(self, command: Command) -> None:
        """Carry out a command of the page.

        Raises:
            CalibrationError: it cannot be done; nothing changed.
        """
        doing = self._handlers.get(type(command), self._step)(command)
        if doing is not None:
            await doing

    async def _snap(self, wanted: SnapWanted) -> None:
        """Search for an apex around a mark, or next to a new click.

        Raises:
            CalibrationError: the frame cannot be read.
        """
        hub = self._hub
        if wanted.near:
            answer = await hub.proposing.apex_near(wanted)
        else:
            answer = await snapped(wanted, hub.moments, hub.frames, hub.executor)
        self.outbox.put(encode(answer))

    def _look_from(self, wanted: ViewpointWanted) -> None:
        if self.scene is not None:
            self.scene.look_from(wanted.viewpoint)

    async def _import(self, wanted: ImportWanted) -> None:
        await self._change(partial(self._hub.workspace.import_clicks, wanted.text, wanted.name))

    async def _sort(self, file: FileDropped) -> None:
        """Say what a dropped file is.

        Raises:
            InputError: it is nothing that the page takes.
        """
        sort = partial(sorted_file, file, has_camera=self._hub.camera is not None)
        self.outbox.put(encode(await asyncio.get_running_loop().run_in_executor(self._hub.executor, sort)))

    async def _step(self, step: Step) -> None:
        await self._change(partial(self._hub.workspace.dispatch, step))

    async def _change(self, change: Callable[[], object]) -> None:
        """Change the session, off the event loop.

        Raises:
            CalibrationError: it cannot be done; nothing changed.
        """
        await asyncio.get_running_loop().run_in_executor(self._hub.steps, change)

    def _view_text(self) -> str:
        """Write the message that makes the page show the newest View; called when the page can take it."""
        text, self._shown = self._hub.feed.message(self._shown)
        return text

    def _move(self, command: CursorMoved) -> None:
        if not 0 <= command.index < len(self._hub.moments):
            return
        self._cursor = command
        self.refresh()

    async def _greet(self, _wanted: Hello) -> None:
        """Greet the page, at most so often: a greeting costs more than asking for it."""
        self._shown = None
        self._hub.greet(self)
        await asyncio.sleep(_GREET_EVERY_S)

    async def _show_whole(self, _wanted: ViewWanted) -> None:
        """Send the whole View, at most as often as a greeting."""
        self._shown = None
        self.show()
        await asyncio.sleep(_GREET_EVERY_S)

    async def _send_frame(self, wanted: FrameWanted) -> None:
        try:
            frame = await self._hub.frames.get(wanted.index, wanted.size)
        except (CalibrationError, ValueError, IndexError) as error:
            self.outbox.put(
                encode(Problem(f"Frame {wanted.index + 1} cannot be shown: {error}", request=wanted.request))
            )
            return
        header = replace(frame.header, request=wanted.request)
        self.outbox.put(encode_frame(header, frame.data), kind="frame")
        if wanted.index != self._cursor.index:
            self._forward = wanted.index > self._cursor.index
        self._hub.frames.prefetch(wanted.index, wanted.size, 1 if self._forward or wanted.playing else -1)

    async def _send_overlay(self, cursor: CursorMoved) -> None:
        stamp = TimeNs(int(self._hub.moments[cursor.index]))
        session = self._hub.workspace.session
        if not self._hub.workspace.facts.has_images:
            trail = await self._trail(stamp, cursor.trail_s)
            look = look_of(cursor.index, stamp, trail, session.options.gating)
            self.outbox.put(encode(look), kind="overlay")
            return
        scan = await self._scan(stamp)
        overlay = overlay_of(
            cursor.index, session, scan, placements_at(self._hub.survey, stamp), self._hub.workspace.reference
        )
        self.outbox.put(encode(overlay), kind="overlay")

    async def _send_candidates(self, cursor: CursorMoved) -> None:
        """Send the returns that may belong to the selected click; nothing if none is selected, as before."""
        if cursor.selected is None and not self._has_candidates:
            return
        self._has_candidates = cursor.selected is not None
        session = self._hub.workspace.session
        find = partial(candidates_of, session, cursor.selected, self._hub.recording)
        candidates = await asyncio.get_running_loop().run_in_executor(self._hub.executor, find)
        self.outbox.put(encode(candidates), kind="candidates")

    async def _draw_space(self, cursor: CursorMoved) -> None:
        """Draw the 3D view, and send what the page draws over it."""
        if self.scene is None:
            return
        look = await self._space_feed.draw(cursor, self.scene)
        if look is not None:
            self.outbox.put(encode(look), kind="space")

    async def _scan(self, stamp: TimeNs) -> RadarScan | None:
        """Return the scan at a time; None if it cannot be read."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._hub.executor, self._hub.radar.scan_at, stamp)
        except CalibrationError:
            return None

    async def _trail(self, stamp: TimeNs, length_s: float) -> RadarScans:
        """Return the scans of the last seconds; none if they cannot be read."""
        try:
            look = partial(self._hub.radar.trail, stamp, length_s)
            return await asyncio.get_running_loop().run_in_executor(self._hub.executor, look)
        except CalibrationError:
            return RadarScans()


def candidates_of(session: Session, selected: str | None, recording: RadarSource) -> PairCandidates:
    """List the returns that may belong to the selected click; none if there is no such click, or it has no pair.

    Args:
        session: with the latest outcome.
        selected: id of the click; None if none is selected.
        recording: where further returns of its window come from, if no candidate of its pair fits.
    """
    click = next((click for click in session.clicks if click.id == selected), None)
    pair = None if click is None else pair_of_click(session, click.id)
    if click is None or pair is None:
        return PairCandidates(selected or "", session.revision, ())
    return click_candidates(session, pair, _further(session, click, recording))


def _further(session: Session, click: ReflectorClick, recording: RadarSource) -> tuple[Candidate, ...]:
    """Return more returns of the window for a click that does not agree with the others."""
    if not isinstance(session.outcome, Calibration):
        return ()
    result = next(pair for pair in session.outcome.pairs if pair.id == click.id)
    if result.inlier or not result.outlier_probability > 0.0:
        return ()
    try:
        return window_candidates(recording, click, session.options)
    except CalibrationError:
        return ()


async def snapped(wanted: SnapWanted, moments: TimesNs, frames: FrameStore, executor: Executor) -> Snapped:
    """Search for the apex near a pixel.

    Args:
        wanted: by a page.
        moments: (m,) stamps of the frames [ns], ascending.
        frames: of the recording.
        executor: where to decode and search.

    Raises:
        InputError: no frame has this stamp, or the frame cannot be shown.
        MessageError: the frame cannot be read.
    """
    if not len(frames):
        raise InputError("this recording has no images to snap in; open one with a camera topic")
    index = int(np.searchsorted(moments, wanted.image_time))
    if index == len(moments) or int(moments[index]) != wanted.image_time:
        raise InputError(f"no frame has the stamp {wanted.image_time}; the image may belong to another recording")
    frame = await frames.get(index)
    answer = await asyncio.get_running_loop().run_in_executor(executor, _search, frame, wanted.pixel_px)
    if isinstance(answer, NoApex):
        return Snapped(None, None, f"No corner found: {answer.reason}.", wanted.id)
    column, row = (float(value) for value in answer.pixel_px)
    words = f"Snapped to the reflector's apex, with a standard deviation of {answer.sigma_px:.2f} px."
    return Snapped((column, row), answer.sigma_px, words, wanted.id)


def _search(frame: Frame, pixel_px: tuple[float, float]) -> Apex | NoApex:
    import cv2

    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    grey = cv2.imdecode(np.frombuffer(frame.data, dtype=np.uint8), flags)
    if grey is None:
        raise InputError(f"frame {frame.header.index + 1} cannot be decoded; snap in another frame of this placement")
    return find_apex(np.asarray(grey), np.array(pixel_px))
