"""What the pages of a recording that is still being written are told."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import numpy as np
import pytest

from calib_core.association.placements import Placement
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.options import GatingOptions
from calib_core.recordings import AwaitedRecording, FollowedRecording
from cocalib.session.events import ClickPlaced
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts
from cocalib.web.channel.live_edge import LiveEdge
from cocalib.web.channel.radar_survey import GrowingSurvey, Survey, survey_of
from cocalib.web.messages.outgoing import FollowNote, FramesAdded, Outgoing
from cocalib.workspace import Workspace
from tests.growing_recording import SampleWriter
from tests.unit.app.web.channel.desk import NoSolver

DEADLINE_S = 60.0


class ToldPages:
    def __init__(self) -> None:
        self.messages: list[Outgoing] = []
        self.frames = self.conclusions = 0
        self.survey: Survey | None = None

    def broadcast(self, message: Outgoing, kind: str) -> None:
        self.messages.append(message)

    def grown(self, count: int) -> None:
        self.frames = count

    def surveyed(self, survey: Survey) -> None:
        self.survey = survey

    def concluded(self) -> None:
        self.conclusions += 1

    @property
    def note(self) -> FollowNote:
        return [FollowNote("live", ""), *(each for each in self.messages if isinstance(each, FollowNote))][-1]


async def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end, "it never came"
        await asyncio.sleep(0.01)


Story = Callable[[SampleWriter, ToldPages, Workspace, FollowedRecording], Awaitable[None]]


def follow(tmp_path: Path, story: Story) -> None:
    """Follow the sample from its tenth second on while a story is told."""
    writer = SampleWriter(tmp_path / "drive.mcap")
    writer.write_until(10.0)
    recording = AwaitedRecording([tmp_path / "drive.mcap"]).look()
    facts = RecordingFacts("drive", recording.image_times, 960, 600)
    session_file = open_session_file(tmp_path / "session", facts)
    workspace, pages = Workspace(facts, session_file.restored, session_file, NoSolver()), ToldPages()

    async def run() -> None:
        edge = LiveEdge(pages, workspace, recording, recording.camera())
        following = asyncio.create_task(edge.run())
        try:
            await story(writer, pages, workspace, recording)
        finally:
            following.cancel()
            await asyncio.gather(following, return_exceptions=True)

    asyncio.run(run())
    workspace.close()
    recording.close()
    writer.stop()


def test_every_frame_is_told_once_and_in_order(tmp_path):
    async def story(writer: SampleWriter, pages: ToldPages, workspace: Workspace, recording: FollowedRecording) -> None:
        known = len(recording.image_times)
        for seconds in (12.0, 15.0, 25.0):
            writer.write_until(seconds)
            await until(lambda: pages.frames == len(recording.image_times) > known)
        writer.finish()
        await until(lambda: pages.note.state == "complete")
        assert pages.conclusions == 1
        told = known
        for message in pages.messages:
            if isinstance(message, FramesAdded):
                assert message.first == told
                told += len(message.frame_times.sec)
        assert told == len(recording.image_times) == len(workspace.facts.image_times)

    follow(tmp_path, story)


@pytest.mark.slow
def test_in_the_end_the_placements_are_those_of_the_whole_recording(tmp_path):
    assert GrowingSurvey(GatingOptions()).survey(np.array([0, 10**9])).rows == (), "without scans"

    async def story(writer: SampleWriter, pages: ToldPages, workspace: Workspace, recording: FollowedRecording) -> None:
        writer.write_until(60.0)
        await until(lambda: pages.survey is not None and len(pages.survey.rows) > 2)
        await until(lambda: " of 20 placements; next: " in pages.note.advice)
        writer.finish()
        await until(lambda: recording.is_complete)
        whole = survey_of(recording.radar_windows(), recording.image_times, GatingOptions())
        await until(lambda: pages.survey.rows == whole.rows)
        assert pages.survey.activity == whole.activity

    follow(tmp_path, story)


def test_a_file_that_was_truncated_ends_the_following_in_words(tmp_path):
    async def story(writer: SampleWriter, pages: ToldPages, workspace: Workspace, recording: FollowedRecording) -> None:
        workspace.dispatch(ClickPlaced(TimeNs(int(recording.image_times[0])), (1.0, 2.0), "clicked"))
        with (tmp_path / "drive.mcap").open("r+b") as file:
            file.truncate(50)
        await until(lambda: pages.note.state == "ended")
        assert "to 50 bytes" in pages.note.words
        assert pages.note.words.endswith("All clicks are kept.")
        assert len(workspace.session.clicks) == 1

    follow(tmp_path, story)


def test_a_writer_that_stops_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("cocalib.web.channel.live_edge._QUIET_AFTER_S", 0.05)

    async def story(writer: SampleWriter, pages: ToldPages, workspace: Workspace, recording: FollowedRecording) -> None:
        writer.write_until(14.0)
        writer.stop()
        await until(lambda: pages.note.state == "quiet")

    follow(tmp_path, story)


@pytest.mark.slow
def test_placements_are_found_while_the_reflector_still_stands(recording):
    """In steps of two seconds; the first is there for more than half of the recording so far, and is found later."""
    found: dict[int, float] = {}
    end_ns = int(recording.radar_times[0]) + 70 * NS_PER_S
    survey = survey_of(recording.radar_windows(), recording.image_times, GatingOptions())
    whole = [placement for placement in survey.placements if placement.end < end_ns]
    growing = GrowingSurvey(GatingOptions())
    for now in range(int(recording.radar_times[40]), end_ns, 2 * NS_PER_S):
        growing.note(recording.radar_scans(TimeNs((growing.until or 0) + 1), TimeNs(now)))
        survey = growing.survey(recording.image_times[recording.image_times <= now])
        for number, placement in enumerate(whole):
            if any(_is_same(placement, other) for other in survey.placements):
                found.setdefault(number, (now - placement.end) / NS_PER_S)
    assert len(found) == len(whole) > 5
    assert found[0] < 4.0
    assert max(found[number] for number in range(1, len(whole))) < 0.0


def _is_same(one: Placement, other: Placement) -> bool:
    together = min(one.end, other.end) - max(one.start, other.start)
    return together > 0 and float(np.linalg.norm(one.position_radar_m - other.position_radar_m)) < 0.5
