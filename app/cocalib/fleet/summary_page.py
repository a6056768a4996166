"""The summary page: one static HTML file that says where every vehicle of a fleet stands."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite, sqrt
from pathlib import Path
from typing import Final

from calib_core.fleet import MountingScatter, Transition, transition
from cocalib.batch.results_folder import ResultsFolder, UnreadResult
from cocalib.fleet.kinds import Kind, kinds_of
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord
from cocalib.fleet.standing import VehicleStanding, recorded_text, standings_of
from cocalib.platform.resources import version
from cocalib.report.markup import Child, Markup, html_file, joined, scrolled, tag
from cocalib.report.plots import Axes, drawing, mark, polyline
from cocalib.report.sections.answer import LEVEL_SIGNS
from cocalib.view.wording import plain, sentence, with_sigma

SUMMARY_FILE: Final = "summary.html"

_DASH = "–"
_LONG = 20
"""Longer names may be broken into lines."""
_BAD = ("coarse", "weak", "contradictory", "nothing", "refused", "failed")
_ORDER = ("good", "usable", "coarse", "weak", "contradictory", "nothing", "refused", "failed")
_OTHER_SIGNS = {"refused": "□", "failed": "✕"}
_OUTCOMES = {"remounted": "remounted", "unchanged": "unchanged", "cannot-tell": "cannot tell"}
_WIDTH, _HEIGHT = 128.0, 27.0
_MOST_DRIFT = 2.0
"""The upper edge: a change this many times the limit, and more."""


@dataclass(frozen=True, slots=True)
class _Column:
    """A column of a table.

    Attributes:
        head: its name.
        is_number: sorted as a number.
        class_: how it is laid out, if not as what it is sorted as.
        about: what it means, shown on hover; "" if the name says it.
        sortable: whether a button sorts by it.
    """

    head: str
    is_number: bool = False
    class_: str = ""
    about: str = ""
    sortable: bool = True


_FIGURE_COLUMNS = (
    _Column("σ deg", is_number=True, about="largest standard deviation of the rotation about an axis"),
    _Column("σ cm", is_number=True, about="largest standard deviation of the position along an axis"),
    _Column("AED px", is_number=True, about="mean residual of the pairs that were used"),
)
_CHANGE_COLUMNS = (
    _Column("Δ deg", is_number=True, about="change of the rotation since the session before, ± its standard deviation"),
    _Column("Δ cm", is_number=True, about="how far the camera moved as seen from the radar, ± its standard deviation"),
    _Column("Δ px", is_number=True, about="how far the picture of a reflector in the middle of the data moved"),
    _Column("since before", about="remounted: the change exceeds both error bars"),
)
_VEHICLE_COLUMNS = (
    _Column("vehicle"),
    _Column("type"),
    _Column("last session"),
    _Column("recorded (UTC)"),
    _Column("verdict"),
    *_FIGURE_COLUMNS,
    *_CHANGE_COLUMNS,
    _Column("kind", about="whether its mounting is like that of the other vehicles of its type"),
    _Column(
        "drift since first",
        is_number=True,
        class_="drift",
        about="beyond the dashed line it exceeds both error bars",
    ),
    _Column("sessions", is_number=True),
    _Column("report", sortable=False),
)
_SESSION_COLUMNS = (
    _Column("vehicle"),
    _Column("session"),
    _Column("recorded (UTC)"),
    _Column("verdict"),
    _Column("pairs", is_number=True),
    *_FIGURE_COLUMNS,
    *_CHANGE_COLUMNS,
    _Column("report", sortable=False),
)


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
        _section("Vehicles", _vehicle_table(standings), _serials(fleet.shared_serials)),
        _section("Mounting scatter of the vehicle types", _type_table(kinds), _left_out(kinds)) if kinds else None,
        _section("Sessions", _session_table(fleet)),
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
        "both calibrations counted. Remounted, unlike its type: beyond what 9,999 of 10,000 sound calibrations show. "
        "Drift: distance from the vehicle's first session in units of its error bars; beyond the dashed line it exceeds both; "
        "a cross: remounted. Scatter: standard deviation of the camera's place and rotation as seen from the radar."
    )


@cache
def _asset(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def _vehicle_table(standings: Sequence[VehicleStanding]) -> Markup:
    """Return the table of the vehicles."""
    return _sortable("Vehicles", _VEHICLE_COLUMNS, (_vehicle(index, one) for index, one in enumerate(standings)))


def _vehicle(index: int, standing: VehicleStanding) -> Markup:
    vehicle, outcome = standing.vehicle, standing.last.outcome
    drift = _drift_of(vehicle)
    kind = None if standing.kind is None else "off" if standing.kind.is_off else "of its kind"
    far = drift.last
    return tag(
        "tr",
        tag("th", vehicle.name, scope="row"),
        _words_cell(vehicle.vehicle_type),
        _words_cell(standing.last.name),
        _words_cell(recorded_text(outcome.recorded_ns, unknown="")),
        _verdict_cell(standing.last),
        *_sigma_cells(standing.last),
        _number_cell(outcome.aed_px),
        *_change_cells(standing.change),
        _words_cell(kind, class_="state bad" if standing.off_kind else "state"),
        tag("td", _drift_plot(drift, vehicle.name), class_="drift", data_key="" if far is None else repr(far)),
        _number_cell(len(vehicle.sessions), str(len(vehicle.sessions))),
        _report_cell(standing.last),
        id=f"vehicle-{index}",
    )


def _session_table(fleet: FleetRecord) -> Markup:
    """Return the table of all sessions that count."""
    rows = []
    for vehicle in fleet.vehicles:
        for record in vehicle.sessions:
            outcome = record.outcome
            rows.append(
                tag(
                    "tr",
                    tag("th", vehicle.name, scope="row"),
                    _words_cell(record.name),
                    _words_cell(recorded_text(outcome.recorded_ns, unknown="")),
                    _verdict_cell(record),
                    _number_cell(outcome.pairs or None, str(outcome.pairs)),
                    *_sigma_cells(record),
                    _number_cell(outcome.aed_px),
                    *_change_cells(vehicle.transition_to(record.name)),
                    _report_cell(record),
                )
            )
    return _sortable("Sessions", _SESSION_COLUMNS, rows)


def _type_table(kinds: Sequence[Kind]) -> Markup:
    """Return how the mountings of each type scatter, and whom that does not rest on."""
    heads = ("type", "vehicles", "mountings", "forward cm", "left cm", "up cm", "roll deg", "pitch deg", "yaw deg")
    return scrolled(
        "Vehicle types",
        tag("thead", tag("tr", *(tag("th", head, scope="col") for head in heads))),
        tag("tbody", *(_type(kind) for kind in kinds)),
        class_="types",
    )


def _type(kind: Kind) -> Markup:
    head, count = tag("th", kind.vehicle_type, scope="row"), tag("td", str(kind.vehicles))
    if kind.sigma is None or not isinstance(kind.scatter, MountingScatter):
        return tag("tr", head, count, tag("td", kind.reason, class_="words", colspan="7"))
    mountings = tag("td", str(len(kind.scatter.mountings)))
    return tag("tr", head, count, mountings, *(tag("td", plain(one, 2)) for one in kind.sigma))


@dataclass(frozen=True, slots=True, eq=False)
class _Drift:
    """How far each session is from the first one with a pose.

    Attributes:
        changes: from the first to each later one.
        remounted: of each, whether it exceeds both error bars of the session right before it.
    """

    changes: tuple[Transition, ...]
    remounted: tuple[bool, ...]

    @property
    def last(self) -> float | None:
        """The distance of the last session in units of the limit; None with fewer than two sessions."""
        return _height(self.changes[-1]) if self.changes else None


def _drift_of(vehicle: VehicleRecord) -> _Drift:
    """Return how far a vehicle's sessions are from its first one."""
    first, *later = vehicle.compared or (None,)
    if first is None or not later:
        return _Drift((), ())
    steps = [vehicle.transition_to(one.session) for one in later if one is not None]
    changes = tuple(transition(first, one) for one in later if one is not None)
    return _Drift(changes, tuple(step is not None and step.is_remount for step in steps))


