"""The difference between two calibrations in degrees, in centimetres, and in pixels at typical distances."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.geometry import skew
from calib_core.interchange.imported import ImportedCalibration

__all__ = ["ComparedFigure", "Comparison", "PixelDifference", "compare", "shown"]

DISTANCES_M = (5.0, 20.0, 60.0)
_GRID = 7
_ZERO_LENGTH = 1e-9


@dataclass(frozen=True, slots=True)
class PixelDifference:
    """How far apart two calibrations project points at one distance.

    Attributes:
        distance_m: distance from the camera.
        rms_px: root mean square over the image.
        max_px: maximum over the image.
        sigma_px: root mean square expected from the two covariances; NaN if neither is known.
    """

    distance_m: float
    rms_px: float
    max_px: float
    sigma_px: float


@dataclass(frozen=True, slots=True)
class ComparedFigure:
    """One line of a comparison, the same in every report.

    Attributes:
        label: what differs.
        text: by how much, with its standard deviation if that is known.
    """

    label: str
    text: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """The difference between two calibrations.

    Attributes:
        rotation_deg: angle between the two rotations.
        rotation_sigma_deg: its standard deviation about its own axis, from the covariances; NaN if neither is known.
        position_cm: distance between the two camera positions in the radar frame.
        position_sigma_cm: its standard deviation along its own direction; NaN if neither is known.
        pixels: at 5, 20 and 60 m; empty without a camera.
        chi2: squared Mahalanobis distance under the known covariances, 6 degrees of freedom; NaN if neither is known.
        p_value: probability of a chi2 this large if the two are independent and right; NaN if chi2 is.
        covariances: how many of the two covariances are known.
        beyond: for each of the two, whether the other's pose is outside its 95 % ellipsoid; None if it states no uncertainty.
    """

    rotation_deg: float
    rotation_sigma_deg: float
    position_cm: float
    position_sigma_cm: float
    pixels: tuple[PixelDifference, ...]
    chi2: float
    p_value: float
    covariances: int
    beyond: tuple[bool | None, bool | None]

    @property
    def figures(self) -> tuple[ComparedFigure, ...]:
        """The differences as final text; every report shows these."""
        rows = [
            ComparedFigure(
                "rotation", f"{shown(self.rotation_deg)} deg apart{_plus_minus(self.rotation_sigma_deg, 'deg')}"
            ),
            ComparedFigure(
                "camera position", f"{shown(self.position_cm)} cm apart{_plus_minus(self.position_sigma_cm, 'cm')}"
            ),
        ]
        for at in self.pixels:
            expected = "" if np.isnan(at.sigma_px) else f", expected {at.sigma_px:.3g} px from the covariances"
            rms_and_max = f"{shown(at.rms_px)} px rms, {shown(at.max_px)} px max{expected}"
            rows.append(ComparedFigure(f"at {at.distance_m:g} m", rms_and_max))
        if np.isfinite(self.chi2):
            independent = f"(p = {self.p_value:.2g} if the two are independent)"
            rows.append(ComparedFigure("overall", f"chi2 {shown(self.chi2)} for 6 degrees of freedom {independent}"))
        return tuple(rows)

    def verdict(self, a: str, b: str) -> str:
        """Say whether the difference exceeds what the two state about themselves, with these names for them."""
        parts = {True: "exceeds", False: "is within", None: "cannot be judged by"}
        of_a, of_b = (parts[beyond] for beyond in self.beyond)
        what = "the stated 95 % uncertainty of"
        if self.beyond == (None, None):
            return "neither of the two states an uncertainty"
        if self.beyond[0] == self.beyond[1]:
            return f"the difference {of_a} {what} both"
        if None in self.beyond:
            (part, name), silent = ((of_a, a), b) if self.beyond[1] is None else ((of_b, b), a)
            return f"the difference {part} {what} {name}; {silent} states none"
        return f"the difference {of_a} {what} {a} and {of_b} that of {b}"

    def lines(self) -> tuple[str, ...]:
        """Return the comparison as readable lines; the first of the two is called the other."""
        rows = [f"{row.label}: {row.text}" for row in self.figures]
        rows.append(self.verdict("the other", "this one"))
        if self.covariances == 1:
            rows.append("only one of the two uncertainties is known; the standard deviations come from that one alone")
        return tuple(rows)


def shown(value: float) -> str:
    """Format a number with three significant digits; anything up to a millionth is rounding and shown as 0."""
    return f"{value if abs(value) > 1e-6 else 0:.3g}"


def _plus_minus(sigma: float, unit: str) -> str:
    return "" if np.isnan(sigma) else f" (standard deviation {sigma:.2g} {unit})"


def compare(a: ImportedCalibration, b: ImportedCalibration, *, camera: Camera | None = None) -> Comparison:
    """Compare two calibrations of the same sensors; the covariances are added, as for independent data.

    Args:
        a: one of them.
        b: the other.
        camera: the intrinsics, if neither has any.
    """
    a_pose, b_pose = a.camera_from_radar, b.camera_from_radar
    error = b_pose.error_from(a_pose)
    known = _known_covariances(a, b)
    covariance = np.sum(known, axis=0) if known else np.full((6, 6), np.nan)
    a_position_m, b_position_m = a_pose.inverse().translation_m, b_pose.inverse().translation_m
    position_jacobian = -a_pose.rotation.T @ np.hstack([np.eye(3), skew(a_pose.translation_m)])
    moved_m = b_position_m - a_position_m
    chi2, p_value = _chi2(error, covariance)
    camera = a.camera or b.camera or camera
    return Comparison(
        rotation_deg=float(np.degrees(np.linalg.norm(error[3:]))),
        rotation_sigma_deg=float(np.degrees(_sigma_along(error[3:], covariance[3:, 3:]))),
        position_cm=float(np.linalg.norm(moved_m)) * 100.0,
        position_sigma_cm=_sigma_along(moved_m, position_jacobian @ covariance @ position_jacobian.T) * 100.0,
        pixels=tuple(_pixels(a, b, camera, distance_m, covariance) for distance_m in DISTANCES_M) if camera else (),
        chi2=chi2,
        p_value=p_value,
        covariances=len(known),
        beyond=(_beyond(a, error), _beyond(b, a_pose.error_from(b_pose))),
    )


def _beyond(side: ImportedCalibration, error: np.ndarray) -> bool | None:
    """Return whether an error (6,) of a pose is outside its 95 % ellipsoid; None if it states none."""
    if side.file is None:
        return None
    squared = _chi2(error, side.file.calibration.covariance)[0]
    quantile = side.file.calibration.covariance_quantile
    return squared > quantile if np.isfinite(squared) and np.isfinite(quantile) else None


def _known_covariances(a: ImportedCalibration, b: ImportedCalibration) -> list[Matrix66]:
    return [
        side.file.calibration.covariance
        for side in (a, b)
        if side.file is not None and np.isfinite(side.file.calibration.covariance).all()
    ]


def _sigma_along(direction: np.ndarray, covariance: np.ndarray) -> float:
    length = float(np.linalg.norm(direction))
    variance = np.trace(covariance) / 3 if length < _ZERO_LENGTH else direction @ covariance @ direction / length**2
    return float(np.sqrt(variance)) if variance >= 0 else float("nan")


def _chi2(error: np.ndarray, covariance: Matrix66) -> tuple[float, float]:
    from scipy.special import chdtrc

    if not np.isfinite(covariance).all() or np.linalg.matrix_rank(covariance, hermitian=True) < 6:
        return float("nan"), float("nan")
    chi2 = float(error @ np.linalg.solve(covariance, error))
    return chi2, float(chdtrc(6, chi2))


def _pixels(
    a: ImportedCalibration, b: ImportedCalibration, camera: Camera, distance_m: float, covariance: Matrix66
) -> PixelDifference:
    """Compare the projections of points at one distance along the rays of a pixel grid."""
    columns, rows = np.linspace(0, camera.width_px - 1, _GRID), np.linspace(0, camera.height_px - 1, _GRID)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    points_camera_m = camera.rays(grid) * distance_m
    points_camera_m = points_camera_m[np.isfinite(points_camera_m).all(axis=1)]
    pixels, jacobian = camera.project_with_jacobian(points_camera_m)
    moved = camera.project(b.camera_from_radar @ (a.camera_from_radar.inverse() @ points_camera_m))
    apart = np.linalg.norm(moved - pixels, axis=1)
    apart = apart[np.isfinite(apart)]
    if not len(apart):
        return PixelDifference(distance_m, float("inf"), float("inf"), float("nan"))
    motion = np.stack([np.hstack([np.eye(3), -skew(point)]) for point in points_camera_m])
    by_pose = jacobian @ motion
    variances = np.einsum("nij,jk,nik->n", by_pose, covariance, by_pose)
    return PixelDifference(
        distance_m, float(np.sqrt(np.mean(apart**2))), float(apart.max()), float(np.sqrt(np.mean(variances)))
    )
