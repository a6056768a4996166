"""The summary page as one file: head figures, what needs a look, vehicles, types, sessions."""

from collections import Counter
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Final

from cocalib.batch.results_folder import ResultsFolder
from cocalib.fleet.kinds import Kind, kinds_of
from cocalib.fleet.records import FleetRecord, UnreadResult
from cocalib.fleet.standing import VehicleStanding, standings_of
from cocalib.fleet.summary_page.tables import session_table, type_table, vehicle_table
from cocalib.platform.resources import version
from cocalib.report.html_file import html_file
from cocalib.report.markup import Child, Markup, tag
from cocalib.view.wording import sentence

SUMMARY_FILE: Final = "summary.html"


def write_summary(folder: Path, fleet: FleetRecord) -> Path:
    """Write the page next to the results; a reader finds the old one or the new one. Return where it is.

    Args:
        folder: holds the results.
        fleet: what they say.

    Raises:
        CalibrationError: what has its name is not a regular file.
        OSError: it cannot be written.
    """
    ResultsFolder(folder).write(SUMMARY_FILE, data=summary_html(fleet).encode())
    return folder / SUMMARY_FILE


def summary_html(fleet: FleetRecord) -> str:
    """Return the page, the same bytes for the same results; links are relative to the folder that holds results/."""
    kinds = kinds_of(fleet)
    standings = standings_of(fleet, kinds)
    body = tag(
        "body",
        tag("header", tag("h1", "Radar-camera calibration of a fleet"), tag("p", _what(fleet))),
        tag("main", _tiles(fleet, standings), *_sections(fleet, standings, kinds)),
        tag("footer", _foot()),
    )
    return html_file("Fleet calibration", body, style=_asset("summary.css"), script=_asset("summary.js"))


def _sections(fleet: FleetRecord, standings: Sequence[VehicleStanding], kinds: Sequence[Kind]) -> list[Child]:
    if not standings:
        return [tag("p", "There are no results yet.", class_="note"), _unread(fleet.unread)]
    return [
        _look(standings),
        _unread(fleet.unread),
        _missing(fleet.missing),
        _section("Vehicles", vehicle_table(standings), _serials(fleet.shared_serials)),
        _section("Mounting scatter of the vehicle types", type_table(kinds), _left_out(kinds)) if kinds else None,
        _section("Sessions", session_table(fleet)),
    ]


def _tiles(fleet: FleetRecord, standings: Sequence[VehicleStanding]) -> Markup:
    """Return the head figures; those that are bad news stand out, unless there is none."""
    counts = Counter(record.outcome.status for vehicle in fleet.vehicles for record in vehicle.sessions)
    figures = [
        (len(fleet.vehicles), "vehicle", "", False),
        (counts.total(), "session", "", False),
        (counts["solved"], "solved", None, False),
        (counts["weak"], "weak", None, True),
        (counts["refused"], "refused", None, True),
        (counts["failed"], "failed", None, True),
        (sum(one.remounted for one in standings), "remounted", None, True),
        (sum(one.off_kind for one in standings), "off their kind", None, True),
    ]
    return tag("ul", *(_tile(count, name, plural, is_bad=bad) for count, name, plural, bad in figures), class_="tiles")


def _tile(count: int, name: str, plural: str | None, *, is_bad: bool) -> Markup:
    words = name if plural is None or count == 1 else f"{name}s"
    return tag("li", tag("b", str(count)), words, class_="none" if is_bad and not count else "bad" if is_bad else None)


def _look(standings: Sequence[VehicleStanding]) -> Markup:
    """Return the vehicles that somebody has to look at, with the reasons."""
    items = [
        tag(
            "li",
            tag("a", one.vehicle.name, href=f"#vehicle-{index}"),
            *(tag("p", f"{reason}.") for reason in one.needs),
        )
        for index, one in enumerate(standings)
        if one.needs
    ]
    if not items:
        return _section(
            "Needs a look", tag("p", "Nothing: every vehicle's last session can be relied on.", class_="note")
        )
    return _section("Needs a look", tag("ul", *items, class_="look"))


def _unread(unread: Sequence[UnreadResult]) -> Markup | None:
    """Return the results that cannot be read, and what to do about them."""
    if not unread:
        return None
    items = (tag("li", tag("code", one.place), tag("p", sentence(one.reason))) for one in unread)
    return _section("Results that cannot be read", tag("ul", *items, class_="look"))


def _missing(missing: Sequence[tuple[str, str]]) -> Markup | None:
    """Return the sessions of the manifests that have no result."""
    if not missing:
        return None
    items = (tag("li", f"{vehicle} / {session}") for vehicle, session in missing)
    return _section("Sessions without a result: run the batch again", tag("ul", *items, class_="look"))


def _serials(shared: Sequence[str]) -> Markup | None:
    """Return the serials that several vehicles state."""
    return tag("ul", *(tag("li", sentence(one)) for one in shared), class_="look note") if shared else None


def _left_out(kinds: Sequence[Kind]) -> Markup | None:
    """Return what the scatters do not rest on."""
    taped = [tag("li", f"{kind.vehicle_type}: {kind.shared_tape}.") for kind in kinds if kind.shared_tape]
    rows = [(kind, one) for kind in kinds for one in kind.not_counted if kind.sigma is not None]
    if not (rows or taped):
        return None
    items = (
        tag("li", f"{one.vehicle} ({one.session}) is not counted in {kind.vehicle_type}: {one.reason}.")
        for kind, one in rows
    )
    return tag("ul", *taped, *items, class_="look note")


def _section(heading: str, *children: Child) -> Markup:
    return tag("section", tag("h2", heading), *children)


def _what(fleet: FleetRecord) -> str:
    """Say of when and of what it is: the same results give the same words."""
    runs = [one.outcome.run.started for vehicle in fleet.vehicles for one in vehicle.sessions if one.outcome.run]
    count = len(fleet.superseded)
    parts = (
        ", ".join(fleet.manifests),
        f"last run {max(runs)[:16].replace('T', ' ')} UTC" if runs else "",
        f"cocalib {version()}",
        f"{count} older result{'' if count == 1 else 's'} superseded" if count else "",
    )
    return "; ".join(part for part in parts if part)


def _foot() -> str:
    return (
        "σ: largest standard deviation about or along an axis. Δ: change since the session before, ± its standard deviation, "
        "both calibrations counted. Remounted, off its kind: beyond what 9,999 of 10,000 sound calibrations show. "
        "Drift: distance from the vehicle's first session in units of its error bars; beyond the dashed line it exceeds both; "
        "a cross: remounted. Scatter: standard deviation of the camera's place and rotation as seen from the radar."
    )


@cache
def _asset(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")
