"""Stock Firefox and WebKitGTK, each driven through the protocol that it speaks by itself: nothing is downloaded.

Firefox speaks WebDriver BiDi. WebKitGTK has its own WebDriver; its window is on Broadway, a display of GTK without a screen.
"""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from ctypes.util import find_library
from pathlib import Path
from typing import Any

import psutil
import pytest
from websockets.sync.client import connect

from tests.browser.driving import PATIENCE_S, Driver

__all__ = ["RemoteDriver", "firefox", "webkit"]

SIZE_PX = (1280, 720)
_LONGEST_S = 200
"""No condition in the page is waited for longer."""
_KEYS = {"Control": "\ue009", "Enter": "\ue007"}
_DOWN, _UP = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}


class RemotePage(ABC):
    """What `Driver` uses of Playwright's Page; mouse and keys are the same in both protocols."""

    def __init__(self) -> None:
        self.mouse = self.keyboard = self

    @abstractmethod
    def goto(self, url: str) -> None:
        """Open an address and wait until it is loaded."""

    @abstractmethod
    def address(self) -> str:
        """Return the address of the page that is open."""

    @abstractmethod
    def evaluate(self, function: str) -> Any:
        """Call a JavaScript function in the page, and return what it resolves to, as far as JSON can hold it."""

    @abstractmethod
    def perform(self, source: Mapping[str, Any]) -> None:
        """Do what is done with a mouse or a keyboard."""

    @abstractmethod
    def errors(self) -> list[str]:
        """Return the errors in the browser's log; those of viser's page in WebKitGTK are not ours."""

    def press(self, keys: str) -> None:
        """Press keys together, such as Control+z."""
        values = [_KEYS.get(key, key) for key in keys.split("+")]
        actions = [*({"type": "keyDown", "value": key} for key in values)]
        actions += [{"type": "keyUp", "value": key} for key in reversed(values)]
        self.perform({"type": "key", "id": "keyboard", "actions": actions})

    def click(self, x: float, y: float) -> None:
        """Click a point of the page [CSS px]."""
        self._point(_at(x, y), _DOWN, _UP)

    def move(self, x: float, y: float) -> None:
        """Move the mouse [CSS px]."""
        self._point(_at(x, y))

    def down(self) -> None:
        """Press the mouse's button."""
        self._point(_DOWN)

    def up(self) -> None:
        """Release the mouse's button."""
        self._point(_UP)

    def _point(self, *actions: Mapping[str, Any]) -> None:
        self.perform({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions})


def _at(x: float, y: float) -> dict[str, Any]:
    return {"type": "pointerMove", "x": round(x), "y": round(y), "duration": 0}


class RemoteDriver(Driver):
    """An open page in such a browser."""

    def __init__(self, page: RemotePage, url: str) -> None:
        self.page: Any = page
        self.open(url)

    def open(self, url: str) -> None:
        """Open the page, or open it again."""
        self.page.goto(url)
        _until(lambda: "?" not in self.page.address())  # the link leads on to the page
        self.until("__cocalib.state.shown")


class _Firefox(RemotePage):
    def __init__(self, address: str) -> None:
        super().__init__()
        self._socket = connect(f"{address}/session", max_size=None, compression=None, ping_interval=None)
        self._sent = 0
        self._errors: list[str] = []
        self._call("session.new", capabilities={})
        self._context = self._call("browsingContext.getTree")["contexts"][0]["context"]
        self._call("session.subscribe", events=["log.entryAdded"])
        viewport = dict(zip(("width", "height"), SIZE_PX, strict=True))
        self._call("browsingContext.setViewport", context=self._context, viewport=viewport)

    def goto(self, url: str) -> None:
        self._call("browsingContext.navigate", context=self._context, url=url, wait="complete")

    def address(self) -> str:
        return str(self._call("browsingContext.getTree")["contexts"][0]["url"])

    def evaluate(self, function: str) -> Any:
        answer = self._call(
            "script.evaluate",
            expression=f"Promise.resolve(({function})()).then((value) => JSON.stringify(value ?? null))",
            awaitPromise=True,
            target={"context": self._context},
        )
        assert answer["type"] == "success", answer["exceptionDetails"]["text"]
        return json.loads(answer["result"]["value"])

    def perform(self, source: Mapping[str, Any]) -> None:
        self._call("input.performActions", context=self._context, actions=[source])

    def errors(self) -> list[str]:
        self._call("session.status")  # what was logged before its answer has arrived
        return self._errors

    def close(self) -> None:
        self._call("browser.close")
        self._socket.close()

    def _call(self, method: str, **params: Any) -> Any:
        self._sent += 1
        self._socket.send(json.dumps({"id": self._sent, "method": method, "params": params}))
        while True:
            message = json.loads(self._socket.recv(_LONGEST_S))
            if message.get("method") == "log.entryAdded" and message["params"]["level"] == "error":
                self._errors.append(message["params"]["text"])
            if message.get("id") == self._sent:
                assert message["type"] == "success", message
                return message["result"]


