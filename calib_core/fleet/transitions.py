"""What changed between two sessions of one vehicle, and whether the radar was remounted in between."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array
from calib_core.fleet.session_pose import SessionPose
from calib_core.fleet.tails import FALSE_RATE, quantile
from calib_core.geometry import PoseDifference, camera_position_jacobian, pose_difference

Outcome: TypeAlias = Literal["remounted", "unchanged", "cannot-tell"]
_95 = 0.95


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
