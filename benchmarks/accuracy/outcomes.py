"""One outcome as raw figures: its errors, its stated uncertainty, and the codes of its warnings."""

from collections.abc import Callable, Iterable, Sequence
from typing import get_args

import numpy as np

from benchmarks.accuracy.figures import column
from benchmarks.accuracy.rows import Figures
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, camera_position_jacobian
from calib_core.measurements import Unsolvable
from calib_core.results import Calibration
from calib_core.results.verdict import VerdictLevel, stated_error, verdict_on

LEVELS: tuple[VerdictLevel, ...] = get_args(VerdictLevel)

_CODE = "code "
_CHI2_95, _CHI2_999 = 12.591587243743977, 22.457744484825323  # of 6 parameters
_FAR = 2.0  # times the 99.9 % quantile


def solved_or_refused(solve: Callable[[], Calibration | Unsolvable]) -> Calibration | Unsolvable:
    """Return the outcome; input that is refused with a reason gives no pose, like input that does not determine one."""
    try:
        return solve()
    except InputError as error:
        return Unsolvable.reported("refused", str(error), "")


def outcome_figures(outcome: Calibration | Unsolvable, truth: RigidTransform) -> Figures:
    """Return errors and stated sigmas [rad, m], the squared Mahalanobis distance of the truth, and a figure for every code.

    "level" is the verdict's, and "as told" 1 if rotation and camera position are both within the verdict's 95 % figures.
    """
    level = {"level": float(LEVELS.index(verdict_on(outcome).level))}
    if isinstance(outcome, Unsolvable):
        return {f"{_CODE}{outcome.code}": 1.0, "squared": None} | level
    pose, covariance = outcome.camera_from_radar, outcome.covariance
    error = truth.error_from(pose)
    to_centre = camera_position_jacobian(pose)
    away_m = pose.inverse().translation_m - truth.inverse().translation_m
    stated = bool(np.isfinite(covariance).all())
    codes: Figures = {f"{_CODE}{warning.code}": 1.0 for warning in outcome.warnings}
    return (
        codes
        | level
        | {
            "rotation_rad": float(np.linalg.norm(error[3:])),
            "position_m": float(np.linalg.norm(away_m)),
            "stated_rad": float(np.sqrt(np.trace(covariance[3:, 3:]))) if stated else None,
            "stated_m": float(np.sqrt(np.trace(to_centre @ covariance @ to_centre.T))) if stated else None,
            "squared": float(error @ np.linalg.solve(covariance, error)) if stated else None,
            "quantile": outcome.covariance_quantile,
            "as told": _as_told(outcome, error[3:], 100.0 * float(np.linalg.norm(away_m))) if stated else None,
        }
    )


def _as_told(outcome: Calibration, turned_rad: np.ndarray, away_cm: float) -> float:
    """Return 1 if both errors are at most those that the verdict states; a radar without elevation states its yaw only."""
    told = stated_error(outcome)
    yaw_rad = (outcome.camera_from_radar.rotation.T @ turned_rad)[2]
    turned_deg = np.rad2deg(abs(yaw_rad) if told.in_plane else np.linalg.norm(turned_rad))
    return float(turned_deg <= told.rotation_deg and not away_cm > told.position_cm)


def sold(trials: Sequence[Figures]) -> np.ndarray:
    """Flag the trials whose verdict is good or usable."""
    return column(trials, "level") <= LEVELS.index("usable")


def level_counts(trials: Sequence[Figures]) -> dict[str, str]:
    """Return how many trials have each level."""
    levels = column(trials, "level")
    return {level: str(int((levels == place).sum())) for place, level in enumerate(LEVELS)}


def inside(trials: Sequence[Figures]) -> np.ndarray:
    """Flag the trials whose truth lies inside the stated 95 % ellipsoid; NaN without a pose."""
    squared, quantile = column(trials, "squared"), column(trials, "quantile")
    return np.where(np.isfinite(squared), squared <= quantile, np.nan)


def quantile_999(quantile_95: float) -> float:
    """Return the 99.9 % quantile of the stated distribution of d2 from its stated 95 % quantile.

    The stated distribution is that of 6 F(6, nu), or chi-square if the noise is known; nu is what the 95 % quantile tells.
    """
    from scipy.optimize import brentq
    from scipy.special import fdtri

    if not quantile_95 > 1.001 * _CHI2_95:
        return _CHI2_999 * quantile_95 / _CHI2_95
    freedom = brentq(lambda nu: 6.0 * fdtri(6.0, nu, 0.95) - quantile_95, 0.5, 1e5)
    return float(6.0 * fdtri(6.0, freedom, 0.999))


def codes_in(figures: Figures) -> set[str]:
    """Return the codes of an outcome: of its warnings, or why there is no pose."""
    return {name.removeprefix(_CODE) for name in figures if name.startswith(_CODE)}


def named(figures: Figures, codes: Iterable[str]) -> bool:
    """Return whether an outcome has one of the codes, or no pose: both tell the user that something is wrong."""
    return bool(codes_in(figures) & set(codes)) or "rotation_rad" not in figures


def silently_wrong(trials: Sequence[Figures], codes: Iterable[str], *, always_wrong: bool = False) -> np.ndarray:
    """Flag trials whose truth is outside twice the stated 99.9 % quantile of d2, without a code that names the cause.

    Args:
        trials: figures of outcomes.
        codes: warnings that name the cause.
        always_wrong: no pose is true of such pairs, so every pose without a code is silently wrong.
    """
    return _outside(trials, codes, _FAR, always_wrong=always_wrong)


def misleading(trials: Sequence[Figures], codes: Iterable[str], *, always_wrong: bool = False) -> np.ndarray:
    """Flag trials, of any verdict, whose truth is outside the stated 99.9 % quantile itself, without such a code."""
    return _outside(trials, codes, 1.0, always_wrong=always_wrong)


def _outside(trials: Sequence[Figures], codes: Iterable[str], times: float, *, always_wrong: bool) -> np.ndarray:
    flags = []
    for figures in trials:
        squared, quantile = figures.get("squared"), figures.get("quantile")
        far = squared is not None and quantile is not None and not squared <= times * quantile_999(quantile)
        flags.append((far or always_wrong) and not named(figures, codes))
    return np.array(flags, dtype=np.bool_)
