"""A recording that opens slowly: pages connect and wait, then continue or end with it."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from calib_core.errors import RecordingError
from calib_core.measurements import TimeNs
from cocalib.cli import run
from cocalib.session.events import ClickPlaced
from cocalib.session.file.contents import inspect_session
from cocalib.web.messages.outgoing import Opening
from cocalib.web.port import serving
from cocalib.web.port.link import ServerOptions
from cocalib.web.port.server import RunningServer
from cocalib.web.port.serving import Service
from cocalib.workspace import Workspace, open_workspace
from tests.image_recording import START, ImageRecording, grey_images
from tests.port_client import channel, come_in, get, wanted
from tests.served_process import ServedProcess

OPENING = Opening("long.bag", "Opening long.bag")
RECORDING = ImageRecording(grey_images(3))
LONG_S = 60.0
POSIX_SIGNALS = pytest.mark.skipif(sys.platform == "win32", reason="a signal to one process needs POSIX")


@pytest.fixture
def workspace(tmp_path: Path) -> Iterator[Workspace]:
    opened = open_workspace(RECORDING, camera=None, session_folder=tmp_path / "session", name="three greys")
    yield opened
    opened.close()


def service(first_image: Callable[[], Any] = lambda: None, *, let_in_after_s: float = 0.0) -> Service:
    return Service(ServerOptions(port=0, no_browser=True), OPENING, first_image, let_in_after_s=let_in_after_s)


def early(opening: Service) -> RunningServer:
    """Return the server that was started before the recording was open."""
    server = opening._early.result(timeout=20)
    assert server is not None
    return server


def image(socket: ClientConnection) -> tuple[Any, bytes]:
    """Read until an image arrives; return its header and its bytes."""
    while not isinstance(message := socket.recv(timeout=20), bytes):
        pass
    length = int.from_bytes(message[:4], "little")
    return json.loads(message[4 : 4 + length]), message[4 + length :]


def test_a_page_that_waits_sees_the_first_image_and_is_greeted_once_the_recording_is_open(workspace, capsys):
    with service(lambda: RECORDING.image_bytes(0)) as opening:
        server = early(opening)
        assert capsys.readouterr().out.splitlines() == ["Opening long.bag", f"Open {server.url}"]
        cookie = come_in(server)
        with channel(server, cookie, "/ws/gone") as gone:
            wanted(gone, "opening")
        with channel(server, cookie, "/ws/tab1") as one, channel(server, cookie, "/ws/tab2") as two:
            for socket in (one, two):
                socket.send('{"type":"hello"}')
                message = wanted(socket, "opening")
                assert (message["name"], message["doing"], message["problem"]) == ("long.bag", "Opening long.bag", "")
                header, data = image(socket)
                assert (header["index"], header["request"], header["width_px"]) == (-1, 0, 320)
                assert data == RECORDING.image_bytes(0).data
            server.admit(workspace, RECORDING)
            for socket in (one, two):
                assert wanted(socket, "recording")["name"] == "three greys"
                assert wanted(socket, "view")["clicks"] == []


def test_while_opening_the_page_is_served_and_downloads_are_refused(workspace):
    with service() as opening:
        server = early(opening)
        assert get(server, "/").status == 401
        cookie = come_in(server)
        assert get(server, "/", Cookie=cookie).status == 200
        assert get(server, "/viser/tab1/", Cookie=cookie).status == 200
        for path in ("/api/clicks.json", "/api/formats.json", "/api/export/tf2"):
            answer = get(server, path, Cookie=cookie)
            assert answer.status == 503
            assert b"still being opened" in answer.body
        server.admit(workspace, RECORDING)
        assert get(server, "/api/clicks.json", Cookie=cookie).status == 200


def test_messages_sent_while_waiting_are_handled_afterwards_in_order(workspace):
    sec, nanosec = divmod(START, 10**9)
    place = {"type": "click_placed", "image_time": {"sec": sec, "nanosec": nanosec}}
    with service() as opening:
        server = early(opening)
        with channel(server, come_in(server)) as socket:
            for request in range(40):
                socket.send(json.dumps({**place, "pixel_px": [request, 1], "request": request}))
            wanted(socket, "opening")
            server.admit(workspace, RECORDING)
            assert [wanted(socket, "done")["request"] for _ in range(40)] == list(range(40))
    assert [click.u_px for click in sorted(workspace.session.clicks, key=lambda click: int(click.id[1:]))] == list(
        range(40)
    )


def test_a_page_that_sends_too_many_messages_while_waiting_is_disconnected():
    with service() as opening:
        server = early(opening)
        with channel(server, come_in(server)) as socket:
            for _ in range(2000):
                socket.send('{"type":"hello"}')
            with pytest.raises(ConnectionClosed):
                wanted(socket, "never")


def fail_to_open(error: BaseException, pages: ExitStack) -> None:
    """Let a page wait, then fail; the page is added to the test's exit stack."""
    with service() as opening:
        server = early(opening)
        socket = pages.enter_context(channel(server, come_in(server)))
        wanted(socket, "opening")
        pages.callback(_end_of, server, socket, error)
        raise error


