"""The browser gets the link from a private file, not from a command line."""

import threading
from pathlib import Path

import pytest

from cocalib.web.messages.outgoing import Opening
from cocalib.web.port import link as module
from cocalib.web.port.link import HandOver, ServerOptions
from cocalib.web.port.serving import Service
from tests.port_client import come_in


@pytest.fixture(autouse=True)
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(module, "_SNAPS", ())
    return tmp_path


class Opened:
    """Takes the address that a browser is started with."""

    def __init__(self) -> None:
        self.addresses: list[str] = []
        self.came = threading.Event()

    def __call__(self, address: str) -> None:
        self.addresses.append(address)
        self.came.set()


def test_the_link_is_in_a_private_file_and_not_in_the_address():
    opened = Opened()
    given = HandOver("http://127.0.0.1:8080/?token=SECRET&x='\"", opened)
    assert opened.came.wait(20)
    assert opened.addresses == [given.path.as_uri()]
    assert "SECRET" not in opened.addresses[0]
    assert given.path.stat().st_mode & 0o077 == 0
    assert given.path.parent.stat().st_mode & 0o077 == 0
    assert "token=SECRET&amp;x=&#x27;&quot;" in given.path.read_text()
    given.discard()
    assert not given.path.exists()
    given.discard()


def test_a_folder_that_others_can_enter_is_not_used(runtime):
    (runtime / "cocalib").mkdir()
    (runtime / "cocalib").chmod(0o777)
    given = HandOver("http://127.0.0.1/?token=SECRET", Opened())
    assert runtime / "cocalib" not in given.path.parents
    assert given.path.parent.stat().st_mode & 0o077 == 0
    given.discard()
    assert not given.path.parent.exists()


def test_a_browser_from_a_snap_gets_a_file_that_it_can_read(runtime, monkeypatch):
    monkeypatch.setattr(module, "_SNAPS", (str(runtime),))  # Path("/snap/bin", an absolute path) is that path
    monkeypatch.setattr(module.sys, "platform", "linux")
    monkeypatch.setattr(module.Path, "home", lambda: runtime)
    given = HandOver("http://127.0.0.1/?token=SECRET", Opened())
    assert not any(part.startswith(".") for part in given.path.relative_to(runtime).parts)
    given.discard()
    assert not given.path.parent.exists()


def test_where_no_file_can_be_written_nothing_is_opened(runtime):
    (runtime / "cocalib").write_text("a file where the folder should be")
    opened = Opened()
    given = HandOver("http://127.0.0.1/?token=SECRET", opened)
    assert given.path is None
    given.discard()
    assert opened.addresses == []


@pytest.mark.parametrize("used", [True, False])
def test_the_file_goes_when_the_link_was_used_and_when_the_server_stops(used, runtime, monkeypatch):
    opened = Opened()
    monkeypatch.setattr("webbrowser.open", opened)
    service = Service(ServerOptions(port=0), Opening("a", "b"), lambda: None, let_in_after_s=0)
    with service as opening:
        server = opening._early.result(timeout=20)
        assert server is not None
        assert opened.came.wait(20)
        assert len(list((runtime / "cocalib").iterdir())) == 1
        if used:
            come_in(server)
            assert not (runtime / "cocalib").exists()
    assert not (runtime / "cocalib").exists()
