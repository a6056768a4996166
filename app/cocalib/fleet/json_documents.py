"""What `cocalib batch status --json` prints: status, history and comparison as values for other programs."""

import math
from collections.abc import Sequence
from typing import Any, Final

from calib_core.fleet import MountingScatter, OffKind, SessionPose, Transition
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from cocalib.batch.results_folder import UnreadResult
from cocalib.fleet.choosing import ComparedSessions
from cocalib.fleet.kinds import Kind, NotCounted
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord
from cocalib.fleet.standing import VehicleStanding, age_days

STATUS_SCHEMA: Final = "cocalib/fleet-status-1"
HISTORY_SCHEMA: Final = "cocalib/fleet-history-1"
COMPARISON_SCHEMA: Final = "cocalib/fleet-comparison-1"
_COORDINATES = ("forward_cm", "left_cm", "up_cm", "roll_deg", "pitch_deg", "yaw_deg")


def status_document(
    fleet: FleetRecord, standings: Sequence[VehicleStanding], kinds: Sequence[Kind], *, now_ns: int
) -> dict[str, Any]:
    """Return where every vehicle and every type stands.

    Args:
        fleet: all results.
        standings: of its vehicles.
        kinds: of its types.
        now_ns: the time that ages count to [ns].
    """
    return {
        "schema": STATUS_SCHEMA,
        "vehicles": [_standing(one, now_ns) for one in standings],
        "types": [_kind(one) for one in kinds],
        "unread": [_unread(one) for one in fleet.unread],
        "missing": [list(one) for one in fleet.missing],
        "unlisted": [list(one) for one in fleet.unlisted],
        "shared_serials": list(fleet.shared_serials),
    }


def history_document(vehicle: VehicleRecord, superseded: Sequence[SessionRecord]) -> dict[str, Any]:
    """Return the sessions and transitions of a vehicle.

    Args:
        vehicle: its latest results.
        superseded: its results that later runs replaced.
    """
    return {
        "schema": HISTORY_SCHEMA,
        "vehicle": vehicle.name,
        "vehicle_type": vehicle.vehicle_type,
        "sessions": [_session(one) for one in vehicle.sessions],
        "transitions": [_transition(one) for one in vehicle.transitions],
        "superseded": [_session(one) for one in superseded],
    }


def comparison_document(compared: ComparedSessions) -> dict[str, Any]:
    """Return how two sessions differ."""
    return {
        "schema": COMPARISON_SCHEMA,
        "a": _compared(compared.a),
        "b": _compared(compared.b),
        **_change(compared.change),
        "outcome": compared.outcome,
        "words": compared.words,
    }


def _compared(pose: SessionPose) -> dict[str, Any]:
    return {"vehicle": pose.vehicle, "session": pose.session}


def _standing(standing: VehicleStanding, now_ns: int) -> dict[str, Any]:
    vehicle, age = standing.vehicle, age_days(standing.last, now_ns)
    return {
        "vehicle": vehicle.name,
        "vehicle_type": vehicle.vehicle_type,
        "sessions": len(vehicle.sessions),
        "last": _session(standing.last),
        "age_days": None if age is None else round(age, 3),
        "change": None if standing.change is None else _transition(standing.change),
        "remounted": standing.remounted,
        "off_kind": None if standing.kind is None else _off_kind(standing.kind),
        "needs": list(standing.needs),
    }


def _session(record: SessionRecord) -> dict[str, Any]:
    outcome = record.outcome
    return {
        "session": outcome.session,
        "digest": outcome.digest,
        "status": outcome.status,
        "reason": outcome.reason,
        "hint": outcome.hint,
        "verdict": outcome.verdict,
        "recorded_ns": None if outcome.recorded_ns is None else str(outcome.recorded_ns),
        "radar_serial": outcome.radar_serial,
        "camera_serial": outcome.camera_serial,
        "sigma_deg": outcome.sigma_deg,
        "sigma_cm": outcome.sigma_cm,
        "aed_px": outcome.aed_px,
        "pairs": outcome.pairs,
        "report": record.report,
        "camera_from_radar": None if record.pose is None else _transform(record.pose.camera_from_radar),
        "covariance": None if record.pose is None else record.pose.covariance.tolist(),
        "pose_problem": record.pose_problem or None,
    }


def _transform(camera_from_radar: RigidTransform) -> dict[str, Any]:
    return {
        "rotation_wxyz": quaternion_wxyz_from_matrix(camera_from_radar.rotation).tolist(),
        "translation_m": camera_from_radar.translation_m.tolist(),
    }


def _transition(change: Transition) -> dict[str, Any]:
    return {
        "before": change.before.session,
        "after": change.after.session,
        **_change(change),
        "outcome": change.outcome,
        "words": change.words,
    }


def _change(change: Transition) -> dict[str, Any]:
    return {
        "rotation_deg": change.rotation_deg,
        "rotation_sigma_deg": _known(change.rotation_sigma_deg),
        "position_cm": change.position_cm,
        "position_sigma_cm": _known(change.position_sigma_cm),
        "picture_px": _known(change.picture_px),
        "picture_sigma_px": _known(change.picture_sigma_px),
        "change": change.change.tolist(),
        "covariance": change.covariance.tolist(),
        "squared_distance": change.squared,
        "limit": change.limit,
        "resolved_deg": change.resolved_deg,
        "resolved_cm": change.resolved_cm,
    }


def _off_kind(found: OffKind) -> dict[str, Any]:
    away = found.deviation
    return {
        "is_off": found.is_off,
        "squared_distance": away.squared,
        "limit": away.limit,
        "others": found.others,
        "words": found.words,
    }


def _kind(kind: Kind) -> dict[str, Any]:
    return {
        "vehicle_type": kind.vehicle_type,
        "vehicles": kind.vehicles,
        "mountings": len(kind.scatter.mountings) if isinstance(kind.scatter, MountingScatter) else None,
        "sigma": None if kind.sigma is None else dict(zip(_COORDINATES, kind.sigma, strict=True)),
        "reason": kind.reason or None,
        "shared_tape": kind.shared_tape or None,
        "not_counted": _not_counted(kind.not_counted),
    }


def _not_counted(rows: Sequence[NotCounted]) -> list[dict[str, str]]:
    return [{"vehicle": one.vehicle, "session": one.session, "reason": one.reason} for one in rows]


def _unread(result: UnreadResult) -> dict[str, str]:
    return {"place": result.place, "reason": result.reason}


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
