"""Which columns of a radar message are position, speed, amplitude and noise, whatever a driver calls them."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Values
from calib_core.radar import cartesian_from_polar, polar_from_cartesian

__all__ = ["ColumnPlan", "Returns", "no_returns", "plan_columns", "returns_from"]

_POSITION_PREFIXES = ("", "position", "poseposition", "pos", "point")
_RANGES = ("range", "r", "distance", "dist", "rangem", "targetrange")
_AZIMUTHS = ("azimuth", "azimuthangle", "azimuthrad", "azimuthdeg", "az")
_ELEVATIONS = ("elevation", "elevationangle", "elevationrad", "elevationdeg", "el")
_DOPPLERS = (
    "dopplervelocity", "vdopplermps", "radialvelocity", "radialspeed", "rangerate", "dopplermps", "doppler", "vradial",
    "velocity", "vr", "v", "speed", "speedradial", "rrate",
)  # fmt: skip
_AMPLITUDES = ("snrdb", "snr", "intensity", "rcs", "power", "amplitude", "magnitude")
_VELOCITIES = (
    ("vx", "vy", "vz"), ("velocityx", "velocityy", "velocityz"), ("relativevelocityx", "relativevelocityy", "relativevelocityz"),
    ("twistlinearx", "twistlineary", "twistlinearz"), ("vrelx", "vrely", "vrelz"), ("vabsx", "vaby", "vabz"),
)  # fmt: skip
_SIGMAS = (
    ("rangestd", "sigmarange", "rangesigma", "distancestd"),
    ("azimuthstd", "azimuthanglestd", "sigmaazimuth", "azimuthsigma"),
    ("elevationstd", "elevationanglestd", "sigmaelevation", "elevationsigma"),
)
_INVALID_POSITION = ("invaliddistance", "invalidrange", "invalidazimuth", "invalidelevation")
_INVALID_DOPPLER = ("invalidrangerate", "invaliddoppler", "invalidvelocity")


@dataclass(frozen=True, slots=True, eq=False)
class Returns:
    """The returns of one scan as columns; the meaning is that of RadarScan."""

    points_radar_m: Points3
    doppler_mps: Values
    snr_db: Values
    sigma_polar: Points3

    def __len__(self) -> int:
        return len(self.points_radar_m)


def no_returns() -> Returns:
    """Return a scan of nothing."""
    return Returns(np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros((0, 3)))


@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """The driver's names of the columns that are used.

    Attributes:
        position: x, y and perhaps z [m]; or range [m], azimuth and perhaps elevation.
        polar: position is polar.
        degrees: the angles are in degrees.
        doppler: radial speed [m/s], or None.
        velocity: components [m/s] whose part along the line of sight is the radial speed where doppler is None.
        amplitude: a figure in dB, or None.
        amplitude_scale: its unit in dB.
        sigma: standard deviations of range, azimuth and elevation; None each where there is none.
        spoils_position: flags that say the position is not valid.
        spoils_doppler: flags that say the speed is not valid.
    """

    position: tuple[str, ...]
    polar: bool
    degrees: bool = False
    doppler: str | None = None
    velocity: tuple[str, ...] = ()
    amplitude: str | None = None
    amplitude_scale: float = 1.0
    sigma: tuple[str | None, str | None, str | None] = (None, None, None)
    spoils_position: tuple[str, ...] = ()
    spoils_doppler: tuple[str, ...] = ()

    @property
    def looks_like_radar(self) -> bool:
        """Tell whether more than a position and an intensity is there, as a lidar has them."""
        amplitude = self.amplitude is not None and _plain(self.amplitude) != "intensity"
        return self.polar or self.doppler is not None or bool(self.velocity) or amplitude

    def describe(self) -> str:
        """Say in a few words what is read from where."""
        words = [f"position from {', '.join(self.position)}"]
        if self.polar:
            words[0] += f" (azimuth positive to the left, {'degrees' if self.degrees else 'radians'})"
        speed = self.doppler or ", ".join(self.velocity)
        words.append(f"speed from {speed}" if speed else "no speed")
        words.append(f"amplitude from {self.amplitude}" if self.amplitude else "no amplitude")
        if any(self.sigma):
            words.append(f"noise from {', '.join(name for name in self.sigma if name)}")
        return "; ".join(words)


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def plan_columns(names: Iterable[str], *, degrees: bool = False) -> ColumnPlan | None:
    """Recognise the columns of a radar by their names; None where there is no position.

    Args:
        names: as the message spells them; nested ones dotted.
        degrees: angles are in degrees, as some packages document outside the message.
    """
    by_plain = {_plain(name): name for name in reversed(list(names))}

    def first(candidates: Iterable[str]) -> str | None:
        return next((by_plain[name] for name in candidates if name in by_plain), None)

    position = _cartesian(by_plain)
    polar = not position
    if polar:
        polar_names = (first(_RANGES), first(_AZIMUTHS), first(_ELEVATIONS))
        if polar_names[0] is None or polar_names[1] is None:
            return None
        position = tuple(name for name in polar_names if name is not None)
        degrees = degrees or _plain(position[1]).endswith("deg")
    sets = (tuple(by_plain[name] for name in names if name in by_plain) for names in _VELOCITIES)
    velocity = next((found for found in sets if len(found) >= 2), ())
    doppler = first(_DOPPLERS)
    sigma = tuple(first(candidates) for candidates in _SIGMAS)
    return ColumnPlan(
        position=position,
        polar=polar,
        degrees=degrees,
        doppler=doppler,
        velocity=() if doppler else velocity,
        amplitude=first(_AMPLITUDES),
        sigma=(sigma[0], sigma[1], sigma[2]),
        spoils_position=tuple(by_plain[name] for name in _INVALID_POSITION if name in by_plain),
        spoils_doppler=tuple(by_plain[name] for name in _INVALID_DOPPLER if name in by_plain),
    )


def _cartesian(by_plain: dict[str, str]) -> tuple[str, ...]:
    for prefix in _POSITION_PREFIXES:
        if f"{prefix}x" in by_plain and f"{prefix}y" in by_plain:
            return tuple(by_plain[f"{prefix}{axis}"] for axis in "xyz" if f"{prefix}{axis}" in by_plain)
    if "distx" in by_plain and "disty" in by_plain:
        return by_plain["distx"], by_plain["disty"]
    return ()


def returns_from(plan: ColumnPlan, column: Callable[[str], np.ndarray]) -> Returns:
    """Take the returns of one scan out of a message.

    Args:
        plan: which columns to use.
        column: gives a column by the driver's name.
    """
    with np.errstate(invalid="ignore"):  # damaged bytes may hold signalling NaN
        return _returns(plan, column)


def _returns(plan: ColumnPlan, column: Callable[[str], np.ndarray]) -> Returns:
    parts = [np.asarray(column(name), dtype=np.float64) for name in plan.position]
    if len(parts) == 2:
        parts.append(np.zeros_like(parts[0]))
    position = np.stack(parts, axis=1)
    n = len(position)
    if plan.polar:
        if plan.degrees:
            position[:, 1:] = np.radians(position[:, 1:])
        position = cartesian_from_polar(position)
    sigma = np.full((n, 3), np.nan)
    for axis, name in enumerate(plan.sigma):
        if name:
            sigma[:, axis] = np.radians(column(name)) if plan.degrees and axis else column(name)
    amplitude = column(plan.amplitude) if plan.amplitude else np.full(n, np.nan)
    doppler = _doppler(plan, column, position)
    for flag in plan.spoils_doppler:
        doppler = np.where(np.asarray(column(flag)) != 0, np.nan, doppler)
    for flag in plan.spoils_position:
        position[np.asarray(column(flag)) != 0] = np.nan
    return Returns(position, doppler, amplitude * plan.amplitude_scale, sigma)


def _doppler(plan: ColumnPlan, column: Callable[[str], np.ndarray], position: Points3) -> Values:
    if plan.doppler:
        return np.asarray(column(plan.doppler), dtype=np.float64)
    if not plan.velocity:
        return np.full(len(position), np.nan)
    range_m = polar_from_cartesian(position)[:, 0]
    with np.errstate(invalid="ignore", divide="ignore"):
        along = sum(column(name) * position[:, axis] for axis, name in enumerate(plan.velocity))
        return np.asarray(along / range_m, dtype=np.float64)
