"""Responses to GET: the page's files, downloads and viser's own page; any other path is a 404."""

import asyncio
import gzip
import http
import os
import posixpath
import re
import shlex
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from pathlib import Path

import msgspec
import numpy as np

from calib_core.errors import CalibrationError, InputError
from calib_core.input_files import name_text
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.formats.registry import written_formats
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.measurements import MIN_PAIRS, Unsolvable
from calib_core.recordings import Recording
from calib_core.results import Calibration
from calib_core.words.outcomes import in_sentences
from cocalib.report.making import current_report
from cocalib.report.markup import POLICY
from cocalib.session.state import Session
from cocalib.solving.solving import calibration_text
from cocalib.view.wording import sentence
from cocalib.web.channel.export_preview import NoPreview, export_preview, exported
from cocalib.web.channel.hub import Hub
from cocalib.web.channel.open_meaning import drawn_meaning, meaning_rows
from cocalib.web.crops import Crops
from cocalib.web.exports import FieldError, format_rows, image_of
from cocalib.web.port.viser_hook import client_page
from cocalib.workspace import Workspace

_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
    ".jpg": "image/jpeg",
    ".png": "image/png",
    **dict.fromkeys(("", ".cff", ".toml", ".txt"), "text/plain; charset=utf-8"),
}
_IMAGE_TYPES = {"jpeg": "image/jpeg", "png": "image/png"}
_ALWAYS = (
    ("X-Content-Type-Options", "nosniff"),
    ("X-Frame-Options", "SAMEORIGIN"),
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cache-Control", "no-cache"),
)
_OWN_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
_SITE_POLICY = _OWN_POLICY.replace("form-action 'none'", "form-action 'self'")  # the search of the documentation
_VISER_POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; worker-src blob: data: 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'self'"
)
_LANDING = (
    b'<!doctype html><meta charset="utf-8"><title>cocalib</title><link rel="icon" href="/icon.svg">'
    b'<p><a href="/">Open the page</a>'
)
_PAGE, _CROPS = "index.html", "/api/crops.json"
_CROP = re.compile(r"([0-9]{1,19}),(-?[0-9]{1,5}(?:\.[0-9]+)?),(-?[0-9]{1,5}(?:\.[0-9]+)?),([0-9]{1,3})")
_CROPS_AT_ONCE = 12
_INDEX = re.compile(r"[0-9]{1,9}")
_VISER_PAGE = re.compile(r"/viser/[0-9a-z]{1,40}/")
_IMPORT = re.compile(r"""^(?:import|export)\b[^'"();]*?["'](\.\.?/[a-z0-9_./]+\.js)["']""", re.MULTILINE)
_SCRIPT = re.compile(r'<script type="module" src="([a-z0-9_/]+\.js)">')


@dataclass(frozen=True, slots=True)
class Reply:
    """An HTTP response.

    Attributes:
        status: such as 200.
        headers: all except Content-Length.
        body: the content.
        length: of the content, even if it is not sent [bytes].
    """

    status: http.HTTPStatus
    headers: tuple[tuple[str, str], ...]
    body: bytes
    length: int


def _reply(
    body: bytes,
    content_type: str,
    *,
    status: int = 200,
    policy: str = _OWN_POLICY,
    more: tuple[tuple[str, str], ...] = (),
) -> Reply:
    named = {name for name, _ in more}
    always = (header for header in _ALWAYS if header[0] not in named)
    headers = (("Content-Type", content_type), *always, ("Content-Security-Policy", policy), *more)
    return Reply(http.HTTPStatus(status), headers, body, len(body))


def refusal(status: int, reason: str, *, more: tuple[tuple[str, str], ...] = ()) -> Reply:
    """Return a refusal in plain text, with further headers."""
    return _reply(f"{reason}\n".encode(), "text/plain; charset=utf-8", status=status, more=more)


def json_reply(body: bytes, *, more: tuple[tuple[str, str], ...] = ()) -> Reply:
    """Return JSON that no cache may keep."""
    return _reply(body, _TYPES[".json"], more=(("Cache-Control", "no-store"), *more))


def landing(set_cookie: str) -> Reply:
    """Return the page behind a link, which goes on to the page itself.

    It is a page and not a redirect: a browser that came here from a file or a message sends no SameSite=Strict cookie along
    a redirect, but does once our own page goes on.
    """
    more = (("Refresh", "0; url=/"), ("Set-Cookie", set_cookie), ("Cache-Control", "no-store"))
    return _reply(_LANDING, _TYPES[".html"], more=more)


