"""Show a file in Rerun's own window, or in its web viewer, served by us on this machine only.

Rerun's own server of the web viewer cannot forbid the page anything, and the page asks the internet for the newest version,
examples and a font, and sends usage data. Its three files are therefore taken once from that server, on this machine, and
served with a policy under which the browser connects to nothing but us.
"""

import contextlib
import os
import secrets
import shutil
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from calib_core.errors import InputError
from cocalib.rerun.sdk import offline_environment, viewer_program

POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self'; worker-src 'self' blob:; connect-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
"""The page may connect to its own server only."""

_HOST = "127.0.0.1"
_PAGE, _VIEW = "", "view.rrd"
_ASSETS = {
    _PAGE: "text/html; charset=utf-8",
    "re_viewer.js": "text/javascript",
    "re_viewer_bg.wasm": "application/wasm",
}
_PATIENCE_S = 30.0
_TO_ONE_MACHINE = ("--bind", "127.0.0.1", "--port", "auto")
"""The viewer also listens for programs that log to it: on all interfaces unless it is told otherwise."""


@dataclass(frozen=True, slots=True)
class ServedView:
    """A file that is being served.

    Attributes:
        url: of the page, with a token that nobody can guess.
        server: serves until it is shut down.
    """

    url: str
    server: ThreadingHTTPServer


@contextlib.contextmanager
def serve_view(path: Path, port: int = 0) -> Iterator[ServedView]:
    """Serve the web viewer with a file; the caller runs `server.serve_forever`.

    Args:
        path: of the .rrd file.
        port: 0 for any free one.

    Raises:
        InputError: rerun-sdk is missing, its viewer does not start, or the port is taken.
    """
    assets = _assets()
    token = secrets.token_urlsafe(16)
    try:
        server = ThreadingHTTPServer((_HOST, port), partial(_Handler, token, assets, path))
    except OSError as error:
        raise InputError(f"port {port}: cannot be used: {error.strerror or error}") from error
    server.daemon_threads = True
    try:
        base = f"http://{_HOST}:{server.server_address[1]}/{token}/"
        yield ServedView(f"{base}?url={base}{_VIEW}&hide_welcome_screen=1", server)
    finally:
        server.server_close()


def _assets() -> Mapping[str, bytes]:
    """Take the files of the web viewer from Rerun's own server, which runs for this moment only.

    Raises:
        InputError: it does not start.
    """
    page_port, data_port = _free_ports()
    ports = ("--web-viewer-port", str(page_port), "--port", str(data_port))
    command = [str(viewer_program()), "--serve-web", "--bind", _HOST, *ports]
    try:
        process = subprocess.Popen(
            command, env=offline_environment(os.environ), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
    except OSError as error:
        raise InputError(f"{command[0]}: cannot be started: {error.strerror or error}") from error
    try:
        return {name: _fetched(f"http://{_HOST}:{page_port}/{name}", process) for name in _ASSETS}
    finally:
        process.kill()
        process.wait()


def _free_ports() -> tuple[int, int]:
    with socket.socket() as first, socket.socket() as second:
        for one in (first, second):
            one.bind((_HOST, 0))
        return first.getsockname()[1], second.getsockname()[1]


def _fetched(url: str, process: "subprocess.Popen[bytes]") -> bytes:
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    until_s = time.monotonic() + _PATIENCE_S
    while True:
        try:
            with opener.open(url, timeout=_PATIENCE_S) as answer:
                return bytes(answer.read())
        except urllib.error.HTTPError as error:
            raise InputError(
                f"Rerun's web viewer has no {url.rsplit('/', 1)[1]} ({error}); use cocalib show --out FILE.rrd"
            ) from error
        except (OSError, urllib.error.URLError) as error:
            if process.poll() is not None or time.monotonic() > until_s:
                raise InputError(
                    f"Rerun's web viewer does not start ({error}); write a file with cocalib show --out FILE.rrd"
                ) from error
            time.sleep(0.05)


class _Handler(BaseHTTPRequestHandler):
    """Answers GET for the viewer's files and the view, to whoever has the token."""

    server_version = "cocalib"
    sys_version = ""

    def __init__(self, token: str, assets: Mapping[str, bytes], view: Path, *arguments: Any) -> None:
        self.token, self.assets, self.view = token, assets, view
        super().__init__(*arguments)

    @property
    def port(self) -> int:
        """The port of this server."""
        return int(self.request.getsockname()[1])

    def do_GET(self) -> None:
        """Send one file; anything else is not found."""
        prefix, name = f"/{self.token}/", self.path.partition("?")[0]
        here = {f"{host}:{self.port}" for host in (_HOST, "localhost")}
        if self.headers.get("Host") not in here or not name.startswith(prefix):
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        wanted = name.removeprefix(prefix)
        with contextlib.suppress(ConnectionError):  # the page was closed
            if wanted == _VIEW:
                self._send_view()
            elif wanted in self.assets:
                self._head(_ASSETS[wanted], len(self.assets[wanted]))
                self.wfile.write(self.assets[wanted])
            else:
                self.send_error(HTTPStatus.NOT_FOUND)

    def _send_view(self) -> None:
        with self.view.open("rb") as file:
            self._head("application/octet-stream", os.fstat(file.fileno()).st_size)
            shutil.copyfileobj(file, self.wfile, 1 << 20)

    def _head(self, kind: str, length: int) -> None:
        self.send_response(HTTPStatus.OK)
        for header, value in {
            "Content-Type": kind,
            "Content-Length": str(length),
            "Content-Security-Policy": POLICY,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cache-Control": "no-store",
        }.items():
            self.send_header(header, value)
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""


def has_display(environment: Mapping[str, str], platform: str = sys.platform) -> bool:
    """Return whether a window can be opened."""
    return not platform.startswith("linux") or bool(environment.get("DISPLAY") or environment.get("WAYLAND_DISPLAY"))


def require_display(environment: Mapping[str, str], platform: str = sys.platform) -> None:
    """Refuse to go on where no window can be opened.

    Raises:
        InputError: there is no display.
    """
    if not has_display(environment, platform):
        raise InputError(
            "no window can be opened here: there is no display (DISPLAY and WAYLAND_DISPLAY are not set, as over ssh). Use "
            "--web for a viewer in the browser, or write a file with cocalib show ... --out FILE.rrd and open it on a "
            "computer with a screen"
        )


def open_window(path: Path) -> int:
    """Show a file in Rerun's window until it is closed; return its exit code.

    Raises:
        InputError: the viewer is missing or cannot be started.
    """
    command = [str(viewer_program()), *_TO_ONE_MACHINE, str(path)]
    try:
        return subprocess.run(command, env=offline_environment(os.environ), check=False).returncode
    except OSError as error:
        raise InputError(f"{command[0]}: cannot be started: {error.strerror or error}") from error
