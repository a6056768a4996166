"""Poses and transitions as rows of the index, and back without a digit lost."""

import json
import math
import sqlite3

import msgspec
import numpy as np

from calib_core.camera import Camera
from calib_core.fleet import SessionPose, Transition
from calib_core.geometry import RigidTransform
from calib_core.interchange import camera_content, read_camera
from calib_core.measurements import TimeNs
from calib_core.options import CameraPositionPrior
from calib_core.systematic_errors import SystematicErrorResult
from cocalib.batch.outcome import Outcome

_FIGURES = (
    *("rotation_deg", "rotation_sigma_deg", "position_cm", "position_sigma_cm", "picture_px", "picture_sigma_px"),
    *("squared", "resolved_deg", "resolved_cm"),
)


def insert_pose(connection: sqlite3.Connection, digest: str, pose: SessionPose) -> None:
    """Write the pose of a result."""
    place = pose.reference_radar_m
    connection.execute(
        "INSERT INTO poses VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (
            digest,
            _text(pose.camera_from_radar.rotation),
            _text(pose.camera_from_radar.translation_m),
            _text(pose.covariance),
            _text(pose.systematic),
            pose.quantile,
            None if place is None else _text(place),
            None if pose.camera is None else camera_content(pose.camera, "json"),
            msgspec.json.encode(pose.angle_scales).decode(),
            None if pose.measured is None else msgspec.json.encode(pose.measured).decode(),
            _text(pose.of_tape),
        ),
    )


def pose_of(row: sqlite3.Row, outcome: Outcome) -> SessionPose:
    """Return a pose from its row.

    Raises:
        InputError: the row was changed.
    """
    place = row["reference_radar_m"]
    return SessionPose(
        vehicle=outcome.vehicle,
        session=outcome.session,
        camera_from_radar=RigidTransform(_array(row["rotation"]), _array(row["translation_m"])),
        covariance=_array(row["covariance"]),
        systematic=_array(row["systematic"]),
        quantile=row["quantile"],
        time_ns=None if outcome.recorded_ns is None else TimeNs(outcome.recorded_ns),
        radar_serial=outcome.radar_serial,
        camera_serial=outcome.camera_serial,
        camera=_camera(row["camera"]),
        reference_radar_m=None if place is None else _array(place),
        angle_scales=msgspec.json.decode(row["angle_scales"], type=tuple[SystematicErrorResult, ...]),
        measured=None if row["measured"] is None else msgspec.json.decode(row["measured"], type=CameraPositionPrior),
        of_tape=_array(row["of_tape"]),
    )


def insert_transition(connection: sqlite3.Connection, before: str, after: str, step: Transition) -> None:
    """Write the change from one result to the next, by their digests."""
    row = {name: _finite(getattr(step, name)) for name in _FIGURES} | {
        "before": before,
        "after": after,
        "outcome": step.outcome,
        "squared_limit": step.limit,
        "change": _text(step.change),
        "covariance": _text(step.covariance),
        "words": step.words,
    }
    named = ", ".join(f":{name}" for name in row)
    connection.execute(f"INSERT INTO transitions ({', '.join(row)}) VALUES ({named})", row)


def transition_of(row: sqlite3.Row, before: SessionPose, after: SessionPose) -> Transition:
    """Return a transition from its row and its two poses."""
    figures = {name: math.nan if row[name] is None else row[name] for name in _FIGURES}
    return Transition(
        before=before,
        after=after,
        change=_array(row["change"]),
        covariance=_array(row["covariance"]),
        limit=row["squared_limit"],
        outcome=row["outcome"],
        words=row["words"],
        **figures,
    )


def _camera(text: str | None) -> Camera | None:
    return None if text is None else read_camera(text, source="the index: camera")


def _text(array: np.ndarray) -> str:
    return json.dumps(array.tolist())


def _array(text: str) -> np.ndarray:
    return np.array(json.loads(text), dtype=np.float64)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
