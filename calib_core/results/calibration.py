"""The result of a calibration: the pose, its uncertainty, metrics, warnings, and each pair's residual."""

from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Self

import msgspec
import numpy as np

from calib_core.arrays import Matrix66, Points2, Points3, Vector2, Vector3, freeze, frozen_array
from calib_core.camera import Camera
from calib_core.errors import InputError, in_words
from calib_core.geometry import RigidTransform
from calib_core.json_forms import Count, Figure, Name, Share
from calib_core.measurements import DataWarning, Pair, TimeNs, Unpaired
from calib_core.options import CalibrationOptions
from calib_core.radar import AngleMap, RadarErrors
from calib_core.results.radar_axes import bias_moves, without_mounting
from calib_core.results.systematic_errors import (
    DominantError,
    SystematicErrorResult,
    dominant_errors,
    rescaled,
)

CHI2_95_2, CHI2_95_3, CHI2_95_6 = 5.991464547107979, 7.814727903251178, 12.591587243743977
"""95 % quantiles of chi-squared with 2, 3 and 6 degrees of freedom."""
CHI2_999_2 = 13.815510557964274
"""The 99.9 % quantile with 2 degrees of freedom."""
_ROUNDING = 1e-12
"""Least eigenvalue of a correlation matrix: a variance below it is rounding, which is 1e-16 times the largest, at most 6."""


@dataclass(frozen=True, slots=True, eq=False)
class CovarianceParts:
    """Two parts of a pose's covariance; what is left over is the scatter of the pairs. Their sum is at most the covariance.

    Attributes:
        systematic: (6, 6) from the errors that all pairs share, of radar, lens and clicks: another session with these sensors
            has them again.
        camera_position: (6, 6) from the measured camera position: another session has it again only if it is not measured anew;
            zeros without one.
    """

    systematic: Matrix66
    camera_position: Matrix66

    def __post_init__(self) -> None:
        freeze(self, systematic=(6, 6), camera_position=(6, 6))

    def within(self, covariance: Matrix66) -> "CovarianceParts":
        """Return the parts, made smaller by one factor if together they exceed a covariance (6, 6) along any axis.

        They are those of the fit; of a posterior that is not normal, the covariance is another one.
        """
        scale = np.sqrt(np.diag(covariance))
        values, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
        whitening = (axes / np.sqrt(np.maximum(values, _ROUNDING))).T / scale
        largest = float(np.linalg.eigvalsh(whitening @ (self.systematic + self.camera_position) @ whitening.T)[-1])
        if largest <= 1.0:
            return self
        return CovarianceParts(self.systematic / largest, self.camera_position / largest)


class UnconfirmedClicks(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"ids": "clicks"}):
    """The ids of clicks that were placed automatically and that nobody confirmed, and the confidence that they are right.

    Attributes:
        ids: of these clicks.
        confidence: 0 to 1, as it was judged when they were placed.
    """

    ids: tuple[Name, ...]
    confidence: Share


@dataclass(frozen=True, slots=True)
class InputFile:
    """An input file.

    Attributes:
        name: without its folder.
        size_bytes: its length.
        sha256: of its content, or of that of the files of a folder in order of their names; in hexadecimal.
    """

    name: str
    size_bytes: Count
    sha256: str


@dataclass(frozen=True, slots=True)
class Metrics:
    """Figures over the inlier pairs; null if unknown.

    Attributes:
        aed_px: average Euclidean distance, divided by N (paper, AED).
        cdsd_px: corrected standard deviation of the distances, divided by N - 1 (paper, CDSD); NaN below 2 pairs.
        rms_px: root mean square distance.
        held_out_aed_px: AED with each pair predicted from the others (leave-one-out); NaN if not computed.
        picture_sigma_px: standard deviation per axis of a reprojection at the placements; NaN if not computed.
        acc: share of reprojected points inside detection boxes (paper, Acc), 0 to 1; None without boxes.
        n: number of pairs.
        chi2: sum of squared whitened residuals; NaN if the method has no noise model.
        degrees_of_freedom: of chi2.
    """

    aed_px: Figure = float("nan")
    cdsd_px: Figure = float("nan")
    rms_px: Figure = float("nan")
    _: KW_ONLY
    held_out_aed_px: Figure = float("nan")
    acc: float | None = None
    n: Count = 0
    chi2: Figure = float("nan")
    degrees_of_freedom: Count = 0
    picture_sigma_px: Figure = float("nan")