def _end_of(server: RunningServer, socket: ClientConnection, error: BaseException) -> None:
    """Check the page's last message, and that the server has stopped."""
    if isinstance(error, RecordingError):
        assert wanted(socket, "opening")["problem"] == "No radar in it."
    with pytest.raises(ConnectionClosed):
        wanted(socket, "never")
    with pytest.raises(ConnectionRefusedError):
        get(server, "/")


@pytest.mark.parametrize("error", [RecordingError("no radar in it"), KeyboardInterrupt()])
def test_an_end_while_opening_reaches_the_page_and_the_caller(error):
    with ExitStack() as pages, pytest.raises(type(error)):
        fail_to_open(error, pages)
    assert serving._problem_text(OSError(5, "Input/output error")).endswith("for the reason.")


def test_a_first_image_that_cannot_be_read_does_no_harm(workspace, caplog):
    def broken() -> Any:
        raise ZeroDivisionError("odd")

    with service(broken) as opening:
        server = early(opening)
        server.admit(workspace, RECORDING)
        with channel(server, come_in(server)) as socket:
            socket.send('{"type":"hello"}')
            assert wanted(socket, "recording")["name"] == "three greys"
    assert "odd" in caplog.text


def test_a_recording_that_opens_at_once_is_served_without_an_opening_message(workspace, monkeypatch, capsys):
    admit, started = RunningServer.admit, []

    def admit_look_and_stop(server: RunningServer, *opened: Any) -> None:
        admit(server, *opened)
        with channel(server, come_in(server)) as socket:
            socket.send('{"type":"hello"}')
            kinds = iter(lambda: json.loads(socket.recv(timeout=20))["type"], "")
            started.append((server, next(kind for kind in kinds if kind in ("opening", "recording"))))
        raise KeyboardInterrupt

    monkeypatch.setattr(RunningServer, "admit", admit_look_and_stop)
    with service(let_in_after_s=LONG_S) as opening:
        opening.serve(workspace, RECORDING)
    ((server, first),) = started
    assert first == "recording"
    assert "Opening" not in capsys.readouterr().out
    with pytest.raises(ConnectionRefusedError):
        get(server, "/")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not delete open files")
def test_the_end_says_where_the_clicks_are_if_the_session_folder_was_deleted(workspace, tmp_path, monkeypatch):
    def click_delete_and_stop(*_: Any) -> None:
        workspace.dispatch(ClickPlaced(TimeNs(int(RECORDING.image_times[1])), (1.0, 1.0), "clicked"))
        shutil.rmtree(tmp_path / "session")
        raise KeyboardInterrupt

    monkeypatch.setattr(RunningServer, "admit", click_delete_and_stop)
    with service(let_in_after_s=LONG_S) as opening:
        opening.serve(workspace, RECORDING)
    note = workspace.close().note
    rescued = tmp_path / "state" / "cocalib" / "sessions" / "three_greys-rescued-1.cocalib-session"
    assert "all clicks are saved" not in note
    assert f"(1) are saved in {rescued}" in note
    assert (rescued / "journal-copy.jsonl").is_file()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows does not delete open files")
def test_an_error_that_ends_the_program_does_not_hide_where_the_clicks_are(tmp_path, monkeypatch, capsys):
    def click_delete_and_fail(_: Service, workspace: Workspace, recording: Any) -> None:
        workspace.dispatch(ClickPlaced(TimeNs(int(recording.image_times[1])), (1.0, 1.0), "clicked"))
        shutil.rmtree(tmp_path / "session")
        raise OSError("no port is free")

    monkeypatch.setattr(Service, "serve", click_delete_and_fail)
    assert run(["demo", "--no-browser", "--port", "0", "--session", str(tmp_path / "session")]) == 2
    clicks, problem = capsys.readouterr().err.splitlines()
    assert "All clicks (1)" in clicks
    assert "no port is free" in problem


