"""What all tabs share: the latest View, the survey of the radar, and the frames."""

import asyncio
import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Protocol

from calib_core.camera import Camera
from calib_core.errors import CalibrationError
from calib_core.measurements import Stamp, TimeNs
from calib_core.recordings import FollowedRecording, Recording, TopicSummary, clock_lines
from calib_core.results import DataWarning
from cocalib.platform.error_boundary import error_boundary
from cocalib.platform.resources import version
from cocalib.view.model import View, warning_row
from cocalib.view.placement_states import SeenPlacements
from cocalib.web.channel.boxes import BoxService
from cocalib.web.channel.image_changes import ImageChanges, changes_of
from cocalib.web.channel.lens import LensService
from cocalib.web.channel.live_edge import LiveEdge
from cocalib.web.channel.opening_service import NoOpening, OpeningService
from cocalib.web.channel.outbox import Outbox, ViewFeed
from cocalib.web.channel.proposing import ProposingService
from cocalib.web.channel.radar_survey import Survey, survey_of
from cocalib.web.frames import FrameStore
from cocalib.web.messages.outgoing import (
    Outgoing,
    Progress,
    RecordingNote,
    SensorNote,
    SessionNote,
    StampColumns,
    encode,
)
from cocalib.web.messages.space_messages import Placements
from cocalib.web.radar_sight import RadarSight
from cocalib.workspace import Workspace

_SEARCHING = "Searching the radar data for placements"
_log = logging.getLogger(__name__)


class Tab(Protocol):
    """One open page."""

    outbox: Outbox

    @property
    def is_playing(self) -> bool:
        """Whether the page plays now."""

    def show(self) -> None:
        """Send the newest View, or what differs from the one that the page has."""

    def refresh(self) -> None:
        """Draw the overlay and the 3D view again, after a change of the session."""


class Hub:
    """Runs on viser's event loop, except for the workspace's callback."""

    def __init__(
        self,
        workspace: Workspace,
        recording: Recording,
        executor: Executor,
        *,
        opening_service: OpeningService | None = None,
        opening: int = 1,
        proposes: bool = False,
    ) -> None:
        self.opening_service: OpeningService = opening_service or NoOpening()
        self._opening = opening
        self.workspace = workspace
        self.recording = recording
        self.executor = executor
        self.frames = FrameStore(recording, len(recording.image_times), executor, camera=lambda: workspace.camera)
        self.radar = RadarSight(recording)
        self.moments = workspace.facts.moments
        self.survey: Survey | None = None
        self.image_changes = ImageChanges()
        self.tabs: set[Tab] = set()
        self.steps = ThreadPoolExecutor(max_workers=1, thread_name_prefix="steps")
        self.feed = ViewFeed(workspace.view)
        self.boxes = BoxService(workspace, recording, executor, self.broadcast)
        self.lens = LensService(workspace, recording, self.broadcast)
        self.proposing = ProposingService(workspace, recording, self.broadcast, on=proposes)
        self._searching: asyncio.Task[None] | None = None
        self._edge = (
            LiveEdge(self, workspace, recording, workspace.camera) if isinstance(recording, FollowedRecording) else None
        )

    async def start(self) -> None:
        """Subscribe to the workspace, and start searching the radar."""
        loop = asyncio.get_running_loop()
        self.lens.start()
        self.proposing.start()
        self._end_subscription = self.workspace.subscribe(
            lambda view: None if loop.is_closed() else _soon(loop, partial(self._take, view))
        )
        self._searching = loop.create_task(self._edge.run() if self._edge else self._search())

    async def end(self) -> None:
        """Unsubscribe, and cancel pending work."""
        self._end_subscription()
        if self._searching is not None:
            self._searching.cancel()
            await asyncio.gather(self._searching, return_exceptions=True)
        await self.lens.close()
        await self.proposing.close()
        await self.boxes.close()
        await self.frames.close()

    @property
    def camera(self) -> Camera | None:
        """The intrinsics in use; None if there are none."""
        return self.workspace.camera

    @property
    def view(self) -> View:
        """The latest View of the workspace."""
        return self.feed.newest

    def greet(self, tab: Tab) -> None:
        """Send the current state to a page that has just opened."""
        outbox = tab.outbox
        outbox.put(encode(self._recording_note()), kind="recording")
        tab.show()
        self.lens.greet(outbox)
        self.proposing.greet(outbox)
        self.boxes.greet(outbox)
        if self.survey is not None:
            for kind, message in self._survey_messages(self.survey):
                outbox.put(encode(message), kind=kind)
        else:
            outbox.put(encode(Progress(_SEARCHING, 0, 1)), kind="progress")
        if self._edge is not None:
            outbox.put(encode(self._edge.note), kind="following")

    def grown(self, count: int) -> None:
        """Take note of the number of frames of a recording that is still being written."""
        self.frames.extend(count)

    def concluded(self) -> None:
        """Show what is known of the recording now that it is complete: its warnings, and how its sensors are read."""
        self.broadcast(self._recording_note(), "recording")
        self.proposing.follow()

    def surveyed(self, survey: Survey) -> None:
        """Show what the radar alone says, as far as it is known."""
        before, self.survey = self.survey, survey
        self.workspace.show_placements(SeenPlacements(survey.placements))
        for kind, message in self._survey_messages(survey):
            self.broadcast(message, kind)
        self.proposing.surveyed(survey.placements)
        if before is None:
            self.broadcast(Progress(_SEARCHING, 1, 1), "progress")

    def broadcast(self, message: Outgoing, kind: str) -> None:
        """Send a message to all pages; it is encoded once."""
        text = encode(message)
        for tab in self.tabs:
            tab.outbox.put(text, kind=kind)

    def _take(self, view: View) -> None:
        self.feed.take(view)
        self.boxes.follow()
        self.lens.follow()
        self.proposing.follow()
        for tab in self.tabs:
            tab.show()
        if view.solving:
            return  # overlay and 3D view show the last answer until the next one; redrawing would only slow the solver
        for tab in self.tabs:
            tab.refresh()

    async def _search(self) -> None:
        """Survey the radar once, off the event loop."""
        options = self.workspace.session.options.gating
        with error_boundary("searching the radar for placements", _log.error):
            try:
                self.survey = await asyncio.get_running_loop().run_in_executor(
                    self.executor, lambda: survey_of(self.recording.radar_windows(), self.moments, options)
                )
            except CalibrationError as error:
                _log.warning("the radar could not be searched for placements: %s", error)
        if self.survey is not None:
            self.workspace.show_placements(SeenPlacements(self.survey.placements))
        self.broadcast(Progress(_SEARCHING, 1, 1), "progress")
        for kind, message in self._survey_messages(self.survey):
            self.broadcast(message, kind)
        for tab in self.tabs:
            tab.refresh()
        self.proposing.surveyed(self.survey.placements if self.survey else ())
        if self.workspace.facts.has_images:
            with error_boundary("comparing the images", _log.error):
                await changes_of(self.recording, self.moments, self.executor, self._compare_images, self._is_playing)

    def _compare_images(self, changes: ImageChanges) -> None:
        self.image_changes = changes

    def _is_playing(self) -> bool:
        return any(tab.is_playing for tab in self.tabs)

    def _survey_messages(self, survey: Survey | None) -> Iterator[tuple[str, Outgoing]]:
        """Yield the messages about the whole radar recording, each with its kind; the map is drawn only without images."""
        if survey is not None and not self.workspace.facts.has_images:
            yield "radar_map", survey.map
        yield "placements", survey.message if survey else Placements(())

    def _recording_note(self) -> RecordingNote:
        facts, recording, restored = self.workspace.facts, self.recording, self.workspace.restored
        return RecordingNote(
            name=facts.name,
            radar_topic=recording.radar_topic or "none",
            image_topic=recording.image_topic or "none",
            width_px=facts.width_px,
            height_px=facts.height_px,
            has_images=facts.has_images,
            frame_times=StampColumns.of(facts.moments),
            start=Stamp.of(TimeNs(int(facts.moments[0]))),
            radar=StampColumns.of(recording.radar_times),
            warnings=tuple(map(warning_row, (*restored.warnings, *_recording_warnings(recording)))),
            sensors=(
                _radar_sensor(recording),
                _sensor("camera", recording.image_topic, recording.topics),
            ),
            session=SessionNote(str(restored.folder), len(restored.history.present.clicks), restored.note),
            version=version(),
            opening=self._opening,
            intrinsics=self.workspace.intrinsics,
        )