@dataclass(frozen=True, slots=True, eq=False)
class PairResult:
    """One pair under the solved pose.

    Attributes:
        id: the click's id.
        pixel_px: (2,) the click.
        projected_px: (2,) the chosen radar position, corrected by radar_errors, projected through camera_from_radar; NaN if
            it lies behind the camera.
        point_radar_m: (3,) the chosen radar position as measured.
        inlier: it took part in the final pose.
        excluded: the user left it out.
        outlier_probability: 0 to 1; NaN if the method has none.
        influence: how far leaving it out moves the pose, in standard deviations; NaN if not computed.
        held_out_px: distance from the click to where the other pairs predict it; NaN if not computed, and in files.
        candidate: which of the pair's candidates was chosen.
        rival: which other one explains the click as well, so that somebody must choose; -1 if there is none.
        expected_covariance_px2: (2, 2) covariance of the residual under the noise model; NaN if there is none.
        image_time: stamp of the clicked frame; None for pairs from a pairs file.
        measured: the pair it came from, with all its candidates, as needed to solve again; None if it was not kept.
    """

    id: str
    pixel_px: Vector2
    projected_px: Vector2
    point_radar_m: Vector3
    inlier: bool
    excluded: bool = False
    outlier_probability: float = float("nan")
    influence: float = float("nan")
    candidate: int = 0
    expected_covariance_px2: Points2 = field(default_factory=lambda: frozen_array([[float("nan")] * 2] * 2, (2, 2)))
    image_time: TimeNs | None = None
    measured: Pair | None = None
    held_out_px: float = float("nan")
    rival: int = -1

    def __post_init__(self) -> None:
        freeze(self, pixel_px=(2,), projected_px=(2,), point_radar_m=(3,), expected_covariance_px2=(2, 2))

    @property
    def residual_px(self) -> Vector2:
        """The reprojection minus the click: (2,) [px]."""
        return self.projected_px - self.pixel_px

    @property
    def distance_px(self) -> float:
        """The length of the residual [px]: e_i of the paper's AED."""
        return float((self.residual_px**2).sum() ** 0.5)


@dataclass(frozen=True, slots=True, eq=False)
class CheckPoint:
    """A radar point and the pixel it must project to, so that a reader of the file can verify the transform's direction."""

    radar_m: Vector3
    pixel_px: Vector2

    def __post_init__(self) -> None:
        freeze(self, radar_m=(3,), pixel_px=(2,))