def test_a_port_that_cannot_be_bound_is_reported_before_anything_is_opened(monkeypatch):
    def taken(*_: object) -> None:
        raise OSError("no port is free")

    monkeypatch.setattr(serving, "RunningServer", taken)
    with pytest.raises(OSError, match="no port is free"), service():
        pytest.fail("opened anyway")
    monkeypatch.setattr(serving, "RunningServer", None)
    with pytest.raises(RecordingError, match="empty"), service(let_in_after_s=LONG_S):
        raise RecordingError("empty")  # at once: no server is started


def test_a_late_error_is_one_line_and_exit_code_2(tmp_path, monkeypatch, capsys):
    link_is_out = threading.Event()

    def slow_and_wrong(*_: object, **_options: object) -> None:
        assert link_is_out.wait(20)
        raise RecordingError("holiday.bag: no recording")

    monkeypatch.setattr("webbrowser.open", lambda _: link_is_out.set())
    monkeypatch.setattr("calib_core.recordings.open_recording", slow_and_wrong)
    (tmp_path / "holiday.bag").write_bytes(b"GIF89a")
    assert run(["open", str(tmp_path / "holiday.bag"), "--port", "0", "--on-problem", "exit"]) == 2
    printed = capsys.readouterr()
    assert printed.err == "cocalib: holiday.bag: no recording\n"
    assert "Open http://" in printed.out