class _WebKit(RemotePage):
    def __init__(self, port: int, log: Path) -> None:
        super().__init__()
        self._address, self._log = f"http://127.0.0.1:{port}/session", log
        window = Path(__file__).with_name("webkit_window.py")
        options = {"binary": sys.executable, "args": [str(window), *map(str, SIZE_PX)]}
        capabilities = {"alwaysMatch": {"webkitgtk:browserOptions": options}}
        session = self._call(capabilities=capabilities)
        self._address += f"/{session['sessionId']}"
        self._call("/timeouts", script=1000 * _LONGEST_S)

    def goto(self, url: str) -> None:
        self._call("/url", url=url)

    def address(self) -> str:
        return str(self._call("/url", "GET"))

    def evaluate(self, function: str) -> Any:
        script = f"""const done = arguments[0];
            Promise.resolve(({function})()).then((value) => done([value ?? null]), (error) => done(String(error)));"""
        answer = self._call("/execute/async", script=script, args=[])
        assert isinstance(answer, list), answer
        return answer[0]

    def perform(self, source: Mapping[str, Any]) -> None:
        self._call("/actions", actions=[source])

    def errors(self) -> list[str]:
        return re.findall(r"^(?!\S*/viser/)\S*: CONSOLE \S+ ERROR .*", self._log.read_text(), re.MULTILINE)

    def _call(self, path: str = "", method: str = "POST", **body: Any) -> Any:
        data = json.dumps(body).encode() if method == "POST" else None
        request = urllib.request.Request(f"{self._address}{path}", data, method=method)
        try:
            with urllib.request.urlopen(request, timeout=_LONGEST_S + PATIENCE_S) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            with error:
                raise AssertionError(error.read().decode()) from error


@contextmanager
def firefox(folder: Path) -> Iterator[RemotePage]:
    """Start the Firefox that is installed; skip the test if there is none."""
    program = _installed("Firefox", "firefox-esr", "firefox")
    log, profile = folder / "log.txt", folder / "profile"
    profile.mkdir()
    options = ["--headless", "--no-remote", "--remote-debugging-port", "0", "--profile", str(profile)]
    with _running([program, *options], log):
        page = _Firefox(_until(lambda: re.search(r"WebDriver BiDi listening on (\S+)", log.read_text()))[1])
        yield page
        page.close()


@contextmanager
def webkit(folder: Path) -> Iterator[RemotePage]:
    """Open a window of WebKitGTK; skip the test if it, its WebDriver or a display for it is not installed."""
    driver = _installed("WebKitGTK's WebDriver", "WebKitWebDriver")
    display = _installed("Broadway, GTK's display without a screen,", "broadwayd")
    if find_library("webkit2gtk-4.1") is None:
        pytest.skip("WebKitGTK 4.1 is not installed")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    own = dict.fromkeys(("XDG_RUNTIME_DIR", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME"), str(folder))
    environment = {**own, "GDK_BACKEND": "broadway", "BROADWAY_DISPLAY": ":0", "NO_AT_BRIDGE": "1", "LC_ALL": "C"}
    log, http = folder / "log.txt", folder / "http.socket"
    with (
        _running([display, "--unixsocket", str(http), ":0"], folder / "display.txt", own),
        _running([driver, f"--port={port}"], log, environment),
    ):
        _until(http.exists)
        _until(lambda: _answers(port))
        yield _WebKit(port, log)


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _installed(name: str, *programs: str) -> str:
    paths = [path for program in programs if (path := shutil.which(program))]
    if not paths:
        pytest.skip(f"{name} is not installed")
    return paths[0]


@contextmanager
def _running(command: list[str], log: Path, environment: Mapping[str, str] | None = None) -> Iterator[None]:
    """Run a program, and end it with all that it started."""
    with log.open("w") as output:
        process = subprocess.Popen(
            command, stdout=output, stderr=subprocess.STDOUT, env={**os.environ, **(environment or {})}
        )
    try:
        yield
    finally:
        started = [process, *psutil.Process(process.pid).children(recursive=True)] if process.poll() is None else []
        for one in started:
            with suppress(psutil.NoSuchProcess):
                one.kill()
        process.wait()


def _until(condition: Callable[[], Any]) -> Any:
    """Return what a condition gives once it holds."""
    end = time.monotonic() + PATIENCE_S
    while not (holds := condition()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return holds
