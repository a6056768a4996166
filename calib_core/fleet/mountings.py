"""The mountings of a vehicle: its sessions in order of time, parted where the radar was remounted, and averaged in between."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from calib_core.arrays import Matrix66, frozen_array
from calib_core.fleet.session_pose import SessionPose
from calib_core.fleet.transitions import RelevantChange, Transition, transition
from calib_core.geometry import RigidTransform
from calib_core.options import CameraPositionPrior

_OF_PAIRS = 1e-6  # least share of a covariance that counts as the scatter of the pairs
_ROUNDS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """What all sessions of one mounting say together.

    Attributes:
        vehicle: its name.
        sessions: names of the sessions, in order of time.
        camera_from_radar: their weighted mean.
        covariance: (6, 6) of its error (dt, dtheta) [m, rad]; what is systematic is not averaged out.
        freedom: degrees of freedom of the noise levels: the fewest of the sessions.
        radar_serial: of the radar; None if unknown.
        camera_serial: of the camera; None if unknown.
        measured: the camera positions that its sessions were given as measured with a tape, each once.
        stated: (6, 6) the part of the covariance that rests on stated sigmas, of shared errors and of the tape, and not on how
            pairs scatter; zeros if none does.
    """

    vehicle: str
    sessions: tuple[str, ...]
    camera_from_radar: RigidTransform
    covariance: Matrix66
    freedom: float
    radar_serial: str | None = None
    camera_serial: str | None = None
    measured: tuple[CameraPositionPrior, ...] = ()
    stated: Matrix66 = field(default_factory=lambda: np.zeros((6, 6)))

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))
        object.__setattr__(self, "stated", frozen_array(self.stated, (6, 6)))


def transitions_of(
    sessions: Iterable[SessionPose], *, relevant: RelevantChange | None = None
) -> tuple[Transition, ...]:
    """Return each vehicle's transitions from session to session, vehicles by name, sessions in order of time.

    Args:
        sessions: of any number of vehicles, in any order; sessions without a time come first, by name.
        relevant: the change that must not stay unseen.
    """
    return tuple(
        transition(before, after, relevant=relevant) for row in _by_vehicle(sessions) for before, after in pairwise(row)
    )


def mountings_of(sessions: Iterable[SessionPose]) -> tuple[Mounting, ...]:
    """Return the mountings, vehicles by name: a new one begins at a remount, and with another radar or camera.

    Args:
        sessions: of any number of vehicles, in any order.
    """
    found = []
    for row in _by_vehicle(sessions):
        together = [row[0]]
        for after in row[1:]:
            step = transition(together[-1], after)
            if step.is_remount or step.other_sensors:
                found.append(mounting_of(together))
                together = []
            together.append(after)
        found.append(mounting_of(together))
    return tuple(found)


def mounting_of(sessions: Sequence[SessionPose]) -> Mounting:
    """Average the sessions of one mounting.

    Each weighs as its covariance says. The scatter of the pairs averages out; errors that pairs share are taken to be the same
    in all sessions, and so is that of a camera position that several of them state to the last digit: it was measured once.

    Args:
        sessions: at least one, of one vehicle with one mounting.
    """
    pose = sessions[0].camera_from_radar
    information = np.linalg.inv([one.covariance for one in sessions])
    gains = np.linalg.inv(information.sum(axis=0)) @ information
    for _ in range(_ROUNDS):
        errors = np.array([one.camera_from_radar.error_from(pose) for one in sessions])
        pose = pose.perturbed(np.einsum("nij,nj->i", gains, errors))
    own = np.array([one.covariance - (1.0 - _OF_PAIRS) * (one.systematic + one.of_tape) for one in sessions])
    averaged = (gains @ own @ gains.swapaxes(1, 2)).sum(axis=0)
    stated = (1.0 - _OF_PAIRS) * sum(
        (_common(gains[rows], [part[k] for k in rows]) for part, rows in _common_errors(sessions)), np.zeros((6, 6))
    )
    covariance = averaged + stated
    return Mounting(
        vehicle=sessions[0].vehicle,
        sessions=tuple(one.session for one in sessions),
        camera_from_radar=pose,
        covariance=(covariance + covariance.T) / 2.0,
        freedom=min(one.freedom for one in sessions),
        radar_serial=sessions[-1].radar_serial,
        camera_serial=sessions[-1].camera_serial,
        measured=tuple(dict.fromkeys(one.measured for one in sessions if one.measured is not None)),
        stated=(stated + stated.T) / 2.0,
    )


def _common_errors(sessions: Sequence[SessionPose]) -> Iterator[tuple[list[Matrix66], list[int]]]:
    """Yield which part (6, 6) of every session's covariance comes from one and the same error, and the sessions that have it."""
    yield [one.systematic for one in sessions], list(range(len(sessions)))
    measured: dict[tuple[float, ...] | int, list[int]] = {}
    for k, one in enumerate(sessions):
        measured.setdefault(k if one.measured is None else one.measured.position_m, []).append(k)
    of_tape = [one.of_tape for one in sessions]
    yield from ((of_tape, rows) for rows in measured.values())


def _common(gains: np.ndarray, parts: Sequence[Matrix66]) -> Matrix66:
    """Return what an error that several sessions have in common leaves in their mean, weighed with gains (n, 6, 6)."""
    root = np.sum([gain @ _root(part) for gain, part in zip(gains, parts, strict=True)], axis=0)
    return np.asarray(root @ root.T)


def _by_vehicle(sessions: Iterable[SessionPose]) -> list[list[SessionPose]]:
    rows: dict[str, list[SessionPose]] = {}
    for one in sorted(sessions, key=lambda one: (one.vehicle, one.time_ns is not None, one.time_ns or 0, one.session)):
        rows.setdefault(one.vehicle, []).append(one)
    return list(rows.values())


def _root(matrix: np.ndarray) -> np.ndarray:
    """Return the symmetric root of a positive semi-definite matrix; rounding below zero is zero."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
