"""Where each vehicle stands today: its last session, what changed since the one before, and whether anybody must look."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from calib_core.fleet import OffKind, Transition
from cocalib.fleet.kinds import Kind
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord

_DAY_NS = 86_400_000_000_000
_POOR = ("coarse", "weak", "contradictory", "nothing")


@dataclass(frozen=True, slots=True, eq=False)
class VehicleStanding:
    """Where one vehicle stands.

    Attributes:
        vehicle: with all its sessions.
        change: the one that ends at its last session with a pose; None for the first.
        kind: its present mounting compared with the other vehicles of its type; None where that cannot be told.
        needs: what somebody has to look at, each without a full stop; empty if all is well.
    """

    vehicle: VehicleRecord
    change: Transition | None
    kind: OffKind | None
    needs: tuple[str, ...]

    @property
    def last(self) -> SessionRecord:
        """The last session."""
        return self.vehicle.last

    @property
    def remounted(self) -> bool:
        """Whether the last change exceeds both error bars."""
        return self.change is not None and self.change.is_remount

    @property
    def off_kind(self) -> bool:
        """Whether it is unlike its type."""
        return self.kind is not None and self.kind.is_off


def standings_of(fleet: FleetRecord, kinds: Sequence[Kind]) -> tuple[VehicleStanding, ...]:
    """Return where every vehicle stands, by name.

    Args:
        fleet: all results.
        kinds: its vehicle types.
    """
    judged = {name: one for kind in kinds for name, one in kind.judged.items()}
    return tuple(_standing(vehicle, judged.get(vehicle.name)) for vehicle in fleet.vehicles)


def age_days(record: SessionRecord, now_ns: int) -> float | None:
    """Return how long ago a session was recorded [days]; None if its time is not known."""
    recorded = record.outcome.recorded_ns
    return None if recorded is None else (now_ns - recorded) / _DAY_NS


def recorded_text(recorded_ns: int | None, *, unknown: str = "–") -> str:
    """Write when a recording began, in UTC, to the minute.

    Args:
        recorded_ns: its first stamp [ns]; None if that is not known.
        unknown: what to write then.
    """
    if recorded_ns is None:
        return unknown
    try:
        return f"{datetime.fromtimestamp(recorded_ns // 1_000_000_000, UTC):%Y-%m-%d %H:%M}"
    except (OverflowError, ValueError, OSError):  # a stamp that no calendar has
        return unknown


def _standing(vehicle: VehicleRecord, kind: OffKind | None) -> VehicleStanding:
    compared = vehicle.compared
    change = vehicle.transition_to(compared[-1].session) if compared else None
    needs = [*_needs_of_session(vehicle.last)]
    if change is not None and change.is_remount:
        needs.append(change.words)
    if kind is not None and kind.is_off:
        needs.append(f"{kind.words.removeprefix(vehicle.name).strip()}; {kind.hint}")
    return VehicleStanding(vehicle, change, kind, tuple(needs))


def _needs_of_session(record: SessionRecord) -> list[str]:
    """Return what is wrong with the last session itself."""
    outcome = record.outcome
    if outcome.status != "solved" or outcome.verdict in _POOR:
        poor = outcome.verdict if outcome.status in ("solved", "weak") and outcome.verdict else outcome.status
        why = "; ".join(filter(None, (outcome.reason, outcome.hint))) or "see its report"
        return [f"{outcome.session} is {poor}: {why}" if poor in _POOR else f"{outcome.session} {_said(poor)}: {why}"]
    return [f"{outcome.session} has no pose to compare: {record.pose_problem}"] if record.pose_problem else []


def _said(status: str) -> str:
    return "was refused" if status == "refused" else status
