"""The port as seen by a client: the behaviour we need from viser's server, attacks, and the channel's messages."""

import gzip
import json
import logging
import re
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from cocalib.web.port.entrance import MAX_SOCKETS
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer, start
from cocalib.workspace import Workspace, open_workspace
from tests.image_recording import START, ImageRecording, grey_images
from tests.page_view import PageView
from tests.port_client import channel, come_in, get, wanted
from tests.serving import serving


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    patch = pytest.MonkeyPatch()
    patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
    recording = ImageRecording(grey_images(5))
    folder = tmp_path_factory.mktemp("session") / "s"
    with serving(recording, folder, camera=recording.camera(), name="five greys") as (running, _):
        yield running
    patch.undo()


@pytest.fixture(scope="module")
def cookie(server: RunningServer) -> str:
    """Open the link and return the cookie."""
    return come_in(server)


def stamp(index: int) -> dict[str, int]:
    time = START + index * 100_000_000
    return {"sec": time // 10**9, "nanosec": time % 10**9}


def test_the_page_and_its_parts_are_served_with_their_types_and_no_inline_script(server, cookie, project_root):
    for path, kind in (
        ("/", "text/html"),
        ("/page/main.js", "text/javascript"),
        ("/base/look.css", "text/css"),
        ("/icon.svg", "image/svg+xml"),
    ):
        answer = get(server, path, Cookie=cookie)
        assert answer.status == 200
        assert answer.headers["Content-Type"].startswith(kind)
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert "script-src 'self';" in answer.headers["Content-Security-Policy"]
        assert "unsafe" not in answer.headers["Content-Security-Policy"]
    page = re.sub(rb'<link rel="modulepreload" href="[a-z0-9_/]+[.]js">', b"", get(server, "/", Cookie=cookie).body)
    assert page == (project_root / "static" / "index.html").read_bytes()


def test_viser_still_starts_its_server_as_the_hook_expects(server, cookie):
    import viser

    page = get(server, "/viser/tab1/", Cookie=cookie)
    scripts = re.findall(rb"<script[^>]*>", gzip.decompress(page.body) if page.body[:2] == b"\x1f\x8b" else page.body)
    assert scripts[0] == b'<script src="../../space/pace.js">', "the pace must be set before viser's script runs"
    assert len(scripts) > 1
    assert page.status == 200
    assert page.headers["X-Frame-Options"] == "SAMEORIGIN"
    address = server.origin.replace("http", "ws") + "/viser/tab1"
    protocol: Any = f"viser-v{viser.__version__}"
    with connect(
        address, origin=server.origin, subprotocols=[protocol], additional_headers={"Cookie": cookie}
    ) as socket:
        assert socket.subprotocol == protocol
        assert isinstance(socket.recv(timeout=20), bytes)


@pytest.mark.parametrize(
    ("path", "origin", "admitted", "status"),
    [
        ("/ws/tab1", "http://evil.example", True, 403),
        ("/viser", "http://evil.example", True, 403),
        ("/ws/tab1", None, False, 401),
        *((path, None, True, 404) for path in ("/", "/etc", "/ws")),
    ],
)
def test_a_websocket_from_elsewhere_or_to_elsewhere_is_refused(server, cookie, path, origin, admitted, status):
    address, headers = server.origin.replace("http", "ws") + path, {"Cookie": cookie if admitted else "cocalib=no"}
    with pytest.raises(InvalidStatus) as refused:
        connect(address, origin=origin or server.origin, additional_headers=headers)
    assert refused.value.response.status_code == status


@pytest.mark.parametrize(
    "path",
    ["/static/page/main.js", "/base", "/base/", "/state.js", "/viser/", "/viser/a/b/", "/api/", "/api/export/nothing"],
)
def test_no_other_path_exists(server, cookie, path):
    assert get(server, path, Cookie=cookie).status == 404


@pytest.mark.parametrize("path", ["//evil.example/", "/\\evil.example/", "/%2F%2Fevil.example", "/..//evil.example"])
def test_a_link_leads_to_the_page_and_nowhere_else(server, path):
    answer = get(server, f"{path}?token={server.url.partition('=')[2]}")
    assert answer.headers["Refresh"] == "0; url=/"
    assert answer.headers["Location"] is None
    assert b"evil" not in answer.body


def test_a_page_is_greeted_with_the_stamps_of_its_frames_and_the_placements(server, cookie):
    with channel(server, cookie) as socket:
        socket.send('{"type":"hello"}')
        times = wanted(socket, "recording")["frame_times"]
        assert {"sec": times["sec"][2], "nanosec": times["nanosec"][2]} == stamp(2)
        assert wanted(socket, "placements")["placements"] == []


def test_a_click_reaches_the_other_tab_and_undo_takes_it_from_both(server, cookie):
    with channel(server, cookie, "/ws/tab1") as one, channel(server, cookie, "/ws/tab2") as two:
        pages = PageView(one), PageView(two)
        for socket, page in zip((one, two), pages, strict=True):
            socket.send('{"type":"hello"}')
            page.next()
        one.send(json.dumps({"type": "click_placed", "image_time": stamp(1), "pixel_px": [12.25, 34.5], "request": 7}))
        seen = pages[0].next()
        assert [(row["frame"], row["u_px"], row["v_px"]) for row in seen["clicks"]] == [(1, 12.25, 34.5)]
        assert pages[1].next()["clicks"] == seen["clicks"]
        two.send('{"type":"undo","request":1}')
        while pages[0].next()["clicks"]:
            pass
        assert wanted(two, "done")["request"] == 1


def test_a_page_that_missed_a_change_gets_a_whole_view(server, cookie):
    with channel(server, cookie) as socket:
        socket.send('{"type":"hello"}')
        wanted(socket, "view")
        socket.send(json.dumps({"type": "click_placed", "image_time": stamp(2), "pixel_px": [20, 30]}))
        assert wanted(socket, "view_change")["number"] == 1
        socket.send('{"type":"view"}')
        assert [row["frame"] for row in wanted(socket, "view")["clicks"]] == [2]
        socket.send('{"type":"undo"}')
        assert wanted(socket, "view_change")["number"] == 1, "changes are counted from the last whole View"


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"type": "click_placed", "image_time": {"sec": 1, "nanosec": 2}, "pixel_px": [1, 1]}, "No frame"),
        ({"type": "click_placed", "image_time": stamp(0), "pixel_px": [5000, 1]}, "outside"),
        ({"type": "click_removed", "id": "c99"}, "c99"),
        ({"type": "options_changed", "options": {"noise": {"sigma_pix": 1}}}, "sigma_px"),
        ({"type": "frame", "index": 99}, "frame"),
        ({"type": "nonsense"}, "nonsense"),
    ],
)
def test_an_invalid_message_gets_an_error_and_the_channel_stays_open(server, cookie, message, words):
    with channel(server, cookie) as socket:
        socket.send(json.dumps({**message, "request": 3}))
        problem = wanted(socket, "error")
        assert words in problem["message"]
        assert problem["request"] == 3
        socket.send('{"type":"hello","request":4}')
        assert wanted(socket, "done")["request"] == 4


