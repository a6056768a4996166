"""A recording is chosen, opened, read in another way and closed by a page; what goes wrong is a question, not the end."""

import base64
import json
import sys
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from tests.port_client import channel, come_in, get, wanted
from tests.served_process import served_process

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a signal to one process needs POSIX")


def asked(socket: ClientConnection, **message: Any) -> Any:
    """Send a message; return its answer, "done" or "error"."""
    socket.send(json.dumps({**message, "request": 77}))
    while True:
        answer = json.loads(text) if isinstance(text := socket.recv(timeout=20), str) else {}
        if answer.get("request") == 77 and answer["type"] in ("done", "error"):
            return answer


def opened(socket: ClientConnection) -> Any:
    socket.send('{"type":"hello"}')
    return wanted(socket, "recording")


def camera_message(data: bytes, name: str = "camera.yaml") -> dict[str, Any]:
    return {"intrinsics": "file", "file": {"name": name, "data": base64.b64encode(data).decode()}}


def until_closed(socket: ClientConnection) -> None:
    with pytest.raises(ConnectionClosed):
        wanted(socket, "never")


@pytest.mark.slow
def test_a_page_chooses_a_recording_and_gives_its_camera_file(without_intrinsics, tmp_path):
    camera = (without_intrinsics / "camera.yaml").read_bytes()
    (without_intrinsics / "damaged.bag").write_bytes(b"GIF89a")
    with served_process("--root", without_intrinsics, "--on-problem", "ask", state=tmp_path) as server:
        assert get(server, "/").status == 401
        cookie = come_in(server)
        with channel(server, cookie) as socket:
            question = wanted(socket, "opening_choices")
            assert (question["name"], question["is_open"], question["recent"]) == ("", False, [])
            socket.send('{"type":"folder"}')
            names = [entry["name"] for entry in wanted(socket, "folder_listing")["entries"]]
            assert names == ["recording_csv", "damaged.bag"]
            answer = {"type": "open_with", "question": question["question"], "answer": "a"}
            refused = asked(socket, **answer, paths=["../camera.yaml"])
            assert refused["message"].startswith("../camera.yaml: only folders below")
            assert "choose one" in asked(socket, **answer)["message"]
            assert "not there any more" in asked(socket, **answer, recent="0123")["message"]
            assert asked(socket, **answer, paths=["damaged.bag"])["type"] == "done"
            question = wanted(socket, "opening_choices")
            assert asked(socket, **answer, paths=["damaged.bag"])["type"] == "done"  # the same answer, sent again
            assert question["name"] == "damaged.bag"
            assert "damaged.bag" in question["problem"]
            answer = {"type": "open_with", "question": question["question"], "answer": "b"}
            assert asked(socket, **answer, paths=["recording_csv"])["type"] == "done"
            late = asked(socket, **{**answer, "answer": "c"}, paths=["damaged.bag"])
            assert "answered already" in late["message"]
            note = opened(socket)
            assert (note["name"], note["intrinsics"], note["opening"]) == ("recording_csv", "", 1)
            stamp = {"sec": note["frame_times"]["sec"][3], "nanosec": note["frame_times"]["nanosec"][3]}
            placed = asked(socket, type="click_placed", image_time=stamp, pixel_px=[20.5, 30.25])
            assert placed["type"] == "done"
            socket.send('{"type":"choices"}')
            question = wanted(socket, "opening_choices")
            assert (question["is_open"], question["session"]["clicks"], question["intrinsics"]) == (True, 1, "")
            answer = {"type": "open_with", "question": question["question"], "answer": "d"}
            for data, words in (
                (b"", "is empty"),
                (b"\x89PNG\r\n", "not a text file"),
                (camera.replace(b"128", b"64"), "calibrated for 64 x 80 px, but the frames have 128 x 80 px"),
                (b"x" * (512 * 1024 + 1), "Expected `bytes` of length <= 524288"),
            ):
                assert words in asked(socket, **answer, **camera_message(data))["message"]
            wanted_name = "../../etc/camera.yaml"
            assert asked(socket, **answer, **camera_message(camera, wanted_name))["type"] == "done"
            until_closed(socket)
        with channel(server, cookie) as socket:
            note = opened(socket)
            assert (note["intrinsics"], note["opening"]) == ("camera.yaml", 2)
            (click,) = wanted(socket, "view")["clicks"]
            assert (click["u_px"], click["v_px"]) == (20.5, 30.25)
        code, printed = server.stop()
    assert code == 0
    assert printed.count("all clicks are saved") == 2
    recent = json.loads((tmp_path / "cocalib" / "recent.json").read_bytes())
    assert [(entry["name"], entry["clicks"]) for entry in recent] == [("recording_csv", 1)]


@pytest.mark.slow
def test_while_the_page_asks_because_of_an_error_a_signal_ends_the_command_with_its_code(without_intrinsics, tmp_path):
    with served_process(without_intrinsics / "recording_csv", "--radar-topic", "/nope", "--on-problem", "ask",
                        state=tmp_path) as server:  # fmt: skip
        with channel(server, come_in(server)) as socket:
            question = wanted(socket, "opening_choices")
            assert "no topic /nope" in question["problem"]
            assert [(row["used"], row["problem"]) for row in question["radars"]] == [(True, "")]
            assert question["recorded_intrinsics"] is False
        assert server.stop()[0] == 2


@pytest.mark.slow
def test_what_cannot_be_used_is_left_out_of_the_next_answer(without_intrinsics, tmp_path):
    other = tmp_path / "other.cocalib-session"
    other.mkdir()
    (other / "journal.jsonl").write_text("not a session\n", encoding="utf-8")
    bad_clicks = tmp_path / "bad_clicks.json"
    bad_clicks.write_text("{", encoding="utf-8")
    before = sorted(path.name for path in without_intrinsics.iterdir())
    small = tmp_path / "small.yaml"
    small.write_bytes((without_intrinsics / "camera.yaml").read_bytes().replace(b"128", b"64"))
    with served_process(without_intrinsics / "recording_csv", "--camera", small, "--clicks", bad_clicks, "--session", other,
                        "--on-problem", "ask", state=tmp_path) as server:  # fmt: skip
        cookie = come_in(server)
        with channel(server, cookie) as socket:
            for problem in ("bad_clicks.json", "64 x 80 px", "other.cocalib-session"):
                question = wanted(socket, "opening_choices")
                assert problem in question["problem"]
                assert sorted(path.name for path in without_intrinsics.iterdir()) == before  # no session was begun
                answer = {"type": "open_with", "question": question["question"], "answer": problem}
                assert asked(socket, **answer, session=question["session"]["plan"])["type"] == "done"
            assert opened(socket)["intrinsics"] == ""
        assert server.stop()[0] == 0
    assert (other / "journal.jsonl").read_text(encoding="utf-8") == "not a session\n"
