"""Serving on a Unix socket: only its owner can reach it, and the page works through a forwarded port."""

import http.client
import shlex
import socket
import sys
from pathlib import Path

import pytest

from cocalib.cli import run
from cocalib.web.port.address import AddressError
from cocalib.web.port.link import forwarding_command, listening_socket, remove_socket
from tests.image_recording import ImageRecording, grey_images
from tests.serving import serving

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no Unix sockets")


@pytest.fixture
def private(tmp_path: Path) -> Path:
    folder = tmp_path / "own"
    folder.mkdir(mode=0o700)
    return folder


class Forwarded(http.client.HTTPConnection):
    """A connection as sshd makes it: to the socket, with the Host of the forwarded port."""

    def __init__(self, path: Path) -> None:
        super().__init__("127.0.0.1", 9999, timeout=20)
        self.path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.connect(str(self.path))


def got(path: Path, target: str, **headers: str) -> http.client.HTTPResponse:
    connection = Forwarded(path)
    connection.request("GET", target, headers=headers)
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer


def test_the_page_is_served_through_the_socket_and_to_its_owner_only(private, tmp_path):
    path = private / "s"
    recording = ImageRecording(grey_images(1))
    with serving(recording, tmp_path / "session", name="one grey", port=9999, socket=path) as (running, _):
        assert path.stat().st_mode & 0o077 == 0
        assert running.url.startswith("http://127.0.0.1:9999/?token=")
        assert got(path, "/").status == 401
        assert got(path, "/", Host="evil.example").status == 421
        assert got(path, "/", Origin="http://evil.example").status == 403
        admitted = got(path, running.url.removeprefix(running.origin))
        cookie = admitted.headers["Set-Cookie"].partition(";")[0]
        assert got(path, "/", Cookie=cookie).status == 200
        assert got(path, "/", Cookie=cookie, Host="localhost:1234", Origin="http://localhost:1234").status == 200
    assert not path.exists()


def test_a_socket_that_a_killed_server_left_is_replaced_and_a_missing_folder_created_for_its_owner(private):
    for folder in (private, private / "new"):
        listening_socket(folder / "s").close()
        assert (folder / "s").exists()
        assert folder.stat().st_mode & 0o077 == 0
        listening_socket(folder / "s").close()


def test_a_path_that_is_taken_is_refused(private):
    (private / "file").write_text("precious")
    with pytest.raises(AddressError, match="not a socket"):
        listening_socket(private / "file")
    assert (private / "file").read_text() == "precious"
    remove_socket(private / "file")
    assert (private / "file").exists()
    with listening_socket(private / "s") as busy:
        busy.listen()
        with pytest.raises(AddressError, match="another server is using it"):
            listening_socket(private / "s")


@pytest.mark.parametrize(
    ("name", "words"), [("a" * 200, "103 bytes"), ("a:b", "colon"), ("no/such/folder", "cannot be created")]
)
def test_a_path_that_cannot_be_used_is_refused(private, name, words, monkeypatch):
    with pytest.raises(AddressError, match=words):
        listening_socket(private / name)
    private.chmod(0o755)
    with pytest.raises(AddressError, match="others can enter"):
        listening_socket(private / "s")
    monkeypatch.delattr(socket, "AF_UNIX")
    with pytest.raises(AddressError, match="no Unix sockets"):
        listening_socket(private / "s")


def test_the_printed_command_forwards_to_the_socket(private):
    words = shlex.split(forwarding_command(private / "a b", 8080))
    assert words[:3] == ["ssh", "-N", "-L"]
    assert words[3] == f"8080:{private / 'a b'}"
    assert words[4].endswith(f"@{socket.gethostname()}")


@pytest.mark.parametrize("arguments", [["--host", "0.0.0.0"], []])
def test_the_command_refuses_what_cannot_be_served(private, arguments, capsys):
    private.chmod(0o755)
    assert run(["demo", "--no-browser", "--socket", str(private / "s"), *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--socket" in line
