"""The actions of `cocalib batch` on results: what those of many sessions say of a fleet."""

import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from calib_core.errors import InputError
from cocalib.cli.output import write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from cocalib.fleet.records import FleetRecord

ACTIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "status": (),
    "history": ("VEHICLE",),
    "compare": ("A", "B"),
    "summary": (),
    "export": (),
}
"""Each action with the names that it takes before the folder of results."""
_AS_JSON: Final = ("status", "history", "compare")
_LOOK: Final = 3


def fleet(action: str, given: Sequence[str], *, json: bool, csv: Path | None) -> int:
    """Run an action; return the exit code.

    Args:
        action: one of ACTIONS.
        given: its names, then the folder that batch wrote to.
        json: whether one JSON object is printed instead of text.
        csv: file to write the table to.

    Raises:
        InputError: they do not fit, or the results cannot be read.
    """
    from cocalib.fleet.reading import read_fleet

    folder, names = _fitting_folder(action, given, json=json, csv=csv), given[:-1]
    found = read_fleet(folder)
    for unread in found.unread:
        print(f"note: {unread.place} {unread.reason}", file=sys.stderr)
    if action == "status":
        return _status(found, json=json)
    if action == "history":
        return _history(found, *names, json=json)
    if action == "compare":
        return _compare(found, *names, json=json)
    return _summary(folder, found) if csv is None else _export(found, csv)


def _fitting_folder(action: str, given: Sequence[str], *, json: bool, csv: Path | None) -> Path:
    """Refuse options of another action, and a wrong number of names; return the folder.

    Raises:
        InputError: they do not fit.
    """
    if json and action not in _AS_JSON:
        raise InputError(f"--json applies to batch {', '.join(_AS_JSON)} only; see cocalib batch --help")
    if csv is not None and action != "export":
        raise InputError("--csv applies to batch export only; see cocalib batch --help")
    wanted = (*ACTIONS[action], "OUT")
    if len(given) != len(wanted):
        raise InputError(
            f"batch {action} takes {' '.join(wanted)}; {len(given)} given; OUT is the folder that batch wrote to"
        )
    if action == "export" and csv is None:
        raise InputError("batch export needs the name of the new file: --csv FILE")
    folder = Path(given[-1])
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the one that batch wrote to")
    return folder


def _status(fleet: "FleetRecord", *, json: bool) -> int:
    from cocalib.cli.fleet_tables import kind_lines, plan_lines, status_lines
    from cocalib.fleet.json_documents import status_document
    from cocalib.fleet.kinds import kinds_of
    from cocalib.fleet.standing import standings_of

    kinds, now_ns = kinds_of(fleet), time.time_ns()
    standings = standings_of(fleet, kinds)
    if json:
        _print_json(status_document(fleet, standings, kinds, now_ns=now_ns))
    else:
        troubled = bool(fleet.unread or fleet.missing)
        lines = [*status_lines(standings, now_ns=now_ns, troubled=troubled), *plan_lines(fleet)]
        print("\n".join([*lines, *kind_lines(kinds)]))
    return _LOOK if fleet.unread or fleet.missing or any(one.needs for one in standings) else 0


def _history(fleet: "FleetRecord", name: str, *, json: bool) -> int:
    from cocalib.cli.fleet_tables import history_lines
    from cocalib.fleet.choosing import vehicle_named
    from cocalib.fleet.json_documents import history_document

    vehicle = vehicle_named(fleet, name)
    superseded = [one for one in fleet.superseded if one.outcome.vehicle == name]
    if json:
        _print_json(history_document(vehicle, superseded))
    else:
        print("\n".join(history_lines(vehicle, superseded)))
        for one in fleet.unread:
            if one.session is not None and one.session[0] == name:
                print(f"session {one.session[1]}: {one.place} {one.reason}")
    return 0


def _compare(fleet: "FleetRecord", a: str, b: str, *, json: bool) -> int:
    from cocalib.fleet.choosing import compare_sessions
    from cocalib.fleet.json_documents import comparison_document

    compared = compare_sessions(fleet, a, b)
    if json:
        _print_json(comparison_document(compared))
    else:
        print(compared.words)
    return _LOOK if compared.outcome == "differs" else 0


def _export(fleet: "FleetRecord", csv: Path) -> int:
    from cocalib.fleet.table_export import csv_bytes

    write_whole(csv, csv_bytes(fleet))
    print(f"{csv} written", file=sys.stderr)
    return 0


def _summary(folder: Path, fleet: "FleetRecord") -> int:
    from cocalib.fleet.summary_page import write_summary

    print(f"{write_summary(folder, fleet)} written", file=sys.stderr)
    return 0


def _print_json(document: dict[str, Any]) -> None:
    import msgspec

    print_exactly(msgspec.json.format(msgspec.json.encode(document), indent=2).decode())
