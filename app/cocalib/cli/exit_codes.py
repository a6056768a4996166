"""The law of exit codes: its words, for help and site, and what counts as in doubt."""

from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from calib_core.interchange.calibration_file import Evidence
    from calib_core.measurements import DataWarning
    from calib_core.results.verdict import VerdictLevel

DONE, NO_ANSWER, IN_DOUBT = 0, 1, 3
_FAILED_FROM, _MOST = 10, 99

Required = Literal["good", "usable"]
"""What `--require` asks of a verdict."""

_ENOUGH: Final[dict[str | None, tuple[str, ...]]] = {"usable": ("good", "usable"), "good": ("good",)}

_LAW: Final = (
    (
        "solve, import and evaluate",
        "0 done; 1 no answer (evaluate: no clicks or boxes to evaluate against); 3 contradictory, unconfirmed "
        "assumptions, no radar data at more than a quarter of the clicks, or below --require",
    ),
    ("export", "0 done; 3 contradictory, and nothing is written without --despite-verdict"),
    ("check", "0 agrees or sound; 1 differs or wrong; 2 unreadable; 3 cannot be decided"),
    (
        "watch",
        "0 nothing moved, or all alike; 1 camera and radar turned against each other; 3 cannot be told, or a new baseline",
    ),
    (
        "batch",
        "0 done; 10 + the number of failed sessions, at most 99; a session in doubt fails only with --require; "
        "status: 3 unless all are solved and none is in doubt",
    ),
    ("the others", "0 done; 1 nothing found, or damage found; 3 needs a look"),
    (
        "all",
        "2 wrong usage or unreadable input; 70 an internal error, with a report in a file; 128 + the signal that stopped it",
    ),
)


def exit_codes() -> str:
    """Return the law as one paragraph."""
    return "Exit codes. " + " ".join(f"{commands}: {words}." for commands, words in _LAW)


_MISSING: Final = "radar-missing"
"""The code of the warning that puts a coarse answer in doubt."""


def exit_code(
    level: "VerdictLevel | None",
    evidence: "Evidence | None",
    require: Required | None,
    warnings: "Iterable[DataWarning]" = (),
) -> int:
    """Return 3 if an answer is in doubt, else 0.

    Args:
        level: of the verdict on the calibration; None if nobody judged it.
        evidence: what its pose rests on; None if that is not stated.
        require: the least level that is asked for; None asks for none.
        warnings: of the calibration.
    """
    level = level or "nothing"
    missing = any(warning.code == _MISSING for warning in warnings)
    in_doubt = level == "contradictory" or evidence == "imported_assumed" or missing
    return IN_DOUBT if in_doubt or level not in _ENOUGH.get(require, (level,)) else DONE


def batch_exit_code(levels: "Sequence[str | None]", require: Required | None) -> int:
    """Return the exit code of a batch.

    Args:
        levels: of the verdicts on its sessions; None for one without a calibration.
        require: the least level that is asked for.
    """
    failed = sum(level is None or level not in _ENOUGH.get(require, (level,)) for level in levels)
    return min(_FAILED_FROM + failed, _MOST) if failed else DONE