def _drift_plot(drift: _Drift, name: str) -> Markup:
    """Return the plot: one mark for each session, and a line beyond which a change exceeds both error bars.

    Args:
        drift: of the vehicle.
        name: of the vehicle.
    """
    if not drift.changes:
        return tag("span", "–")
    axes = Axes(
        0.0, float(len(drift.changes)), 0.0, _MOST_DRIFT, left=4.0, top=4.0, width=_WIDTH - 8.0, height=_HEIGHT - 7.0
    )
    heights = [0.0, *(_height(change) for change in drift.changes)]
    places = [(axes.x(index), axes.y(min(height, _MOST_DRIFT))) for index, height in enumerate(heights)]
    limit = tag("line", x1=0.0, x2=_WIDTH, y1=axes.y(1.0), y2=axes.y(1.0), class_="limit")
    return drawing(
        _said(drift, name),
        limit,
        polyline(places, class_="course"),
        _marks(places, (False, *drift.remounted)),
        width=_WIDTH,
        height=_HEIGHT,
    )


def _marks(places: Sequence[tuple[float, float]], remounted: Sequence[bool]) -> Markup:
    """Return a circle for each session, a cross where the radar was remounted."""
    pairs = zip(places, remounted, strict=True)
    return joined(mark("disagrees" if moved else "used", x, y) for (x, y), moved in pairs)


