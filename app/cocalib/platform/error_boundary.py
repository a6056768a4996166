"""The one place where an unforeseen exception ends: one line for the user, and a report in a file.

Expected errors are subclasses of CalibrationError and are handled where they are understood. Anything else is a bug in
cocalib. The command, each message of a page, each HTTP request and each background task run inside `error_boundary`, so
that a bug costs one answer and neither the session nor the page. No other module catches `Exception`.
"""

import contextlib
import os
import platform
import re
import secrets
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from importlib import metadata

from cocalib.platform.resources import state_folder, version
from cocalib.platform.terminal import escaped

INTERNAL_ERROR = 70
"""The exit code of a command that ended in the boundary (EX_SOFTWARE)."""
_MOST_REPORTS = 20
_DEBUG = "COCALIB_DEBUG"
_NAMED = ("cocalib", "numpy", "opencv-python-headless", "msgspec", "viser", "websockets", "rosbags", "tyro")
_SECRET = re.compile(r"(token[=\s]+|cookie[:=]\s*)[^\s'\"&;]+", re.IGNORECASE)
_reported: dict[tuple[str, ...], str] = {}
_one_at_a_time = threading.Lock()


@contextlib.contextmanager
def error_boundary(doing: str, tell: Callable[[str], None], keep: Callable[[str], str] | None = None) -> Iterator[None]:
    """End an unforeseen exception of the `with` block: save a report, and pass one line to `tell`.

    KeyboardInterrupt, SystemExit and the cancellation of a task pass.

    Args:
        doing: what was being done, such as "cocalib info".
        tell: takes the line; must not raise.
        keep: takes the report and returns where it is, as a clause; None for a file in the state folder.
    """
    try:
        yield
    except Exception as error:  # noqa: BLE001
        tell(report_of(error, doing, keep))


def report_of(error: BaseException, doing: str, keep: Callable[[str], str] | None = None) -> str:
    """Save a report of an exception; return one line that says what happened and where the report is.

    The same error at the same place is saved once per process. With COCALIB_DEBUG set, the traceback goes to stderr too.

    Args:
        error: the exception.
        doing: what was being done.
        keep: takes the report and returns where it is, as a clause; None for a file in the state folder.
    """
    if os.environ.get(_DEBUG):
        traceback.print_exception(error, file=sys.stderr)
    what = f"internal error ({type(error).__name__}: {_one_line(str(error))})"
    if keep is not None:
        return f"{what}; this is a bug in cocalib, {keep(_report_text(error, doing))}"
    key = (type(error).__name__, *map(str, traceback.extract_tb(error.__traceback__)[-3:]))
    with _one_at_a_time:
        if key not in _reported:
            _reported[key] = _saved(_report_text(error, doing))
    return f"{what}; this is a bug in cocalib, {_reported[key]}"


def report_thread_errors() -> None:
    """Report exceptions that end a thread the same way, in one line on stderr."""

    def report(ended: threading.ExceptHookArgs) -> None:
        if ended.exc_value is not None and isinstance(ended.exc_value, Exception):
            name = ended.thread.name if ended.thread else "a thread"
            print(f"cocalib: {report_of(ended.exc_value, name)}", file=sys.stderr)

    threading.excepthook = report


def _one_line(text: str) -> str:
    return escaped(" ".join(text.split()))[:300]


def _report_text(error: BaseException, doing: str) -> str:
    versions = ", ".join(f"{name} {_version_of(name)}" for name in _NAMED)
    lines = [
        "Error report of cocalib. Attach it to a bug report, after checking that it names nothing confidential.",
        f"time      {datetime.now(UTC).isoformat(timespec='seconds')}",
        f"doing     {doing}",
        f"command   {_command(sys.argv)}",
        f"version   {version()}",
        f"platform  {platform.platform()}, Python {platform.python_version()}",
        f"packages  {versions}",
        "",
        "".join(traceback.format_exception(error)),
    ]
    return escaped(_SECRET.sub(r"\1(removed)", "\n".join(lines)))


def _command(arguments: Sequence[str]) -> str:
    """Return the command line without the token."""
    shown = list(arguments)
    for number, argument in enumerate(shown):
        if argument == "--token" and number + 1 < len(shown):
            shown[number + 1] = "(removed)"
        elif argument.startswith("--token="):
            shown[number] = "--token=(removed)"
    return " ".join(shown)


def _version_of(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "?"


def _saved(text: str) -> str:
    """Save a report; return where it is, or why it is not saved."""
    folder = state_folder() / "reports"
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    path = folder / f"error-{stamp}-{secrets.token_hex(3)}.txt"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(text)
        for old in sorted(folder.glob("error-*.txt"))[:-_MOST_REPORTS]:  # the names sort by time
            old.unlink(missing_ok=True)
    except OSError as error:
        return f"and its report could not be saved ({error.strerror or error}); {_DEBUG}=1 shows it"
    return f"and a report is saved in {path}"