class Routes:
    """Answers GET requests by path; every path that is served is listed explicitly."""

    def __init__(self, static: Path, site: Path | None = None) -> None:
        self._files: dict[str, Callable[[str], Reply]] = {
            f"/{name}": partial(_file, path) for name, path in _served(static).items()
        }
        self._files[f"/{_PAGE}"] = self._files["/"] = partial(_page, static / _PAGE)
        self._files["/docs/"] = lambda _query: refusal(404, "Not installed; in a checkout, make docs builds it.")
        if site is not None:
            pages = {name: partial(_file, path, policy=_SITE_POLICY) for name, path in _served(site).items()}
            self._files |= {f"/docs/{name}": make for name, make in {**pages, "": pages[_PAGE]}.items()}
        self._downloads: _Downloads | None = None
        self._made: Mapping[str, Callable[[str], Reply]] | None = None

    def admit(self, workspace: Workspace, recording: Recording, hub: Hub) -> None:
        """Serve this recording from now on."""
        self._downloads = _Downloads(workspace, recording, hub)
        self._made = self._downloads.by_path()

    def withdraw(self) -> None:
        """Serve no recording until another one is admitted."""
        self._made = None
        if self._downloads is not None:
            self._downloads.end()

    async def answer(self, address: str) -> Reply:
        """Answer a GET; files and exports are produced outside the event loop.

        Args:
            address: path and query, as sent.
        """
        path, _, query = address.partition("?")
        if path.startswith("/api/") and self._made is None:
            return refusal(503, "The recording is still being opened; try again in a moment.")
        make = self._files.get(path) or (self._made.get(path) if self._made is not None else None)
        if _VISER_PAGE.fullmatch(path):
            make = lambda _query: _viser_page()  # noqa: E731
        if make is None:
            return refusal(404, "Not found.")
        crops = self._downloads.crops.thread if path == _CROPS and self._downloads is not None else None
        return await asyncio.get_running_loop().run_in_executor(crops, make, query)