@dataclass(frozen=True, slots=True, eq=False)
class NextPlacement:
    """The advised next placement and its expected gain.

    Attributes:
        position_radar_m: (3,) in the radar frame.
        pixel_px: (2,) where it appears in the image.
        gain: present over expected uncertainty (standard deviations), at least 1.
        may_stop: no further placement would reduce the uncertainty noticeably.
    """

    position_radar_m: Vector3
    pixel_px: Vector2
    gain: float
    may_stop: bool

    def __post_init__(self) -> None:
        freeze(self, position_radar_m=(3,), pixel_px=(2,))


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A solved extrinsic calibration: p_camera = R p_radar + t.

    p_radar is the true position; a reported one is first corrected by radar_errors.

    Attributes:
        camera_from_radar: the pose.
        covariance: (6, 6) of the error (dt, dtheta) [m, rad], t = t_hat + dt, R = Exp(dtheta) R_hat; NaN where unknown.
        camera: the intrinsics it was solved with; if they were refined, the refined ones with their covariance.
        metrics: the figures.
        pairs: in order of image time, excluded ones included.
        unpaired: clicks without a radar position.
        warnings: what to know before using it.
        options: the options it was solved with.
        noise_scale: estimated over assumed standard deviation of (click, range, azimuth, elevation); ones if not estimated.
        covariance_quantile: the factor on covariance that gives the 95 % ellipsoid of the 6 parameters.
        iterative_px: Algorithm 1 of the paper only: mean reprojection error of RANSAC with the iterative solver.
        sqpnp_px: the same with SQPnP.
        angle_map: the radar's smooth angle errors; None if correcting them gains nothing.
        next_placement: where the next placement would help most; None if no place is known.
        radar_errors: the radar's systematic errors, estimated with the pose.
        systematic_errors: every error that the pairs share, and its part in the uncertainty.
        checking: whether this is a preview: its warnings and advice are those of the previous answer.
        given_camera: the intrinsics before they were refined; None if they were not.
        covariance_parts: what of the covariance rests on stated standard deviations; None if unknown.
    """

    camera_from_radar: RigidTransform
    covariance: Matrix66
    camera: Camera
    metrics: Metrics
    pairs: tuple[PairResult, ...]
    unpaired: tuple[Unpaired, ...]
    warnings: tuple[DataWarning, ...]
    options: CalibrationOptions
    noise_scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    covariance_quantile: float = CHI2_95_6
    iterative_px: float = float("nan")
    sqpnp_px: float = float("nan")
    angle_map: AngleMap | None = None
    next_placement: NextPlacement | None = None
    radar_errors: RadarErrors = field(default_factory=RadarErrors)
    systematic_errors: tuple[SystematicErrorResult, ...] = ()
    checking: bool = False
    given_camera: Camera | None = None
    covariance_parts: CovarianceParts | None = None

    def __post_init__(self) -> None:
        freeze(self, covariance=(6, 6))

    def reproject(self, points_radar_m: Points3) -> Points2:
        """Project positions (n, 3) [m] as the radar reports them to pixels (n, 2); NaN where the lens does not see them."""
        return self.camera.project(self.camera_from_radar @ self.radar_errors.corrected(points_radar_m))

    def pixel_covariance(self, points_radar_m: Points3) -> np.ndarray:
        """Return the covariance (n, 2, 2) [px^2] of where true radar points project; NaN where the lens does not see them.

        It covers the uncertainty of the pose only, for a radar without elevation that of the map from its plane to the image;
        the noise of a measured radar position is not included.

        Args:
            points_radar_m: (n, 3).

        Raises:
            InputError: the points have another shape.
        """
        points = np.asarray(points_radar_m, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"points_radar_m: expected an array of n x 3, got {' x '.join(map(str, points.shape))}")
        jacobian = self.camera.pose_jacobian(self.camera_from_radar, points)
        return np.asarray(jacobian @ self.firm_covariance @ np.swapaxes(jacobian, 1, 2))

    def pixel_sigma(self, points_radar_m: Points3) -> Points2:
        """Return the standard deviations (n, 2) [px] of column and row where true radar points (n, 3) [m] project."""
        return np.sqrt(np.diagonal(self.pixel_covariance(points_radar_m), axis1=1, axis2=2))

    @property
    def prior_camera(self) -> Camera:
        """The camera, as well known as it was before any pair: to weigh these pairs, or others, with it once more."""
        given = self.given_camera
        return self.camera if given is None else replace(self.camera, covariance=given.covariance)

    @property
    def sees_elevation(self) -> bool:
        """Whether the radar measures elevation; if not, tilt and height of the pose rest on assumptions."""
        return all(warning.code != "flat-radar" for warning in self.warnings)

    @property
    def firm_covariance(self) -> Matrix66:
        """The covariance (6, 6) without what no pair can show: tilt and height of a radar that measures no elevation."""
        if self.sees_elevation or not np.isfinite(self.covariance).all():
            return self.covariance
        height_m = float(np.median([pair.point_radar_m[2] for pair in self.pairs if pair.inlier]))
        return without_mounting(self.camera_from_radar, self.covariance, height_m, self.options.radar)

    @property
    def housing_covariance(self) -> Matrix66:
        """The covariance (6, 6) of the pose of the radar's housing: constant angle errors of the radar are included."""
        moves = bias_moves(self.camera_from_radar, self.options.radar)
        return np.asarray(self.covariance + moves @ moves.T)

    @property
    def errors_of_firm(self) -> tuple[SystematicErrorResult, ...]:
        """The systematic errors, with their shares of the firm covariance."""
        stated, firm = np.diag(self.covariance), np.diag(self.firm_covariance)
        position, rotation = (stated[part].sum() / firm[part].sum() for part in (slice(0, 3), slice(3, 6)))
        return rescaled(self.systematic_errors, float(position), float(rotation))

    def dominant_errors(self) -> tuple[DominantError, ...]:
        """Name the errors that make up a third or more of the uncertainty."""
        return dominant_errors(self.errors_of_firm, self.firm_covariance)

    def unwrap(self) -> Self:
        """Return itself; `Unsolvable.unwrap` raises."""
        return self

    def __str__(self) -> str:
        return in_words(self)
