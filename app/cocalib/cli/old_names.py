"""Command names of earlier versions, for one version: each one's command line today, which is printed and run."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from calib_core.errors import InputError


@dataclass(frozen=True, slots=True)
class OldName:
    """A command's name of an earlier version.

    Attributes:
        command: its name today.
        arguments: makes today's arguments from the old ones.
        told_by_code: whether its exit code tells more than that it has run.
    """

    command: str
    arguments: Callable[[Sequence[str]], list[str]]
    told_by_code: Callable[[Sequence[str]], bool] = lambda arguments: True


def _without(flag: str) -> Callable[[Sequence[str]], list[str]]:
    return lambda arguments: [one for one in arguments if one != flag]


def _compared(arguments: Sequence[str]) -> list[str]:
    """Turn A B RECORDING... into B --against A --recording RECORDING..."""
    places, others = _places(arguments, ("--json", "--same-sensors", "--same-person", "--confirm-assumptions"))
    if len(places) < 2:
        if "-h" in arguments or "--help" in arguments:
            return list(arguments)
        raise InputError("compare needs two calibrations, and is cocalib check NEW --against OLD now")
    return [places[1], "--against", places[0], *others, *(["--recording", *places[2:]] if places[2:] else [])]


def _places(arguments: Sequence[str], switches: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the arguments that belong to no flag, and the others."""
    places, others, left = [], [], list(arguments)
    while left:
        token = left.pop(0)
        if not token.startswith("-"):
            places.append(token)
            continue
        others.append(token)
        if left and "=" not in token and token not in switches:
            others.append(left.pop(0))
    return places, others


def _reported(arguments: Sequence[str]) -> list[str]:
    """Turn --out FILE into --report FILE, and --pdf into another --report."""
    return list(_reports(arguments))


def _reports(arguments: Sequence[str]) -> Iterator[str]:
    for flag, value in zip(("", *arguments), (*arguments, ""), strict=True):
        if value not in ("", "--pdf"):
            yield "--report" if value == "--out" else value
        if "--pdf" in arguments and flag == "--out":
            yield from ("--report", str(Path(value).with_suffix(".pdf")))


OLD_NAMES = {
    "propose": OldName("solve", lambda arguments: ["--propose", *arguments]),
    "compare": OldName("check", _compared, lambda arguments: False),
    "report": OldName("evaluate", _reported, lambda arguments: "--require" in arguments),
    "video": OldName("show", _without("--overlay")),
    "record-rrd": OldName("show", list),
    "rerun": OldName("show", list),
    "fleet": OldName("batch", list),
}
