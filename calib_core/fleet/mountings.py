"""What changed between two sessions of one vehicle, and its mountings: sessions parted where the radar was remounted."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array
from calib_core.fleet.deviation import FALSE_RATE, quantile
from calib_core.fleet.session_pose import SessionPose
from calib_core.geometry import PoseDifference, RigidTransform, camera_position_jacobian, pose_difference
from calib_core.options import CameraPositionPrior

Outcome: TypeAlias = Literal["remounted", "unchanged", "cannot-tell"]
_95 = 0.95
_OF_PAIRS = 1e-6  # least share of a covariance that counts as the scatter of the pairs
_ROUNDS = 3


@dataclass(frozen=True, slots=True)
class RelevantChange:
    """The smallest change that must not stay unseen: error bars of 95 % wider than this cannot rule it out.

    Attributes:
        deg: of the rotation, about any axis.
        cm: of the camera position, along any axis.
    """

    deg: float = 0.5
    cm: float = 5.0


@dataclass(frozen=True, slots=True, eq=False)
class Transition:
    """The change from one session of a vehicle to a later one.

    Attributes:
        before: the earlier session.
        after: the later one.
        change: (6,) (dt, dtheta) [m, rad] from the earlier pose to the later one.
        covariance: (6, 6) of the change: both calibrations' covariances added.
        rotation_deg: angle of the change.
        rotation_sigma_deg: its standard deviation about its own axis.
        position_cm: how far the camera position moved in the radar frame.
        position_sigma_cm: its standard deviation along its own direction.
        picture_px: how far the reprojection of the reference position moved; NaN if unknown.
        picture_sigma_px: its standard deviation along its own direction; NaN if unknown.
        squared: squared Mahalanobis distance of the change.
        limit: what it is below in all but 1 of 10,000 unchanged cases.
        resolved_deg: half width of the widest 95 % error bar of the rotation: a smaller change cannot be ruled out.
        resolved_cm: the same of the camera position.
        outcome: "remounted" beyond the limit; "unchanged" if the change is within its 95 % error bars, and these are narrower
            than the change that matters; else "cannot-tell".
        words: the outcome with its figures, without a full stop.
    """

    before: SessionPose
    after: SessionPose
    change: Values
    covariance: Matrix66
    rotation_deg: float
    rotation_sigma_deg: float
    position_cm: float
    position_sigma_cm: float
    picture_px: float
    picture_sigma_px: float
    squared: float
    limit: float
    resolved_deg: float
    resolved_cm: float
    outcome: Outcome
    words: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "change", frozen_array(self.change, (6,)))
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))

    @property
    def is_remount(self) -> bool:
        """Whether the change exceeds both error bars."""
        return self.outcome == "remounted"

    @property
    def is_unchanged(self) -> bool:
        """Whether any change that matters is ruled out."""
        return self.outcome == "unchanged"

    @property
    def other_sensors(self) -> bool:
        """Whether a serial of radar or camera is known to be another one."""
        return bool(_replaced(self.before, self.after))


def transition(before: SessionPose, after: SessionPose, *, relevant: RelevantChange | None = None) -> Transition:
    """Compare two sessions of one vehicle.

    The two covariances are added as if the sessions were independent. What the same sensors get wrong in both cancels in part, by
    how much depends on where the placements were: it is counted in full, so the test is on the safe side and names fewer small
    remounts. The limit is the 1-in-10,000 point for the smaller of the two numbers of degrees of freedom, so that the
    wide tails of a noise level estimated from few pairs are no remount.

    Args:
        before: the earlier session.
        after: the later one.
        relevant: the change that must not stay unseen.
    """
    matters = relevant or RelevantChange()
    covariance = before.covariance + after.covariance
    difference = pose_difference(before.camera_from_radar, after.camera_from_radar, covariance)
    freedom = min(before.freedom, after.freedom)
    limit, usual = quantile(1.0 - FALSE_RATE, freedom), quantile(_95, freedom)
    jacobian = camera_position_jacobian(before.camera_from_radar)
    along_one_axis = np.sqrt(usual / quantile(_95, 1e7) * 3.841458820694124)  # 95 % of one dimension
    resolved_deg = float(np.degrees(along_one_axis * _widest(covariance[3:, 3:])))
    resolved_cm = float(100.0 * along_one_axis * _widest(jacobian @ covariance @ jacobian.T))
    seen = resolved_deg <= matters.deg and resolved_cm <= matters.cm
    outcome: Outcome = "cannot-tell"
    if difference.squared > limit:
        outcome = "remounted"
    elif seen and difference.squared <= usual:
        outcome = "unchanged"
    picture_px, picture_sigma_px = _in_picture(before, after, covariance)
    figures = _figures(difference, picture_px, picture_sigma_px)
    bars = f"{resolved_deg:.2g} deg and {resolved_cm:.2g} cm"
    return Transition(
        before=before,
        after=after,
        change=difference.error,
        covariance=covariance,
        rotation_deg=difference.rotation_deg,
        rotation_sigma_deg=difference.rotation_sigma_deg,
        position_cm=difference.position_cm,
        position_sigma_cm=difference.position_sigma_cm,
        picture_px=picture_px,
        picture_sigma_px=picture_sigma_px,
        squared=difference.squared,
        limit=limit,
        resolved_deg=resolved_deg,
        resolved_cm=resolved_cm,
        outcome=outcome,
        words=_words(outcome, before, after, figures, bars, usual=difference.squared <= usual, matters=matters),
    )


def _widest(covariance: np.ndarray) -> float:
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))


def _in_picture(before: SessionPose, after: SessionPose, covariance: Matrix66) -> tuple[float, float]:
    """Return how far the reference position moved in the picture [px], through one lens, and the standard deviation of that."""
    camera = after.camera or before.camera
    reference_m = after.reference_radar_m if after.reference_radar_m is not None else before.reference_radar_m
    if camera is None or reference_m is None:
        return float("nan"), float("nan")
    one, other = (camera.project(pose.camera_from_radar @ reference_m[None])[0] for pose in (before, after))
    moved_px = other - one
    jacobian = camera.pose_jacobian(before.camera_from_radar, reference_m[None])[0]
    covariance_px2 = jacobian @ covariance @ jacobian.T
    length = float(np.linalg.norm(moved_px))
    if not length > 0.0:
        return length, float(np.sqrt(np.trace(covariance_px2) / 2.0))
    return length, float(np.sqrt(moved_px @ covariance_px2 @ moved_px)) / length


def _figures(difference: PoseDifference, picture_px: float, picture_sigma_px: float) -> str:
    rows = [
        _figure(difference.rotation_deg, difference.rotation_sigma_deg, "deg"),
        _figure(difference.position_cm, difference.position_sigma_cm, "cm"),
    ]
    if np.isfinite(picture_px):
        rows.append(_figure(picture_px, picture_sigma_px, "px"))
    return ", ".join(rows)


def _figure(value: float, sigma: float, unit: str) -> str:
    decimals = max(0, 1 - int(np.floor(np.log10(sigma)))) if 0.0 < sigma < np.inf else 2
    return f"{value:.{decimals}f} ± {sigma:.{decimals}f} {unit}"


def _replaced(before: SessionPose, after: SessionPose) -> list[str]:
    pairs = zip(("radar", "camera"), before.sensors, after.sensors, strict=True)
    return [
        f"{sensor} {new} instead of {old}"
        for sensor, old, new in pairs
        if old is not None and new is not None and old != new
    ]


def _words(
    outcome: Outcome,
    before: SessionPose,
    after: SessionPose,
    figures: str,
    bars: str,
    *,
    usual: bool,
    matters: RelevantChange,
) -> str:
    change = f"{figures} between {before.session} and {after.session}"
    replaced = _replaced(before, after)
    if replaced:
        change = f"{change} ({', '.join(replaced)})"
    if outcome == "remounted":
        what = "the sensors were replaced and sit elsewhere" if replaced else "this radar was remounted"
        return f"{what}: {change}, beyond both error bars"
    if outcome == "unchanged":
        return f"unchanged: {change}; 95 % error bars of {bars}"
    if not usual:
        return (
            f"cannot tell: {change} is beyond the 95 % error bars ({bars}), and within what 1 in 10,000 unchanged mountings "
            "show: perhaps remounted, measure again with more placements"
        )
    return (
        f"cannot tell: {change}; 95 % error bars of {bars} would hide a change of {matters.deg:g} deg or {matters.cm:g} cm: "
        "more placements would narrow them"
    )


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
