"""Attempt a part of a job: whatever goes wrong becomes a failure in words, and says whether another attempt may go well."""

import errno
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from calib_core.errors import CalibrationError
from cocalib.batch.results_folder import LOG_FILE
from cocalib.platform.error_boundary import error_boundary

_Made = TypeVar("_Made")

_UNREACHED = frozenset(
    getattr(errno, name)
    for name in (
        *(
            "ENOENT",
            "EACCES",
            "EPERM",
            "EIO",
            "ENXIO",
            "ENODEV",
            "EBUSY",
            "EAGAIN",
            "ENOMEM",
            "EMFILE",
            "ENFILE",
            "ENOSPC",
        ),
        *("ESTALE", "ETIMEDOUT", "ENOTCONN", "EHOSTDOWN", "EHOSTUNREACH", "ECONNRESET", "EREMOTEIO", "EDQUOT"),
    )
    if hasattr(errno, name)
)
"""Faults of a file system, not of what a file contains."""


@dataclass(frozen=True, slots=True)
class Failure:
    """Why there is no result.

    Attributes:
        reason: what happened.
        hint: what to do about it.
        is_final: the same inputs would give the same.
    """

    reason: str
    hint: str = ""
    is_final: bool = False


def attempted(doing: str, work: Callable[[], _Made], log: list[str]) -> _Made | Failure:
    """Do a part of a job.

    Args:
        doing: what it is, for the report of an unforeseen exception.
        work: does it.
        log: takes that report.
    """

    def keep(report: str) -> str:
        log.append(report)
        return f"and its report is in the result's {LOG_FILE}"

    lines: list[str] = []
    with error_boundary(doing, lines.append, keep):
        try:
            return work()
        except CalibrationError as error:
            return Failure(str(error), is_final=not _is_unreached(error))
        except MemoryError:
            return Failure("not enough memory", "run fewer workers at a time, or on a machine with more memory")
        except OSError as error:
            if error.errno not in _UNREACHED:
                raise
            where = f"{error.filename}: " if error.filename else ""
            return Failure(f"{where}{error.strerror or error}", "check that the worker reaches the file")
    return Failure(lines[0])


def _is_unreached(error: BaseException) -> bool:
    """Return whether an error was caused by a fault of the file system."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.errno in _UNREACHED:
            return True
        if isinstance(cause, MemoryError):
            return True
        cause = cause.__cause__ or cause.__context__
    return False
