"""What `cocalib batch status` and its like prints for people: tables with one line for each vehicle, session or type."""

from collections.abc import Iterator, Sequence

from calib_core.fleet import Transition
from cocalib.fleet.kinds import Kind
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord
from cocalib.fleet.standing import VehicleStanding, age_days, recorded_text
from cocalib.view.wording import plain, with_sigma

_DASH = "–"
_LONGEST = 32
_MOST_NAMED = 10
_WORDS = {"remounted": "REMOUNTED", "unchanged": "unchanged", "cannot-tell": "cannot tell"}


def status_lines(standings: Sequence[VehicleStanding], *, now_ns: int, troubled: bool = False) -> Iterator[str]:
    """Return a line for each vehicle, and what somebody has to look at.

    Args:
        standings: of all vehicles.
        now_ns: the time that ages count to [ns].
        troubled: there are results that cannot be read, or are missing.
    """
    heads = (
        "vehicle",
        "last session",
        "age d",
        "verdict",
        "sigma deg",
        "sigma cm",
        "change deg",
        "change cm",
        "since",
        "kind",
    )
    yield from _table(heads, [_standing_cells(one, now_ns) for one in standings])
    needing = [one for one in standings if one.needs]
    if not needing:
        yield f"{_vehicles(len(standings))}, nothing to look at{' in what could be read' if troubled else ''}"
        return
    yield ""
    yield f"{len(needing)} of {_vehicles(len(standings))} to look at:"
    for one in needing:
        yield from (f"  {one.vehicle.name}: {reason}" for reason in one.needs)


def plan_lines(fleet: FleetRecord) -> Iterator[str]:
    """Return which sessions of the manifests have no result, which results no manifest names, and serials that cannot be."""
    for names, words in (
        (fleet.missing, "in the manifest without a result: run the batch again"),
        (
            fleet.unlisted,
            "with a result in no manifest any more; history --json has the names of their folders in results/",
        ),
    ):
        if names:
            shown = ", ".join(f"{vehicle}/{session}" for vehicle, session in names[:_MOST_NAMED])
            more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
            yield f"{len(names)} session{'' if len(names) == 1 else 's'} {words}: {shown}{more}"
    yield from fleet.shared_serials


def kind_lines(kinds: Sequence[Kind]) -> Iterator[str]:
    """Return how the mountings of each type scatter."""
    for kind in kinds:
        count = _vehicles(kind.vehicles)
        if kind.sigma is None:
            yield f"type {kind.vehicle_type}, {count}: {kind.reason}"
            continue
        forward, left, up, roll, pitch, yaw = (plain(one, 2) for one in kind.sigma)
        yield (
            f"type {kind.vehicle_type}, {count}: mountings scatter by {forward}, {left}, {up} cm (forward, left, up) "
            f"and {roll}, {pitch}, {yaw} deg (roll, pitch, yaw)"
        )
        if kind.shared_tape:
            yield f"  {kind.shared_tape}"


def history_lines(vehicle: VehicleRecord, superseded: Sequence[SessionRecord]) -> Iterator[str]:
    """Return the sessions of a vehicle and what changed from one to the next."""
    heads = ("session", "recorded", "verdict", "sigma deg", "sigma cm", "change deg", "change cm", "change px", "since")
    yield from _table(heads, [_session_cells(one, vehicle.transition_to(one.name)) for one in vehicle.sessions])
    for record in vehicle.sessions:
        for reason in filter(None, (record.outcome.reason, record.pose_problem)):
            yield f"  {record.name}: {reason}"
    yield from (f"  {change.words}" for change in vehicle.transitions)
    if superseded:
        yield f"  superseded by later runs: {', '.join(f'{one.name} ({one.outcome.digest})' for one in superseded)}"


def _standing_cells(standing: VehicleStanding, now_ns: int) -> tuple[str, ...]:
    outcome, change = standing.last.outcome, standing.change
    age = age_days(standing.last, now_ns)
    kind = _DASH if standing.kind is None else "OFF" if standing.kind.is_off else "ok"
    return (
        standing.vehicle.name,
        outcome.session,
        _DASH if age is None else f"{age:.0f}",
        _verdict(standing.last),
        *_sigma_cells(standing.last),
        *_change_cells(change)[:2],
        _since(change),
        kind,
    )


def _session_cells(record: SessionRecord, change: Transition | None) -> tuple[str, ...]:
    outcome = record.outcome
    return (
        outcome.session,
        recorded_text(outcome.recorded_ns),
        _verdict(record),
        *_sigma_cells(record),
        *_change_cells(change),
        _since(change),
    )


def _verdict(record: SessionRecord) -> str:
    return record.outcome.verdict or record.outcome.status


def _sigma_cells(record: SessionRecord) -> tuple[str, str]:
    """Return the standard deviations of the answer [deg], [cm]."""
    return _number(record.outcome.sigma_deg), _number(record.outcome.sigma_cm)


def _change_cells(change: Transition | None) -> tuple[str, str, str]:
    if change is None:
        return _DASH, _DASH, _DASH
    return (
        with_sigma(change.rotation_deg, change.rotation_sigma_deg),
        with_sigma(change.position_cm, change.position_sigma_cm),
        with_sigma(change.picture_px, change.picture_sigma_px),
    )


def _since(change: Transition | None) -> str:
    return _DASH if change is None else f"{change.before.session}: {_WORDS[change.outcome]}"


def _vehicles(count: int) -> str:
    return f"{count} vehicle{'' if count == 1 else 's'}"


def _number(value: float | None) -> str:
    return _DASH if value is None else plain(value, 2)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    rows = [[text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…" for text in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    for row in (heads, *rows):
        yield "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip()