class _Downloads:
    """Responses generated from the session of a recording."""

    def __init__(self, workspace: Workspace, recording: Recording, hub: Hub) -> None:
        self._workspace = workspace
        self._recording = recording
        self._hub = hub
        self._view_file = _ViewFile(recording)
        self.crops = Crops(recording, workspace.restored.folder)
        self._unsubscribe = workspace.subscribe(self.crops.keep_marks)

    def end(self) -> None:
        """Write nothing more in the background."""
        self._unsubscribe()
        self.crops.end()
        self._view_file.end()

    def by_path(self) -> Mapping[str, Callable[[str], Reply]]:
        """Return the function for each path; each takes the query."""
        formats = written_formats()
        return {
            "/api/calibration.json": self._calibration,
            "/api/clicks.json": self._clicks,
            "/api/report.html": self._report,
            "/api/rerun.json": self._rerun,
            "/api/view.rrd": lambda _query: self._of_calibration(self._view_file.answer),
            "/api/formats.json": lambda _query: _reply(msgspec.json.encode(format_rows()), _TYPES[".json"]),
            "/api/activity.json": self._activity,
            "/api/camera.yaml": self._camera,
            "/api/board_corners.json": self._board_corners,
            "/api/image_changes.json": self._image_changes,
            "/api/check_point_image": self._check_point_image,
            _CROPS: self._cut_outs,
            "/api/meanings.json": self._meanings,
            "/api/meaning.jpg": self._meaning,
            **{f"/api/export/{form.name}": partial(self._export, form.name) for form in formats},
            **{f"/api/preview/{form.name}": partial(self._preview, form.name) for form in formats},
        }

    def _calibration(self, _query: str) -> Reply:
        return self._of_calibration(lambda text: _download(text.encode(), "calibration.json"))

    def _report(self, query: str) -> Reply:
        """Return the report to keep, or to show in the page."""

        def make(text: str) -> Reply:
            report = current_report(text, self._recording).encode()
            return (
                _reply(report, _TYPES[".html"], policy=POLICY)
                if query == "shown=1"
                else _download(report, "report.html")
            )

        return self._of_calibration(make)

    def _rerun(self, _query: str) -> Reply:
        """Say how the recording with its calibration is opened in Rerun on this machine."""
        from cocalib.rerun import has_display, is_installed

        def make(_text: str) -> Reply:
            paths = shlex.join(name_text(str(path.absolute())) for path in self._recording.paths)
            command = f"cocalib show {paths} --calibration calibration.json"
            offer = RerunOffer(command, is_installed(), has_display(os.environ))
            return _reply(msgspec.json.encode(offer), _TYPES[".json"])

        return self._of_calibration(make)

    def _export(self, name: str, query: str) -> Reply:
        def make(text: str) -> Reply:
            written = exported(_file_of(text), name, query).download
            return _download(written.data, written.file_name)

        return self._of_calibration(make)

    def _preview(self, name: str, query: str) -> Reply:
        def make(text: str) -> Reply:
            try:
                preview = export_preview(_file_of(text), name, query, self._workspace.facts.name)
            except FieldError as error:
                return _reply(msgspec.json.encode(NoPreview(sentence(str(error)), error.field)), _TYPES[".json"])
            return _reply(msgspec.json.encode(preview), _TYPES[".json"])

        reply = self._of_calibration(make)
        if reply.status != 409:
            return reply
        return _reply(msgspec.json.encode(NoPreview(reply.body.decode().strip())), _TYPES[".json"])

    def _check_point_image(self, _query: str) -> Reply:
        """Return the frame in which the check point was clicked; the query only tells one calibration's from another's."""

        def make(text: str) -> Reply:
            stamp, times = image_of(_file_of(text)), self._recording.image_times
            index = -1 if stamp is None else int(np.searchsorted(times, stamp))
            if not 0 <= index < len(times) or times[index] != stamp:
                return refusal(404, "No image shows the check point.")
            image = self._recording.image_bytes(index)
            return _reply(image.data, _IMAGE_TYPES[image.format], more=(("Cache-Control", "no-store"),))

        return self._of_calibration(make)

    def _cut_outs(self, query: str) -> Reply:
        """Return cut-outs of marks in base 64, null for what cannot be cut: `NANOSECONDS,COLUMN,ROW,SIDE;…`."""
        matches = [_CROP.fullmatch(key) for key in query.split(";", _CROPS_AT_ONCE - 1)]
        if None in matches:
            return refusal(400, f"Name stamp, pixel and side of at most {_CROPS_AT_ONCE} marks.")
        return json_reply(msgspec.json.encode([self._cut_out(match) for match in matches if match]))

    def _cut_out(self, match: re.Match[str]) -> bytes | None:
        try:
            return self.crops.get((int(match[1]), float(match[2]), float(match[3]), int(match[4])))
        except (KeyError, ValueError):  # no image has this stamp, or it cannot be decoded
            return None

    def _of_calibration(self, make: Callable[[str], Reply]) -> Reply:
        """Make a reply from the current calibration-1 text, or say why there is none; never from an outdated calibration."""
        session, camera_file = self._workspace.session, self._workspace.camera_file
        if not session.is_solved or not isinstance(session.outcome, Calibration):
            return refusal(409, _why_none(session))
        try:
            text = calibration_text(session.outcome, self._recording, session.confirmed, camera_file)
            return make(text)
        except CalibrationError as error:
            return refusal(409, sentence(str(error)))

    def _clicks(self, _query: str) -> Reply:
        return _download(self._workspace.clicks_text().encode(), "clicks.json")

    def _camera(self, query: str) -> Reply:
        """Return the calibrated lens, or with the query "in_use" the intrinsics that the session is solved with."""
        try:
            return _download(self._hub.lens.camera_yaml(calibrated=query != "in_use").encode(), "camera.yaml")
        except CalibrationError as error:
            return refusal(409, sentence(str(error)))

    def _board_corners(self, query: str) -> Reply:
        """Return the corners that were found in the frame whose index is the query."""
        if not _INDEX.fullmatch(query):
            return refusal(400, "Name the frame by its index.")
        return json_reply(msgspec.json.encode(self._hub.lens.corners(int(query))))

    def _activity(self, _query: str) -> Reply:
        survey = self._hub.survey
        if survey is None:
            return refusal(409, "The radar data are still being read.")
        return _reply(msgspec.json.encode(survey.activity), _TYPES[".json"])

    def _meanings(self, _query: str) -> Reply:
        return json_reply(msgspec.json.encode(meaning_rows(self._workspace.open_meaning)))

    def _meaning(self, query: str) -> Reply:
        try:
            image = drawn_meaning(self._workspace.open_meaning, self._recording, query)
        except CalibrationError as error:
            return refusal(409, sentence(str(error)))
        return _reply(image, _TYPES[".jpg"])

    def _image_changes(self, _query: str) -> Reply:
        return _reply(msgspec.json.encode(self._hub.image_changes), _TYPES[".json"])