def test_a_page_that_stops_reading_does_not_slow_others(server, cookie):
    with channel(server, cookie, "/ws/stalled") as stalled, channel(server, cookie, "/ws/lively") as lively:
        for request in range(300):
            stalled.send(json.dumps({"type": "frame", "index": request % 5, "request": request}))
            stalled.send('{"type":"hello"}')
        for request in range(50):
            lively.send(json.dumps({"type": "frame", "index": request % 5, "request": request}))
            while not isinstance(lively.recv(timeout=20), bytes):
                pass


def test_the_clicks_can_be_downloaded_at_any_time(server, cookie):
    answer = get(server, "/api/clicks.json", Cookie=cookie)
    assert json.loads(answer.body)["schema"] == "cocalib/clicks-1"
    assert answer.headers["Content-Disposition"] == 'attachment; filename="clicks.json"'


def test_a_flood_of_greetings_leaves_other_pages_served(server, cookie):
    with channel(server, cookie, "/ws/flood") as flood:
        for _ in range(20_000):
            flood.send('{"type":"hello"}')
        with channel(server, cookie, "/ws/new") as page:
            page.send('{"type":"hello","request":1}')
            assert wanted(page, "recording")["name"] == "five greys"
        flood.send('{"type":"hello","request":2}')
        greetings = 0
        while (message := json.loads(flood.recv(timeout=60))).get("request") != 2:
            greetings += message["type"] == "recording"
        assert greetings < 200, "20,000 were asked for"


