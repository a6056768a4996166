"""The difference between two calibrations, in degrees, centimetres, pixels and standard deviations; computed only here."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.geometry import pose_difference, squared_distance
from calib_core.interchange.check.pixel_differences import (
    DISTANCES_M,
    LOST_TEXT,
    LensDifference,
    PixelDifference,
    lenses_of,
    pixel_difference,
    pixels_text,
    shown,
)
from calib_core.interchange.imported import ImportedCalibration

CHI2_95 = 12.591587243743977
"""The 95 % quantile of chi2 with 6 degrees of freedom."""


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
        chi2_limit: what chi2 is below in 95 % of cases if the two are independent and right: the largest quantile they state.
        p_value: probability of a chi2 this large in that case; NaN if chi2 is.
        covariances: how many of the two covariances are known.
        sigmas: the same as p_value, as the standard deviations that one normal variable exceeds as rarely; NaN if chi2 is.
        lens: how far the two lenses are apart; None if one of the two states none.
        lens_note: what of the lenses is compared, if that is not all of them; else "".
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
    sigmas: float = float("nan")
    lens: LensDifference | None = None
    lens_note: str = ""
    chi2_limit: float = CHI2_95

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
        other_lens = self.lens is not None and not self.lens.same
        if self.lens is not None and other_lens:
            rows.append(ComparedFigure("lens", _lens_text(self.lens)))
        for at in self.pixels:
            by_pose = f", {_by_pose(at)} by the pose alone" if other_lens else ""
            expected = "" if np.isnan(at.sigma_px) else f", expected {at.sigma_px:.3g} px from the covariances"
            rows.append(ComparedFigure(f"at {at.distance_m:g} m", f"{pixels_text(at)}{by_pose}{expected}"))
        if np.isfinite(self.chi2):
            independent = f"(p = {self.p_value:.2g} if the two are independent, {self.sigmas:.3g} sigma)"
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
        if self.lens_note:
            rows.append(self.lens_note)
        if self.covariances == 1:
            rows.append("only one of the two uncertainties is known; the standard deviations come from that one alone")
        return tuple(rows)


def _lens_text(lens: LensDifference) -> str:
    if np.isnan(lens.rms_px):
        return f"another camera: {lens.text}"
    return f"{shown(lens.rms_px)} px rms, {shown(lens.max_px)} px max by the lens alone ({lens.text})"


def _by_pose(at: PixelDifference) -> str:
    return LOST_TEXT if np.isinf(at.pose_rms_px) else f"{shown(at.pose_rms_px)} px rms"


def _plus_minus(sigma: float, unit: str) -> str:
    return "" if np.isnan(sigma) else f" (standard deviation {sigma:.2g} {unit})"


def compare(a: ImportedCalibration, b: ImportedCalibration, *, camera: Camera | None = None) -> Comparison:
    """Compare two calibrations of the same sensors, each through its own lens; covariances are added, as for independent data.

    Args:
        a: one of them.
        b: the other.
        camera: the intrinsics, if neither has any.
    """
    a_pose, b_pose = a.camera_from_radar, b.camera_from_radar
    known = _known_covariances(a, b)
    covariance = np.sum(known, axis=0) if known else np.full((6, 6), np.nan)
    difference = pose_difference(a_pose, b_pose, covariance)
    limit = _chi2_limit(a, b)
    likelihood = difference.squared * CHI2_95 / limit  # a larger quantile stands for heavier tails: 5 % are beyond it
    lenses = lenses_of(a, b, camera)
    return Comparison(
        rotation_deg=difference.rotation_deg,
        rotation_sigma_deg=difference.rotation_sigma_deg,
        position_cm=difference.position_cm,
        position_sigma_cm=difference.position_sigma_cm,
        pixels=tuple(pixel_difference(a_pose, b_pose, lenses, distance_m, covariance) for distance_m in DISTANCES_M)
        if lenses
        else (),
        chi2=difference.squared,
        p_value=_p_value(likelihood),
        covariances=len(known),
        beyond=(_beyond(a, difference.error), _beyond(b, a_pose.error_from(b_pose))),
        sigmas=_sigmas(likelihood),
        chi2_limit=limit,
        lens=lenses.difference if lenses else None,
        lens_note=lenses.note if lenses else "",
    )


def _beyond(side: ImportedCalibration, error: np.ndarray) -> bool | None:
    """Return whether an error (6,) of a pose is outside its 95 % ellipsoid; None if it states none."""
    if side.file is None:
        return None
    squared = squared_distance(error, side.file.calibration.covariance)
    quantile = side.file.calibration.covariance_quantile
    return squared > quantile if np.isfinite(squared) and np.isfinite(quantile) else None


def _known_covariances(a: ImportedCalibration, b: ImportedCalibration) -> list[Matrix66]:
    return [
        side.file.calibration.covariance
        for side in (a, b)
        if side.file is not None and np.isfinite(side.file.calibration.covariance).all()
    ]


def _chi2_limit(a: ImportedCalibration, b: ImportedCalibration) -> float:
    quantiles = [side.file.calibration.covariance_quantile for side in (a, b) if side.file is not None]
    return max(CHI2_95, *(quantile for quantile in quantiles if np.isfinite(quantile)), CHI2_95)


def _p_value(chi2: float) -> float:
    from scipy.special import chdtrc

    return float(chdtrc(6, chi2)) if np.isfinite(chi2) else float("nan")


def _sigmas(chi2: float) -> float:
    """Return how many standard deviations one normal variable exceeds as rarely as chi2 of 6 degrees of freedom is exceeded."""
    from scipy.special import ndtri_exp

    half = chi2 / 2.0
    tail = np.log1p(half + half**2 / 2.0) - half  # of 6 degrees of freedom; p itself is 0 in floating point beyond 1500
    return max(0.0, float(-ndtri_exp(tail - np.log(2.0)))) if np.isfinite(chi2) else float("nan")
