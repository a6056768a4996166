"""Kinds of systematic errors: how each of the errors that all pairs share moves the pixels."""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from calib_core.arrays import Values
from calib_core.radar import RadarErrors

_RADAR_ERRORS = {one.name for one in fields(RadarErrors)}


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """The derivatives of the pixels of n pairs at one pose or many, before whitening.

    Attributes:
        polar: (3, n) true positions: range [m], azimuth, elevation [rad].
        d_point: (..., 3, 2, n) d pixel / d point in the camera frame [px/m].
        d_polar: (..., 3, 2, n) d pixel / d polar.
        offset_px: (..., 2, n) projections, from the principal point.
        focal_px: of the camera.
        d_parameter: (..., p, 2, n) d pixel / d parameter of the camera; None if no error asks for it.
    """

    polar: np.ndarray
    d_point: np.ndarray
    d_polar: np.ndarray
    offset_px: np.ndarray
    focal_px: float
    d_parameter: np.ndarray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SystematicError:
    """One error that all pairs share; `error_words` says what it is called.

    Attributes:
        name: key in files, with its unit; a scale without one.
        sigma: standard deviation of its prior.
        column: d pixel / d error (..., 2, n).
        axis: of the camera along which it shifts the reflector; None for other errors.
        of_lens: whether it is along an axis of the lens prior.
    """

    name: str
    sigma: float
    column: Callable[[Sensitivity], np.ndarray]
    axis: int | None = None
    of_lens: bool = False

    @property
    def of_radar(self) -> bool:
        """Whether it is one of `RadarErrors`, and so can be taken out of reported positions."""
        return self.name in _RADAR_ERRORS


def scale(name: str, sigma: float, coordinate: int) -> SystematicError:
    """Return a scale of the radar's range (0), azimuth (1) or elevation (2)."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(at.d_polar[..., coordinate, :, :] * -at.polar[coordinate])

    return SystematicError(name, sigma, column)


def range_bias(sigma_m: float) -> SystematicError:
    """Return a constant error of the range."""

    def column(at: Sensitivity) -> np.ndarray:
        return -at.d_polar[..., 0, :, :]

    return SystematicError("range_bias_m", sigma_m, column)


def squared_height(sigma_m: float) -> SystematicError:
    """Height h of the placements above or below a radar without elevation: the range along its plane is sqrt(r^2 - h^2)."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(at.d_polar[..., 0, :, :] / (-2.0 * at.polar[0]))

    return SystematicError("squared_height_m2", sigma_m**2, column)


def reflector_offset(axis: int, name: str, sigma_m: float) -> SystematicError:
    """Return a shift of the clicked point from the phase centre along an axis of the camera."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(at.d_point[..., axis, :, :])

    return SystematicError(f"reflector_{name}_m", sigma_m, column, axis=axis)


def click_offset(row: int, name: str, sigma_px: float) -> SystematicError:
    """Return a shift of all clicks along a column (0) or row (1) axis of the picture."""

    def column(at: Sensitivity) -> np.ndarray:
        shift = np.zeros_like(at.offset_px)
        shift[..., row, :] = 1.0
        return shift

    return SystematicError(f"click_{name}_px", sigma_px, column)


def along_lens_axis(number: int, axis: Values) -> SystematicError:
    """Return the error of the lens along one axis (p,) of its prior."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(np.einsum("p,...prn->...rn", axis, np.asarray(at.d_parameter)))

    return SystematicError(f"lens_axis_{number + 1}", 1.0, column, of_lens=True)


def focal_length(sigma: float) -> SystematicError:
    """Return a share by which the focal length is off."""
    return SystematicError("focal_length", sigma, lambda at: at.offset_px)


def radial_distortion(sigma: float) -> SystematicError:
    """Return an amount by which the first radial distortion coefficient is off, whatever the lens model."""

    def column(at: Sensitivity) -> np.ndarray:
        squared = (at.offset_px**2).sum(axis=-2, keepdims=True) / at.focal_px**2
        return np.asarray(at.offset_px * squared)

    return SystematicError("distortion", sigma, column)