def _said(drift: _Drift, name: str) -> str:
    """Say what the plot shows."""
    last = drift.changes[-1]
    rotation = with_sigma(last.rotation_deg, last.rotation_sigma_deg)
    position = with_sigma(last.position_cm, last.position_sigma_cm)
    count = sum(drift.remounted)
    often = f"; remounted {count} time{'' if count == 1 else 's'}" if count else ""
    return f"{name}: {rotation} deg and {position} cm from {last.before.session} to {last.after.session}{often}"


def _height(change: Transition) -> float:
    return sqrt(change.squared / change.limit)


def _sortable(name: str, columns: Sequence[_Column], rows: Iterable[Markup], *, sorted_by: int = 0) -> Markup:
    """Return a table in a frame of its own that scrolls on a narrow screen.

    Args:
        name: for a screen reader.
        columns: from left to right.
        rows: its body.
        sorted_by: the column that the rows are in order of.
    """
    heads = (_head(column, is_sorted=index == sorted_by) for index, column in enumerate(columns))
    return scrolled(name, tag("thead", tag("tr", *heads)), tag("tbody", *rows), class_="sortable")


def _head(column: _Column, *, is_sorted: bool) -> Markup:
    if not column.sortable:
        return tag("th", column.head, scope="col")
    return tag(
        "th",
        tag("button", column.head, type="button", title=column.about or None),
        scope="col",
        class_=column.class_ or ("number" if column.is_number else None),
        data_kind="number" if column.is_number else None,
        aria_sort="ascending" if is_sorted else "none",
    )


def _words_cell(words: str | None, *, class_: str = "") -> Markup:
    """Return a cell of text; a dash where nothing is known."""
    class_ = class_ or ("words" if words and len(words) > _LONG else "state")
    return tag("td", words or _DASH, class_=class_, data_key=words or "")


def _number_cell(value: float | None, shown: str | None = None) -> Markup:
    """Return a cell with a number, or with what is shown for it; a dash where nothing is known."""
    if value is None or not isfinite(value):
        return tag("td", _DASH, class_="number", data_key="")
    return tag("td", shown or plain(value, 2), class_="number", data_key=repr(float(value)))


def _sigma_cells(record: SessionRecord) -> list[Markup]:
    """Return the standard deviations of the answer [deg], [cm]."""
    return [_number_cell(record.outcome.sigma_deg), _number_cell(record.outcome.sigma_cm)]


def _verdict_cell(record: SessionRecord) -> Markup:
    """Return the verdict, or why there is none, as a shape and a word."""
    outcome = record.outcome
    level = outcome.verdict if outcome.verdict in LEVEL_SIGNS else outcome.status
    sign = LEVEL_SIGNS.get(level) or _OTHER_SIGNS.get(level, "●")
    key = _ORDER.index(level) if level in _ORDER else len(_ORDER)
    parts: list[Child] = [tag("span", sign, class_="sign", aria_hidden="true"), level]
    return tag("td", *parts, class_=f"state{' bad' if level in _BAD else ''}", data_key=str(key))


def _change_cells(change: Transition | None) -> list[Markup]:
    """Return the change in deg, cm and px, and what it means."""
    if change is None:
        return [_number_cell(None), _number_cell(None), _number_cell(None), _words_cell(None)]
    return [
        _number_cell(change.rotation_deg, with_sigma(change.rotation_deg, change.rotation_sigma_deg)),
        _number_cell(change.position_cm, with_sigma(change.position_cm, change.position_sigma_cm)),
        _number_cell(change.picture_px, with_sigma(change.picture_px, change.picture_sigma_px)),
        _words_cell(_OUTCOMES[change.outcome], class_="state bad" if change.is_remount else "state"),
    ]


def _report_cell(record: SessionRecord) -> Markup:
    """Return the link to a session's report, relative to the page."""
    if record.report is None:
        return tag("td", _DASH)
    name = f"Report on {record.outcome.vehicle}, {record.name}"
    return tag("td", tag("a", "report", href=record.report, aria_label=name))
