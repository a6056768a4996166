"""Make returns of the columns of a radar message as they are planned."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Points3, Values, Vector3
from calib_core.geometry import RigidTransform
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.recordings.radar.column_plan import ColumnPlan, plain_name

_UNKNOWN = np.full(3 << 16, np.nan)
_FARTHEST_M = 1e9
"""What is farther is no number that can be computed with."""
_UPPER = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


@dataclass(frozen=True, slots=True, eq=False)
class Returns:
    """The returns of one scan as columns, with the meaning of RadarScan. All-NaN columns may be read-only.

    Attributes:
        claimed_polar: range, azimuth and elevation as given in the message, NaN for missing ones; only on request.
        lost: (n,) which have no position although the message does not mark them as invalid; None if none is lost.
    """

    points_radar_m: Points3
    doppler_mps: Values
    snr_db: Values
    sigma_polar: Points3
    claimed_polar: Points3 | None = None
    lost: Flags | None = None

    def __len__(self) -> int:
        return len(self.points_radar_m)


def no_returns() -> Returns:
    """Return an empty scan."""
    return Returns(np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros((0, 3)))


_UNKNOWN.setflags(write=False)


def unknown(n: int, columns: int = 0) -> np.ndarray:
    """Return read-only NaN of shape (n,) or (n, columns); all such arrays share memory."""
    size = n * max(1, columns)
    values = _UNKNOWN[:size]
    if len(values) < size:
        values = np.full(size, np.nan)
        values.setflags(write=False)
    return values.reshape(n, columns) if columns else values


def returns_from(plan: ColumnPlan, column: Callable[[str], np.ndarray]) -> Returns:
    """Extract the returns of one scan from a message.

    Args:
        plan: which columns to use.
        column: returns a column by the driver's name, of any number type; (n,), or (m, k) with n = m k; not modified.
    """
    with np.errstate(all="ignore"):  # damaged bytes may hold signalling NaN, and numbers whose squares overflow
        return _returns(plan, column)


def _returns(plan: ColumnPlan, column: Callable[[str], np.ndarray]) -> Returns:
    position = _position(plan, column)
    if plan.azimuth_from is not None:
        position = _at_other_azimuth(plan, position, _floats(column(plan.azimuth_from)))
    n = len(position)
    amplitude = _floats(column(plan.amplitude)) if plan.amplitude else unknown(n)
    doppler = _doppler(plan, column, position if plan.mount is None else position - _origin_m(plan, plan.mount))
    for flag in plan.spoils_doppler:
        doppler = np.where(column(flag).reshape(-1) != 0, np.nan, doppler)
    lost = ~(np.abs(position) <= _FARTHEST_M).all(axis=1)
    position[lost | ~position.any(axis=1)] = np.nan  # at the radar itself there is none: an empty slot
    for flag in plan.spoils_position:
        invalid = column(flag).reshape(-1) != 0
        position[invalid], lost[invalid] = np.nan, False
    for flag in plan.needed:
        invalid = column(flag).reshape(-1) == 0
        position[invalid], lost[invalid] = np.nan, False
    turn = plan.turn
    if turn is not None:
        position = position @ turn.T
    if plan.mount is not None:
        position = plan.mount.inverse() @ position
    if plan.amplitude_scale != 1.0:
        amplitude = amplitude * plan.amplitude_scale
    claimed = _columns(plan.claimed, column, n) * plan.claimed_scales if plan.claiming else None
    doppler = np.where(np.isinf(doppler), np.nan, doppler) if np.isinf(doppler).any() else doppler
    amplitude = np.where(np.isinf(amplitude), np.nan, amplitude) if np.isinf(amplitude).any() else amplitude
    sigma = _sigma(plan, column, position)
    return Returns(position, doppler, amplitude, sigma, claimed, lost if lost.any() else None)


def _origin_m(plan: ColumnPlan, mount: RigidTransform) -> Vector3:
    """Return where the radar is (3,) [m], in the message's own axes."""
    return mount.translation_m if plan.turn is None else plan.turn.T @ mount.translation_m


def _floats(values: np.ndarray) -> Values:
    """Copy a column into a contiguous float array."""
    return np.array(values, dtype=np.float64, order="C").reshape(-1)


