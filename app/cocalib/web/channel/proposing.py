"""Proposals for the pages of a recording: made in the background, and anew with each click."""

import asyncio
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from calib_core.association.placements import Placement
from calib_core.measurements import NS_PER_S, Stamp
from calib_core.proposing import DwellView, Proposal
from calib_core.proposing.apex import Apex, find_apex
from calib_core.recordings import FollowedRecording, Recording
from cocalib.proposing import ProposingJob, ProposingProgress, ProposingSnapshot, ProposingWish, view_at
from cocalib.view.placement_states import SeenPlacements, Spots, is_dismissed, unmarked
from cocalib.view.wording import sentence
from cocalib.web.channel.outbox import Notice, Outbox
from cocalib.web.messages.incoming import ProposingSwitch, SnapWanted
from cocalib.web.messages.outgoing import (
    Outgoing,
    ProposalNews,
    ProposalPlace,
    ProposalRow,
    Snapped,
    UnproposedRow,
    encode,
)
from cocalib.workspace import Workspace

_REACH, _LEAST_REACH_PX = 0.1, 4.0
"""How far from a click an apex is still what was clicked: in widths of the reflector, and at least."""
_SHORTEST_S = 2.0
"""A target that stands still for less is not looked for in the images."""
_GROWING = (
    "the recording is still being written: what changed in the images shows once it is complete",
    "click the reflector, or wait until the recording is complete",
)
_NO_IMAGES = ("there are no images to look at", "open the camera's recording, too")
_NO_RADAR = (
    "there are no radar scans, so nothing says when the reflector stood still",
    "open the radar's recording, too",
)