@pytest.mark.parametrize("flag", ["--camera", "--calibration", "--clicks"])
def test_a_named_file_that_is_missing_is_refused_before_anything_is_read(flag, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("calib_core.recordings.open_recording", None)
    (tmp_path / "a.bag").write_bytes(b"")
    assert run(["open", str(tmp_path / "a.bag"), "--no-browser", flag, str(tmp_path / "absent")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "absent: no such file" in line


SLOW_TO_OPEN = """
import calib_core.recordings as recordings
recordings.open_recording = lambda *_, **_options: threading.Event().wait()
"""
PRINTS_WHEN_IT_SERVES = """
from cocalib.web.port.server import RunningServer
admit = RunningServer.admit
RunningServer.admit = lambda *arguments: (admit(*arguments), print("serving"))
"""


def started(arguments: Sequence[object], *, patch: str, sigint: str = "SIG_IGN") -> subprocess.Popen[str]:
    """Start the program in its own process, after a patch.

    Args:
        arguments: the arguments after `cocalib`.
        patch: statements that run first.
        sigint: how the process handles SIGINT; it would inherit SIG_IGN if a script ran the tests in the background.
    """
    program = f"import signal, threading\nsignal.signal(signal.SIGINT, signal.{sigint})\n{patch}"
    return subprocess.Popen(
        [sys.executable, "-c", f"{program}\nfrom cocalib.__main__ import main\nmain()", *map(str, arguments)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip


def printed(running: subprocess.Popen[str], text: str) -> bool:
    """Wait until the program has printed a text."""
    return any(text in line for line in running.stdout)


@pytest.mark.slow
@POSIX_SIGNALS
@pytest.mark.parametrize(
    ("sigint", "sent", "code"),
    [("default_int_handler", signal.SIGINT, 130), ("SIG_IGN", signal.SIGTERM, 143), ("SIG_IGN", signal.SIGHUP, 129)],
    ids=["SIGINT", "SIGTERM", "SIGHUP"],
)
def test_a_signal_while_opening_ends_the_program_quietly(tmp_path, sigint, sent, code):
    (tmp_path / "long.bag").write_bytes(b"")
    arguments = ["open", tmp_path / "long.bag", "--no-browser", "--port", 0]
    running = started(arguments, patch=SLOW_TO_OPEN, sigint=sigint)
    assert printed(running, "http://")
    running.send_signal(sent)
    _, errors = running.communicate(timeout=30)
    assert (running.returncode, errors.strip()) == (code, "")


SLOW_TO_CLOSE = f"""{PRINTS_WHEN_IT_SERVES}
import os, sys, time
from cocalib.session.file.session_file import SessionFile
close = SessionFile.close
def close_slowly(session):
    sys.stdout.write("closing\\n")
    sys.stdin.readline()
    return close(session)
SessionFile.close = close_slowly
"""


SWITCHED_OFF = f"signal.signal(signal.SIGHUP, signal.SIG_IGN)\n{PRINTS_WHEN_IT_SERVES}"
SIGNAL_IN_ANOTHER_THREAD = f"""{PRINTS_WHEN_IT_SERVES}
import sys, time
def raise_when_it_waits():
    sys.stdin.readline()
    main = threading.main_thread().ident
    while sys._current_frames()[main].f_code.co_name != "wait":
        time.sleep(0)
    signal.raise_signal(signal.SIGTERM)
threading.Thread(target=raise_when_it_waits, daemon=True).start()
"""


@pytest.mark.slow
@POSIX_SIGNALS
@pytest.mark.parametrize(
    ("patch", "sent", "later"),
    [
        (SLOW_TO_CLOSE, [signal.SIGINT], [signal.SIGTERM]),
        (SLOW_TO_CLOSE, [signal.SIGHUP], [signal.SIGINT]),
        (SIGNAL_IN_ANOTHER_THREAD, [], []),
        (SWITCHED_OFF, [signal.SIGHUP, signal.SIGINT, signal.SIGTERM], []),
    ],
    ids=["SIGINT first", "SIGHUP first", "just before the main thread waits", "nohup"],
)
def test_a_signal_while_serving_closes_the_session_and_a_second_one_does_not_interrupt_that(
    tmp_path, patch, sent, later
):
    """A signal that is switched off stays off: `nohup cocalib open` outlives its terminal."""
    arguments = ["demo", "--no-browser", "--port", 0, "--session", tmp_path / "session"]
    takes_sigint = patch == SLOW_TO_CLOSE and signal.SIGINT in (*sent, *later)
    running = started(arguments, patch=patch, sigint="default_int_handler" if takes_sigint else "SIG_IGN")
    assert printed(running, "serving")
    for one in sent:
        running.send_signal(one)
    if later:
        assert printed(running, "closing")
        running.send_signal(later[0])
    out, errors = running.communicate("\n", timeout=30)
    assert (running.returncode, errors) == (0, "")
    assert "all clicks are saved" in out
    assert (tmp_path / "session" / "journal-copy.jsonl").is_file()


PARSES_FOR_EVER = f"""{PRINTS_WHEN_IT_SERVES}
from calib_core.parsing import yaml_documents
from cocalib.platform import process
from cocalib.session.file.session_file import SessionFile
process._GRACE_S = 0.5
def parse_for_ever(_):
    while True:
        yaml_documents("[" + "1, " * 9000 + "]", source="camera.yaml")
SessionFile.close = parse_for_ever
"""


@pytest.mark.slow
@POSIX_SIGNALS
def test_ten_sigterms_within_a_parse_end_the_program_and_confirmed_clicks_are_on_the_disk(tmp_path):
    session = tmp_path / "session"
    running = started(["demo", "--no-browser", "--port", 0, "--session", session], patch=PARSES_FOR_EVER)
    try:
        url = next(line for line in running.stdout if "http://" in line).split()[-1]
        assert printed(running, "serving")
        server = ServedProcess(running, url)
        with channel(server, come_in(server)) as socket:
            socket.send('{"type":"hello"}')
            first = wanted(socket, "recording")["start"]
            socket.send(json.dumps({"type": "click_placed", "image_time": first, "pixel_px": [9, 9], "request": 1}))
            wanted(socket, "done")
            for _ in range(10):
                running.send_signal(signal.SIGTERM)
        running.communicate(timeout=60)
    finally:
        running.kill()
    assert running.returncode == -signal.SIGALRM
    assert len(inspect_session(session).clicks) == 1


def test_a_large_recording_has_its_link_before_it_is_opened(tmp_path, monkeypatch, capsys):
    printed_before = []

    def look(*_: object, **_options: object) -> None:
        printed_before.append(capsys.readouterr().out)
        raise RecordingError("long: not a recording")

    monkeypatch.setattr("calib_core.recordings.open_recording", look)
    folder = tmp_path / "long"
    folder.mkdir()
    with (folder / "long.mcap").open("wb") as file:
        file.truncate(2_000_000_000)
    assert run(["open", str(folder), "--port", "0", "--no-browser"]) == 2
    opening, link = printed_before[0].splitlines()
    assert opening.startswith("Opening long (2.0 GB)")
    assert link.startswith("Open http://")