def _position(plan: ColumnPlan, column: Callable[[str], np.ndarray]) -> Points3:
    """Return positions in the message's own axes, with angles positive to the left and upwards."""
    parts = [column(name) for name in plan.position]
    position = np.empty((parts[0].size, 3))
    for axis, part in enumerate(parts):
        position[:, axis].reshape(part.shape)[...] = part
    position[:, len(parts) :] = 0.0
    if plan.scales != (1.0, 1.0, 1.0):
        position *= plan.scales
    if not plan.polar:
        return position
    if plan.degrees:
        position[:, 1:] = np.radians(position[:, 1:])
        position[(np.abs(position[:, 1:]) > 2 * np.pi).any(axis=1)] = np.nan
    position[position[:, 0] < 0.0] = np.nan
    position[:, 1] *= plan.azimuth_sign
    return cartesian_from_polar(position)


def _at_other_azimuth(plan: ColumnPlan, position: Points3, azimuth: Values) -> Points3:
    """Return positions with their range and elevation at another azimuth, in the unit and with the sign of the first."""
    degrees = plan.degrees or plain_name(plan.azimuth_from or "").endswith("deg")
    scale = plan.azimuth_sign * (plan.scales[1] if plan.polar else 1.0)
    polar = polar_from_cartesian(position)
    polar[:, 1] = scale * (np.radians(azimuth) if degrees else azimuth)
    return cartesian_from_polar(polar)


def _sigma(plan: ColumnPlan, column: Callable[[str], np.ndarray], position: Points3) -> Points3:
    turn = plan.turn
    if plan.covariance is not None:
        covariance = full_covariance(np.asarray(column(plan.covariance), dtype=np.float64))
        turn = turn if plan.mount is None else plan.mount.rotation.T @ (np.eye(3) if turn is None else turn)
        return sigma_polar_from_covariance(position, covariance if turn is None else turn @ covariance @ turn.T)
    if not any(plan.sigma):
        return unknown(len(position), 3)
    sigma = _columns(plan.sigma, column, len(position)) * plan.sigma_scales
    if plan.degrees:
        sigma[:, 1:] = np.radians(sigma[:, 1:])
    if turn is not None and not turn[2, 2]:
        sigma[:, 1:] = np.nan  # the azimuth is then no longer measured about the upward axis
    return sigma


def _columns(names: Iterable[str | None], column: Callable[[str], np.ndarray], n: int) -> Points3:
    found = np.full((n, 3), np.nan)
    for index, name in enumerate(names):
        if name is not None:
            found[:, index] = column(name).reshape(-1)
    return found


def _doppler(plan: ColumnPlan, column: Callable[[str], np.ndarray], position: Points3) -> Values:
    if plan.doppler:
        speed = _floats(column(plan.doppler))
        return speed if plan.doppler_scale == 1.0 else speed * plan.doppler_scale
    if not plan.velocity:
        return unknown(len(position))
    range_m = polar_from_cartesian(position)[:, 0]
    with np.errstate(invalid="ignore", divide="ignore"):
        signs = np.copysign(plan.doppler_scale, plan.scales)
        along = sum(
            _floats(column(name)) * (signs[axis] * position[:, axis]) for axis, name in enumerate(plan.velocity)
        )
        return np.asarray(along / range_m, dtype=np.float64)


def full_covariance(rows: np.ndarray) -> np.ndarray:
    """Return (n, 3, 3) position covariances [m^2] from the rows in messages.

    Args:
        rows: (n, 6) xx, xy, xz, yy, yz, zz; (n, 9) row-major; or (n, 36) of x, y, z and three rotations, row-major.
    """
    if rows.shape[1] == 6:
        return np.asarray(rows[:, _UPPER])
    side = 6 if rows.shape[1] == 36 else 3
    return np.asarray(rows.reshape(-1, side, side)[:, :3, :3])


def sigma_polar_from_covariance(points_radar_m: Points3, covariance_m2: np.ndarray) -> Points3:
    """Return (n, 3) standard deviations of range [m], azimuth and elevation [rad]; NaN where a variance is not positive.

    Trackers write 0 or -1 for unknown variances.

    Args:
        points_radar_m: (n, 3).
        covariance_m2: (n, 3, 3).
    """
    range_m, azimuth, elevation = polar_from_cartesian(points_radar_m).T
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    along = np.stack([ce * ca, ce * sa, se], axis=1)
    across = np.stack([-sa, ca, np.zeros_like(sa)], axis=1)
    upward = np.stack([-se * ca, -se * sa, ce], axis=1)
    lengths = np.stack([np.ones_like(range_m), range_m * ce, range_m], axis=1)
    axes = np.stack([along, across, upward], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        variance = np.einsum("nai,nij,naj->na", axes, covariance_m2, axes)
        known = np.stack([covariance_m2[:, i, i] > 0 for i in range(3)], axis=1)
        known[:, 0] &= known[:, 1]
        return np.where(known & (variance > 0) & (lengths > 0), np.sqrt(np.abs(variance)) / lengths, np.nan)
