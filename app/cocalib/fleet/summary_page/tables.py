"""The tables of the summary page: vehicles, types, sessions."""

from collections.abc import Sequence

from calib_core.fleet import MountingScatter
from cocalib.fleet.kinds import Kind
from cocalib.fleet.records import FleetRecord
from cocalib.fleet.standing import VehicleStanding, recorded_text
from cocalib.fleet.summary_page.cells import (
    Column,
    change_cells,
    number_cell,
    report_cell,
    sigma_cells,
    sortable,
    verdict_cell,
    words_cell,
)
from cocalib.fleet.summary_page.drift import drift_of, drift_plot
from cocalib.report.markup import Markup, scrolled, tag
from cocalib.view.wording import plain

_FIGURES = (
    Column("σ deg", is_number=True, about="largest standard deviation of the rotation about an axis"),
    Column("σ cm", is_number=True, about="largest standard deviation of the position along an axis"),
    Column("AED px", is_number=True, about="mean residual of the pairs that were used"),
)
_CHANGE = (
    Column("Δ deg", is_number=True, about="change of the rotation since the session before, ± its standard deviation"),
    Column("Δ cm", is_number=True, about="how far the camera moved as seen from the radar, ± its standard deviation"),
    Column("Δ px", is_number=True, about="how far the picture of a reflector in the middle of the data moved"),
    Column("since before", about="remounted: the change exceeds both error bars"),
)
_VEHICLES = (
    Column("vehicle"),
    Column("type"),
    Column("last session"),
    Column("recorded (UTC)"),
    Column("verdict"),
    *_FIGURES,
    *_CHANGE,
    Column("kind", about="whether its mounting is like that of the other vehicles of its type"),
    Column(
        "drift since first",
        is_number=True,
        class_="drift",
        about="beyond the dashed line it exceeds both error bars",
    ),
    Column("sessions", is_number=True),
    Column("report", sortable=False),
)
_SESSIONS = (
    Column("vehicle"),
    Column("session"),
    Column("recorded (UTC)"),
    Column("verdict"),
    Column("pairs", is_number=True),
    *_FIGURES,
    *_CHANGE,
    Column("report", sortable=False),
)


def vehicle_table(standings: Sequence[VehicleStanding]) -> Markup:
    """Return the table of the vehicles."""
    return sortable("Vehicles", _VEHICLES, (_vehicle(index, one) for index, one in enumerate(standings)))


def _vehicle(index: int, standing: VehicleStanding) -> Markup:
    vehicle, outcome = standing.vehicle, standing.last.outcome
    drift = drift_of(vehicle)
    kind = None if standing.kind is None else "off" if standing.kind.is_off else "of its kind"
    far = drift.last
    return tag(
        "tr",
        tag("th", vehicle.name, scope="row"),
        words_cell(vehicle.vehicle_type),
        words_cell(standing.last.name),
        words_cell(recorded_text(outcome.recorded_ns, unknown="")),
        verdict_cell(standing.last),
        *sigma_cells(standing.last),
        number_cell(outcome.aed_px),
        *change_cells(standing.change),
        words_cell(kind, class_="state bad" if standing.off_kind else "state"),
        tag("td", drift_plot(drift, vehicle.name), class_="drift", data_key="" if far is None else repr(far)),
        number_cell(len(vehicle.sessions), str(len(vehicle.sessions))),
        report_cell(standing.last),
        id=f"vehicle-{index}",
    )


def session_table(fleet: FleetRecord) -> Markup:
    """Return the table of all sessions that count."""
    rows = []
    for vehicle in fleet.vehicles:
        for record in vehicle.sessions:
            outcome = record.outcome
            rows.append(
                tag(
                    "tr",
                    tag("th", vehicle.name, scope="row"),
                    words_cell(record.name),
                    words_cell(recorded_text(outcome.recorded_ns, unknown="")),
                    verdict_cell(record),
                    number_cell(outcome.pairs or None, str(outcome.pairs)),
                    *sigma_cells(record),
                    number_cell(outcome.aed_px),
                    *change_cells(vehicle.transition_to(record.name)),
                    report_cell(record),
                )
            )
    return sortable("Sessions", _SESSIONS, rows)


def type_table(kinds: Sequence[Kind]) -> Markup:
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