def _recording_warnings(recording: Recording) -> list[DataWarning]:
    """Return the warnings about a recording, without its assumptions: those are in the view until they are confirmed."""
    return [warning for warning in recording.warnings if warning.code != "assumed"]


def _readings(recording: Recording) -> tuple[str, ...]:
    """Say what was taken for what in the radar's messages, one quantity a line, and what else they hold."""
    rows = [
        f"{column.quantity} from {column.column}"
        f"{f' [{column.unit}]' if column.unit else ''}{f', {column.sign}' if column.sign else ''} ({column.why})"
        for column in recording.radar_columns
    ]
    return (*rows, *recording.radar_notes)


def _radar_sensor(recording: Recording) -> SensorNote:
    """Describe how the radar is read, and why this one."""
    note = _sensor("radar", recording.radar_topic, recording.topics, _readings(recording))
    if not recording.radar_choice:
        return note
    return replace(note, topic=" + ".join(recording.radar_topics), about=(recording.radar_choice, *note.about))


def _sensor(name: str, chosen: str | None, topics: Sequence[TopicSummary], readings: Sequence[str] = ()) -> SensorNote:
    """Describe how a sensor is read."""
    topic = next((topic for topic in topics if topic.name == chosen), None)
    if topic is None:
        return SensorNote(name, chosen or "none")
    clocks = () if topic.clocks is None else clock_lines(topic.clocks)
    about = tuple(line for line in (topic.layout, *readings, *clocks) if line)
    return SensorNote(name, topic.name, topic.clock if topic.clocks else "", about)


def _soon(loop: asyncio.AbstractEventLoop, call: "partial[None]") -> None:
    """Run on the loop; if it is closing, no page is left to notify."""
    try:
        loop.call_soon_threadsafe(call)
    except RuntimeError:
        _log.debug("a view came after the server had stopped")
