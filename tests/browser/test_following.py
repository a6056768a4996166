"""The page beside a writer: frames and placements appear, a frame can be clicked, and the session goes on afterwards."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from calib_core.recordings import AwaitedRecording, FollowedRecording, open_recording
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import Workspace, open_workspace
from tests.browser.driving import Driver
from tests.growing_recording import SampleWriter
from tests.serving import OWN_PORT

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]

_DWELL_END_S = 21.0

LATE = """async () => {
  const [{ receiveFrame }, { requestNumber }] = await Promise.all([import('/time/player.js'), import('/base/socket.js')]);
  const canvas = new OffscreenCanvas(8, 8);
  canvas.getContext('2d').fillRect(0, 0, 8, 8);
  const data = new Uint8Array(await (await canvas.convertToBlob()).arrayBuffer());
  const header = { request: requestNumber() - 1, format: 'png', scale: 1, width_px: 8, height_px: 8, rectified: false };
  await receiveFrame({ ...header, index: __cocalib.state.shown.index - 1 }, data);
  return __cocalib.state.shown.index === __cocalib.state.cursor;
}"""
"""Lets the answer to the latest request arrive late, while a newer frame is on screen; says whether that one stays."""

PACE_FIRST = """window.WebSocket = class extends WebSocket {
  held = [];
  set onmessage(take) {
    super.onmessage = (event) => {
      if (this.held?.push(event) && String(event.data).includes('"type":"following"')) {
        take(event);
        for (const earlier of this.held.slice(0, -1)) take(earlier);
        this.held = null;
      } else if (!this.held) take(event);
    };
  }
};"""
"""Lets the note of the pace come before everything else, as when it changes while a page loads."""


@pytest.fixture
def writer(tmp_path: Path) -> Iterator[SampleWriter]:
    writing = SampleWriter(tmp_path / "drive.mcap")
    writing.write_until(8.0)
    yield writing
    writing.stop()


@pytest.fixture
def followed(writer: SampleWriter, tmp_path: Path) -> Iterator[FollowedRecording]:
    recording = AwaitedRecording([tmp_path / "drive.mcap"]).look()
    assert recording is not None
    with recording:
        yield recording


@pytest.fixture
def workspace(followed: FollowedRecording, tmp_path: Path) -> Iterator[Workspace]:
    opened = open_workspace(followed, camera=followed.camera(), session_folder=tmp_path / "session", name="drive.mcap")
    yield opened
    opened.close()


@pytest.fixture
def server(workspace: Workspace, followed: FollowedRecording) -> Iterator[RunningServer]:
    running = start(workspace, followed, ServerOptions(port=OWN_PORT, token="test"))
    yield running
    running.close()


def newest(page: Driver) -> str:
    return "__cocalib.state.shown?.index === __cocalib.state.seconds.length - 1"


def test_the_newest_frame_is_shown_until_the_user_steps_back(page, writer, followed):
    frames = page.value("__cocalib.state.seconds.length")
    page.until("__cocalib.state.live")
    writer.write_until(15.0)
    page.until(f"__cocalib.state.seconds.length > {frames} && {newest(page)}")
    page.page.keyboard.press("ArrowLeft")
    page.until("!__cocalib.state.live")
    stayed = page.value("__cocalib.state.cursor")
    writer.write_until(20.0)
    page.until(f"__cocalib.state.seconds.length === {sum(followed.image_times <= writer.start_ns + 20_000_000_000)}")
    assert page.value("__cocalib.state.cursor") == stayed
    page.press("Home", "Space")
    page.until("__cocalib.state.playing && __cocalib.state.shown.index > 0")
    page.page.locator("#live").click()
    page.until(f"__cocalib.state.live && {newest(page)} && __cocalib.state.shown.scale === 1")
    assert page.value("__cocalib.state.playing") is False
    assert page.page.evaluate(LATE)


@pytest.mark.slow
def test_the_newest_frame_is_shown_though_the_pace_was_told_first(open_page, server):
    open_page(server.url, script=PACE_FIRST).until("__cocalib.state.live")


def test_placements_and_advice_appear_while_the_file_grows(page, writer):
    writer.write_until(_DWELL_END_S + 2.0)
    page.until("__cocalib.state.placements.length >= 1")
    page.until("document.getElementById('status-text').textContent.includes('next:')")
    assert " of 20 placements; next: " in page.text("#status-text")


def test_a_click_made_while_following_belongs_to_its_frame_and_stays(page, writer, workspace, followed, tmp_path):
    writer.write_until(_DWELL_END_S)
    page.until("__cocalib.state.placements.length >= 1")
    frame = page.value("__cocalib.state.placements[0].frame")
    page.value(f"__cocalib.goTo({frame})")
    page.until(f"__cocalib.state.shown.index === {frame}")
    page.click(480.0, 300.0)
    page.until("__cocalib.state.view.clicks.length === 1 && __cocalib.unconfirmed() === 0")
    (click,) = workspace.session.clicks
    assert click.image_time == int(followed.image_times[frame])
    writer.finish()
    page.until("document.getElementById('status-text').textContent.includes('The recording is complete')")
    assert page.page.locator("#live").is_hidden()
    workspace.close()
    with open_recording([tmp_path / "drive.mcap"]) as whole:
        again = open_workspace(whole, camera=whole.camera(), session_folder=tmp_path / "session", name="drive.mcap")
        assert [(one.image_time, one.u_px) for one in again.session.clicks] == [(click.image_time, click.u_px)]
        again.close()


@pytest.mark.slow
def test_a_truncated_recording_is_refused_in_words_and_keeps_the_clicks(page, writer, workspace, tmp_path):
    page.until("__cocalib.state.live")
    page.value("__cocalib.goTo(0)")
    page.until("__cocalib.state.shown.index === 0")
    page.click(480.0, 300.0)
    page.until("__cocalib.state.view.clicks.length === 1 && __cocalib.unconfirmed() === 0")
    with (tmp_path / "drive.mcap").open("r+b") as file:
        file.truncate(1000)
    page.until("document.getElementById('status-text').textContent.includes('truncated to 1000 bytes')")
    assert "All clicks are kept" in page.page.locator("#status-text").inner_text()
    assert len(workspace.session.clicks) == 1