@dataclass(frozen=True, slots=True)
class RerunOffer:
    """How a recording with its calibration is opened in Rerun.

    Attributes:
        command: opens a window, with the calibration as it is downloaded.
        is_installed: whether rerun-sdk is.
        opens_window: whether this machine has a display.
    """

    command: str
    is_installed: bool
    opens_window: bool


_MOST_VIEW_BYTES = 500_000_000


class _ViewFile:
    """The recording with its calibration as an .rrd file: written in a thread while whoever wants it asks again and again."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="rerun")
        self._job: tuple[str, Future[bytes]] | None = None
        self._progress, self._ended = "The recording is being read", False

    def answer(self, text: str) -> Reply:
        """Return the file for a calibration once it is written; until then, a 202 with how far it is.

        Raises:
            InputError: rerun-sdk is missing, or the file is too large for a page.
            RecordingError: the recording cannot be read.
        """
        job = self._job
        if job is None or job[0] != text:
            job = self._job = (text, self._thread.submit(self._write, text))
        if not job[1].done():
            return _reply(self._progress.encode(), _TYPES[".txt"], status=202)
        self._job = None
        return _download(job[1].result(), "view.rrd")

    def end(self) -> None:
        """Stop writing with the next frame."""
        self._ended = True
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _write(self, text: str) -> bytes:
        from cocalib.recorded_view import recorded_view
        from cocalib.rerun import write_view

        def progress(done: int, total: int) -> None:
            self._progress = f"{done} of {total} frames are written"
            if self._ended:
                raise InputError("the recording was closed while the file was written")

        with tempfile.TemporaryDirectory(prefix="cocalib-") as folder:
            path = Path(folder) / "view.rrd"
            write_view(recorded_view(self._recording, _file_of(text).calibration, "range"), path, progress=progress)
            if path.stat().st_size > _MOST_VIEW_BYTES:
                size = f"{path.stat().st_size / 1e6:.0f} MB"
                raise InputError(
                    f"the file has {size}, too large for a page; add --out view.rrd to the command and copy it"
                )
            return path.read_bytes()


def _served(folder: Path) -> dict[str, Path]:
    """Return the files of a folder that browsers ask for, by their names with slashes."""
    files = (path for path in folder.rglob("*") if path.suffix in _TYPES and path.is_file())
    return {path.relative_to(folder).as_posix(): path for path in files}


def _file(path: Path, _query: str = "", *, policy: str = _OWN_POLICY) -> Reply:
    return _reply(path.read_bytes(), _TYPES[path.suffix], policy=policy)


def _page(path: Path, _query: str) -> Reply:
    page = with_preloaded_modules(path.read_text(encoding="utf-8"), path.parent)
    return _reply(page.encode(), _TYPES[path.suffix])


def _download(data: bytes, name: str) -> Reply:
    kind = _TYPES.get(Path(name).suffix, "application/octet-stream")
    return _reply(data, kind, more=(("Content-Disposition", f'attachment; filename="{name}"'),))


@lru_cache(maxsize=2)
def _file_of(text: str) -> CalibrationFile:
    return read_calibration(text, "the calibration")


@cache
def _viser_page() -> Reply:
    """Return viser's own client with a limited drawing rate (static/space/pace.js)."""
    page = client_page("../../space/pace.js")
    body = gzip.compress(page, mtime=0)
    return _reply(body, _TYPES[".html"], policy=_VISER_POLICY, more=(("Content-Encoding", "gzip"),))


def _why_none(session: Session) -> str:
    if session.needs_solving and len(session.clicks) >= MIN_PAIRS:
        return "The latest change is still being solved; try again in a moment."
    if session.is_solved and isinstance(session.outcome, Unsolvable):
        return str(in_sentences(session.outcome))
    return "There is no calibration yet. Click the reflector in at least four placements."


def with_preloaded_modules(page: str, folder: Path) -> str:
    """Return the page with a `modulepreload` link for each module that its scripts import, directly or not.

    Args:
        page: HTML with a head.
        folder: where the modules are.
    """
    names: dict[str, None] = {}
    for script in _SCRIPT.findall(page):
        _collect(script, folder, names)
    links = "".join(f'<link rel="modulepreload" href="{name}">' for name in names)
    return page.replace("</head>", f"{links}</head>", 1)


def _collect(name: str, folder: Path, names: dict[str, None]) -> None:
    """Add a module and all that it imports, each once."""
    if name in names:
        return
    names[name] = None
    for imported in _IMPORT.findall((folder / name).read_text(encoding="utf-8")):
        _collect(posixpath.normpath(posixpath.join(posixpath.dirname(name), imported)), folder, names)
