"""`cocalib fleet`: what the results of many sessions say of a fleet."""

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeAlias

import tyro

from calib_core.errors import InputError
from cocalib.cli.flags import File, Switch, called
from cocalib.cli.output import write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from cocalib.fleet.records import FleetRecord

_Action: TypeAlias = Literal["status", "history", "compare", "export", "summary"]
_NAMES: Final[dict[str, tuple[str, ...]]] = {
    "status": (),
    "history": ("VEHICLE",),
    "compare": ("A", "B"),
    "export": (),
    "summary": (),
}
_FLAG_OF = {
    "--json": ("status", "history", "compare"),
    "--csv": ("export",),
}
_LOOK: Final = 3


@dataclass(frozen=True, slots=True)
class Fleet:
    """Tell how a fleet is calibrated, from the results of a batch: status, history, comparisons, summary page.

    OUT is the folder that batch wrote to. `status OUT`: where each vehicle stands. `history VEHICLE OUT`: its sessions and what
    changed in between. `compare A B OUT`: two sessions VEHICLE/SESSION, or two vehicles of one type. `export OUT`: all
    sessions as a table. `summary OUT`: write OUT/summary.html.
    """

    action: Annotated[_Action, tyro.conf.Positional, called("ACTION")]
    """What to do: status, history, compare, export or summary."""
    given: Annotated[tuple[str, ...], tyro.conf.Positional, called("NAME... OUT")] = ()
    """Names that the action takes, then the folder that batch wrote to."""
    json: Switch = False
    """With status, history, compare: print one JSON object instead of text."""
    csv: File = None
    """With export: CSV file to write."""

    def run(self) -> int:
        """Run the action; return the exit code."""
        from cocalib.fleet.reading import read_fleet

        folder = self._fitting_folder()
        names = self.given[:-1]
        fleet = read_fleet(folder)
        for unread in fleet.unread:
            print(f"note: {unread.place} {unread.reason}", file=sys.stderr)
        if self.action == "status":
            return self._status(fleet)
        if self.action == "history":
            return self._history(fleet, names[0])
        if self.action == "compare":
            return self._compare(fleet, *names)
        return self._export(fleet) if self.action == "export" else _summary(folder, fleet)

    def _fitting_folder(self) -> Path:
        """Refuse options of another action, and a wrong number of names; return the folder.

        Raises:
            InputError: they do not fit.
        """
        options: dict[str, object] = {
            "--json": self.json,
            "--csv": self.csv,
        }
        for name, given in options.items():
            if given and self.action not in _FLAG_OF[name]:
                raise InputError(f"{name} applies to fleet {', '.join(_FLAG_OF[name])} only; see cocalib fleet --help")
        wanted = (*_NAMES[self.action], "OUT")
        if len(self.given) != len(wanted):
            raise InputError(
                f"fleet {self.action} takes {' '.join(wanted)}; {len(self.given)} given; OUT is the folder that batch wrote to"
            )
        if self.action == "export" and self.csv is None:
            raise InputError("fleet export needs the name of the new file: --csv FILE")
        folder = Path(self.given[-1])
        if not folder.is_dir():
            raise InputError(f"{folder}: no such folder; give the one that batch wrote to")
        return folder

    def _status(self, fleet: "FleetRecord") -> int:
        from cocalib.cli.fleet_tables import kind_lines, plan_lines, status_lines
        from cocalib.fleet.json_documents import status_document
        from cocalib.fleet.kinds import kinds_of
        from cocalib.fleet.standing import standings_of

        kinds, now_ns = kinds_of(fleet), time.time_ns()
        standings = standings_of(fleet, kinds)
        if self.json:
            _print_json(status_document(fleet, standings, kinds, now_ns=now_ns))
        else:
            troubled = bool(fleet.unread or fleet.missing)
            lines = [*status_lines(standings, now_ns=now_ns, troubled=troubled), *plan_lines(fleet)]
            print("\n".join([*lines, *kind_lines(kinds)]))
        return _LOOK if fleet.unread or fleet.missing or any(one.needs for one in standings) else 0

    def _history(self, fleet: "FleetRecord", name: str) -> int:
        from cocalib.cli.fleet_tables import history_lines
        from cocalib.fleet.choosing import vehicle_named
        from cocalib.fleet.json_documents import history_document

        vehicle = vehicle_named(fleet, name)
        superseded = [one for one in fleet.superseded if one.outcome.vehicle == name]
        if self.json:
            _print_json(history_document(vehicle, superseded))
        else:
            print("\n".join(history_lines(vehicle, superseded)))
            for one in fleet.unread:
                if one.session is not None and one.session[0] == name:
                    print(f"session {one.session[1]}: {one.place} {one.reason}")
        return 0

    def _compare(self, fleet: "FleetRecord", a: str, b: str) -> int:
        from cocalib.fleet.choosing import compare_sessions
        from cocalib.fleet.json_documents import comparison_document

        compared = compare_sessions(fleet, a, b)
        if self.json:
            _print_json(comparison_document(compared))
        else:
            print(compared.words)
        return _LOOK if compared.outcome == "differs" else 0

    def _export(self, fleet: "FleetRecord") -> int:
        from cocalib.fleet.table_export import csv_bytes

        assert self.csv is not None, "export was refused without it"
        write_whole(self.csv, csv_bytes(fleet))
        print(f"{self.csv} written", file=sys.stderr)
        return 0


def _summary(folder: Path, fleet: "FleetRecord") -> int:
    from cocalib.fleet.summary_page import write_summary

    print(f"{write_summary(folder, fleet)} written", file=sys.stderr)
    return 0


def _print_json(document: dict[str, Any]) -> None:
    import msgspec

    print_exactly(msgspec.json.format(msgspec.json.encode(document), indent=2).decode())