class ProposingService:
    """Proposes for all pages of a recording. Runs on the event loop, except where it says otherwise."""

    def __init__(
        self, workspace: Workspace, recording: Recording, tell: Callable[[Outgoing, str], None], *, on: bool
    ) -> None:
        """Set up the service.

        Args:
            workspace: has the clicks, the options and the intrinsics.
            recording: has the images.
            tell: sends a message of a kind to all pages.
            on: whether to propose without being asked.
        """
        self._workspace = workspace
        self._recording = recording
        self._tell = tell
        self._on = on
        self._notice = Notice(self._show)
        self._job = ProposingJob(recording, self._notice.give, workspace.wait_for_answer)
        self._numbers: tuple[int, ...] = ()
        self._placements: tuple[Placement, ...] | None = None
        self._all: tuple[Placement, ...] = ()
        self._asked: tuple[object, ...] = ()
        self._shown_views: tuple[DwellView, ...] = ()

    def start(self) -> None:
        """Begin to tell the pages, on the running loop."""
        self._notice.start()

    def greet(self, outbox: Outbox) -> None:
        """Send the present state to a page that has just opened."""
        outbox.put(encode(self._news()), kind="proposals")

    def surveyed(self, placements: tuple[Placement, ...]) -> None:
        """Propose for these placements from now on."""
        self._all = placements
        long = [
            number
            for number, placement in enumerate(placements)
            if placement.end - placement.start >= _SHORTEST_S * NS_PER_S
        ]
        found = tuple(placements[number] for number in long)
        if self._placements is None or _times(found) != _times(self._placements):
            self._numbers, self._placements = tuple(long), found
        self.follow()

    def follow(self) -> None:
        """Propose anew if the clicks, the options, the intrinsics or the dismissed placements changed."""
        if not self._on or self._placements is None or self._obstacle() is not None:
            return
        session, camera = self._workspace.session, self._workspace.camera
        asked = (session.clicks, session.options, session.dismissed, camera, self._placements)
        if len(asked) == len(self._asked) and all(one is old for one, old in zip(asked, self._asked, strict=True)):
            return
        self._asked = asked
        gone = frozenset(
            number for number, placement in enumerate(self._placements) if is_dismissed(placement, session)
        )
        self._job.ask(ProposingWish(camera, session.options, self._placements, session.clicks, gone))

    async def apex_near(self, wanted: SnapWanted) -> Snapped:
        """Search for the apex next to a click, no larger than the reflector of its placement, off the event loop.

        Args:
            wanted: by a page, for a click that is not placed yet.

        Raises:
            CalibrationError: the clicked frame cannot be read.
        """
        return await asyncio.to_thread(self._apex_near, wanted)

    def _apex_near(self, wanted: SnapWanted) -> Snapped:
        pixel_px = np.array(wanted.pixel_px)
        frame = self._workspace.facts.frame_at(wanted.image_time)
        view = view_at(wanted.image_time, pixel_px, self._job.snapshot.views)
        if frame is None or view is None:
            return Snapped(None, None, "The images of this placement were not looked at.", wanted.id)
        reach_px = max(_LEAST_REACH_PX, _REACH * view.width_px)
        apex = find_apex(self._recording.image(frame), pixel_px, reach_px=reach_px, size_px=view.width_px)
        if not isinstance(apex, Apex):
            return Snapped(None, None, "The image shows no apex there.", wanted.id)
        column, row = (float(value) for value in apex.pixel_px)
        words = f"At the reflector's apex, with a standard deviation of {apex.sigma_px:.2f} px."
        return Snapped((column, row), apex.sigma_px, words, wanted.id)

    def switch(self, switch: ProposingSwitch) -> None:
        """Propose, or propose nothing any more."""
        self._on, self._asked = switch.on, ()
        if not self._on:
            self._job.stop()
        self.follow()
        self._notice.give()

    async def close(self) -> None:
        """Stop proposing, and tell the pages nothing more."""
        self._notice.stop()
        await asyncio.to_thread(self._job.close)

    def _obstacle(self) -> tuple[str, str] | None:
        """Say why there can be no proposals, and what to do about it; None if there can."""
        if not self._workspace.facts.has_images:
            return _NO_IMAGES
        if not len(self._recording.radar_times):
            return _NO_RADAR
        if isinstance(self._recording, FollowedRecording) and not self._recording.is_complete:
            return _GROWING
        return None

    def _show(self) -> None:
        self._tell(self._news(), "proposals")
        self._show_spots()

    def _show_spots(self) -> None:
        """Say which placements the images show, once all were looked at."""
        now = self._job.snapshot
        if now.progress.stage != "ready" or now.views is self._shown_views:
            return
        self._shown_views = now.views
        number = {id(one): self._numbers[at] for at, one in enumerate(self._placements or ())}
        spots = {
            number[id(view.placement)]: Spots(
                np.array([one.pixel_px for one in view.candidates]).reshape(-1, 2), view.width_px
            )
            for view in now.views
            if len(view.frames) and id(view.placement) in number
        }
        self._workspace.show_placements(SeenPlacements(self._all, spots))

    def _news(self) -> ProposalNews:
        now = self._job.snapshot
        problem, hint = map(sentence, self._obstacle() or (now.progress.problem, now.progress.hint))
        if not self._on:
            return ProposalNews(False, ProposingProgress(problem=problem, hint=hint))
        stage = "failed" if problem else now.progress.stage
        number = {id(one): self._numbers[at] for at, one in enumerate(self._placements or ())}
        rows = tuple(
            row
            for one in now.proposals.ranked
            if id(one.placement) in number and (row := self._row(one, number[id(one.placement)], now)).places
        )
        without = tuple(
            UnproposedRow(number[id(one)], reason) for one, reason in now.proposals.unproposed if id(one) in number
        )
        slips = tuple(slip.click for slip in now.proposals.slips)
        return ProposalNews(True, replace(now.progress, stage=stage, problem=problem, hint=hint), rows, without, slips)

    def _row(self, proposal: Proposal, placement: int, now: ProposingSnapshot) -> ProposalRow:
        """Return a proposal without the places that are marked already; without any, it is none."""
        view: DwellView = next(one for one in now.views if one.placement is proposal.placement)
        spots = Spots(np.array([candidate.pixel_px for candidate in proposal.candidates]), view.width_px)
        free = unmarked(spots, proposal.placement, self._workspace.session.clicks)
        places = tuple(
            ProposalPlace(
                (round(candidate.pixel_px[0].item(), 3), round(candidate.pixel_px[1].item(), 3)),
                round(candidate.sigma_px, 3),
            )
            for candidate, is_free in zip(proposal.candidates, free.tolist(), strict=True)
            if is_free
        )
        return ProposalRow(
            placement=placement,
            frame=self._workspace.facts.frame_at(proposal.image_time) or 0,
            image_time=Stamp.of(proposal.image_time),
            width_px=round(view.width_px, 1),
            confidence=round(proposal.confidence, 3),
            reason=proposal.reason,
            places=places,
        )


def _times(placements: tuple[Placement, ...]) -> list[tuple[int, int]]:
    return [(int(placement.start), int(placement.end)) for placement in placements]
