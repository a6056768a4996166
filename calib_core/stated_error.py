"""The error of a pose that holds with 95 %: one figure each for rotation, camera position and picture, from its covariance."""

from dataclasses import dataclass

import numpy as np

from calib_core.geometry import skew
from calib_core.results import Calibration

_BEYOND = 0.05 / 3.0  # rotation, position and picture hold together, so each may fail in a third of the 5 %
_LEAST_FREEDOM, _MOST_FREEDOM = 0.5, 1e5
_HALVINGS = 60


@dataclass(frozen=True, slots=True)
class StatedError:
    """The error that holds with 95 %, all figures together, rounded up as it is shown.

    Attributes:
        rotation_deg: angle between the stated and the true rotation; of a radar without elevation, about its up axis.
        position_cm: distance between the camera centres; NaN for a radar without elevation, whose mounting decides it.
        picture_px: distance in the picture between where a radar position in the middle of the placements reprojects and where
            it is; NaN if unknown.
        range_m: of that position: the median of the placements.
        in_plane: whether the radar measures no elevation.
    """

    rotation_deg: float
    position_cm: float
    picture_px: float
    range_m: float
    in_plane: bool

    @property
    def text(self) -> str:
        """The figures within a sentence: "0.5 deg, 6 cm (95 %); 7 px at 9 m"."""
        pose = (
            f"{self.rotation_deg:g} deg of yaw"
            if self.in_plane
            else f"{self.rotation_deg:g} deg, {self.position_cm:g} cm"
        )
        picture = f"; {self.picture_px:g} px at {self.range_m:.0f} m" if np.isfinite(self.picture_px) else ""
        return f"{pose} (95 %){picture}{'; height and tilt assumed' if self.in_plane else ''}"


def stated_error(calibration: Calibration) -> StatedError:
    """Return the error that the covariance states.

    Args:
        calibration: with a finite covariance.
    """
    pose, in_plane = calibration.camera_from_radar, not calibration.sees_elevation
    freedom = degrees_of_freedom(calibration.covariance_quantile)
    turned = pose.rotation.T
    to_centre = np.concatenate([-turned, -turned @ skew(pose.translation_m)], axis=1)
    about_axes = np.concatenate([np.zeros((3, 3)), turned], axis=1)[2 if in_plane else 0 :]
    with np.errstate(over="ignore", invalid="ignore"):  # a file may state any number: beyond all numbers is infinite
        of_centre = to_centre @ calibration.covariance @ to_centre.T
        of_axes = about_axes @ calibration.covariance @ about_axes.T
    position_m = _radius(of_centre, freedom)
    common_px = calibration.options.reflector.click_offset_sigma_px  # the pose follows what all clicks are off by
    picture_px2 = (np.float64(calibration.metrics.picture_sigma_px) ** 2 + common_px**2) * np.eye(2)
    ranges_m = [float(np.linalg.norm(pair.point_radar_m)) for pair in calibration.pairs if pair.inlier]
    known = bool(ranges_m) and bool(np.isfinite(picture_px2).all())
    return StatedError(
        rotation_deg=_rounded_up(np.rad2deg(_radius(of_axes, freedom))),
        position_cm=float("nan") if in_plane else _rounded_up(100.0 * position_m),
        picture_px=_rounded_up(_radius(picture_px2, freedom)) if known else float("nan"),
        range_m=float(np.median(ranges_m)) if known else float("nan"),
        in_plane=in_plane,
    )


def degrees_of_freedom(quantile_95: float) -> float:
    """Return nu, the degrees of freedom that the quantile of the 6 parameters states: 6 F(6, nu) is at most that with 95 %."""
    from scipy.special import fdtri

    if not quantile_95 > 6.0 * fdtri(6.0, _MOST_FREEDOM, 0.95):
        return _MOST_FREEDOM
    if quantile_95 >= 6.0 * fdtri(6.0, _LEAST_FREEDOM, 0.95):
        return _LEAST_FREEDOM
    low, high = np.log(_LEAST_FREEDOM), np.log(_MOST_FREEDOM)
    for _ in range(_HALVINGS):  # 6 F(6, nu) falls with nu; importing scipy.optimize would take a third of a second
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 6.0 * fdtri(6.0, np.exp(middle), 0.95) > quantile_95 else (low, middle)
    return float(np.exp(high))


def _radius(covariance: np.ndarray, freedom: float) -> float:
    """Return the length that an error with this covariance (k, k) exceeds in a third of 5 %.

    Its square is a weighted sum of chi-squares over an estimated noise level: trace(S) F(m, nu) with m = trace(S)^2 / trace(S^2)
    degrees of freedom (Satterthwaite), exact along one axis and for equal axes.
    """
    from scipy.special import fdtri

    if not np.isfinite(covariance).all():
        return float("inf")
    largest = float(np.abs(covariance).max())
    if largest <= 0.0:
        return 0.0
    scaled = covariance / largest
    trace = float(np.trace(scaled))
    if trace <= 0.0:
        return 0.0
    effective = trace**2 / float((scaled**2).sum())
    return float(np.sqrt(trace * fdtri(effective, freedom, 1.0 - _BEYOND)) * np.sqrt(largest))


def _rounded_up(value: float) -> float:
    """Round up to two digits, so that a figure never states less than the covariance."""
    if value <= 0.0 or not np.isfinite(value):
        return max(value, 0.0)
    step = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(f"{np.ceil(value / step - 1e-9) * step:.3g}")