def test_a_flood_of_requests_for_the_whole_view_is_answered_seldom_and_by_the_newest(server, cookie):
    with channel(server, cookie, "/ws/flood") as flood:
        views = 0
        for request in range(400):
            flood.send(json.dumps({"type": "view", "request": request}))
            while (message := json.loads(flood.recv(timeout=60))).get("request") != request:
                views += message["type"] == "view"
        assert views < 200, "400 were asked for"
        assert wanted(flood, "view")["type"] == "view", "the last request is answered too"


def test_one_browser_opens_only_so_many_sockets(server):
    full, other = come_in(server), come_in(server)
    with ExitStack() as pages:
        for number in range(MAX_SOCKETS):
            pages.enter_context(channel(server, full, f"/ws/{number}"))
        with pytest.raises(InvalidStatus) as refused, channel(server, full, "/ws/more"):
            pass
        assert refused.value.response.status_code == 429
        with channel(server, other, "/ws/other") as page:
            page.send('{"type":"hello"}')
            assert wanted(page, "recording")["name"] == "five greys"
    deadline = time.monotonic() + 20
    while server._entrance._admissions.open_sockets(full.partition("=")[2]) and time.monotonic() < deadline:
        get(server, "/", Cookie=full)
    with channel(server, full, "/ws/again"):
        pass


def test_an_internal_error_is_told_to_the_page_or_a_500_and_the_server_goes_on(server, cookie, monkeypatch, caplog):
    def broken(*_: object) -> None:
        raise RecursionError("a bug")

    with monkeypatch.context() as patch, channel(server, cookie) as socket:
        patch.setattr(Workspace, "dispatch", broken)
        patch.setattr(Workspace, "clicks_text", broken)
        socket.send('{"type":"undo","request":5}')
        problem = wanted(socket, "error")
        assert problem["request"] == 5
        assert "(RecursionError: a bug)" in problem["message"]
        assert get(server, "/api/clicks.json", Cookie=cookie).status == 500
        assert "(RecursionError: a bug)" in caplog.text
        patch.undo()
        socket.send('{"type":"hello","request":6}')
        assert wanted(socket, "done")["request"] == 6
    assert get(server, "/api/clicks.json", Cookie=cookie).status == 200


@pytest.mark.parametrize("half", ["\\ud800", "\\\\ud800", "\\udc00\\ud800"])
def test_half_a_character_is_refused_and_the_channel_stays_open(server, cookie, half):
    clicks = '{\\"schema\\":\\"cocalib/clicks-1\\",\\"clicks\\":[{\\"id\\":\\"HALF\\",\\"image_time\\":{},\\"pixel_px\\":[1,1]}]}'
    with channel(server, cookie) as socket:
        for message in (
            '{"type":"import_clicks","text":"' + clicks.replace("HALF", half) + '","request":1}',
            '{"type":"click_removed","id":"' + half + '","request":1}',
            '{"type":"' + half + '","request":1}',
        ):
            socket.send(message)
            assert wanted(socket, "error")["message"]
        socket.send('{"type":"hello","request":2}')
        assert wanted(socket, "done")["request"] == 2


def test_after_closing_no_connection_is_accepted(tmp_path, state):
    recording = ImageRecording(grey_images(1))
    workspace = open_workspace(recording, camera=None, session_folder=tmp_path / "s", name="one grey")
    running = start(workspace, recording, ServerOptions(port=0, token="mine"))
    assert running.url.endswith("?token=mine")
    answer = get(running, "/?token=mine")
    with channel(running, answer.headers["Set-Cookie"].partition(";")[0]) as socket:
        running.close()
        workspace.close()
        with pytest.raises(ConnectionClosed):
            wanted(socket, "never")
    with pytest.raises(ConnectionRefusedError):
        get(running, "/")
    assert (state / "page.key").stat().st_mode & 0o077 == 0


def test_failures_are_logged_but_disconnecting_clients_are_not(server, caplog):
    port = logging.getLogger("cocalib.port")
    for message, error in (
        ("opening handshake failed", ValueError("a port scan")),
        ("unexpected internal error", AssertionError("eof_sent")),
        ("unexpected internal error", OSError("no more memory")),
    ):
        port.error(message, exc_info=error)
    assert [str(record.exc_info[1]) for record in caplog.records if record.exc_info] == ["no more memory"]
