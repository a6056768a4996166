"""What the pairs say, as arrays, and the linear model that every solver stage shares.

A pair is a pixel z with covariance C = sigma_px^2 I, and a measured polar position m = (range, azimuth, elevation) with
covariance V = diag(sigma_polar^2). With pi the projection and p(mu) the Cartesian position of polar mu, the model is

    z = pi(R p(mu) + t) + noise(C),    m = mu + noise(V).                                                  (1)

Linearised at a true position mu, with J = d pi / d mu and e = z - pi(R p(mu) + t) - J (m - mu), the unknown positions
drop out (the Schur complement of the joint problem):

    e ~ N(0, S),    S = C + J V J^T.                                                                       (2)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33, Points2, Points3, TimesNs, Values, Vector3, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, skew
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar, cartesian_jacobian, polar_from_cartesian

__all__ = ["CameraBelief", "Evidence", "Linearised", "evidence_of", "linearise", "with_respect_to_pose"]

_FLAT_SIGMA_RAD = np.deg2rad(10.0)  # elevation of a radar that always reports 0: unknown, not zero
_FAR = 1e6  # whitened residual of a position the camera cannot see


@dataclass(frozen=True, slots=True, eq=False)
class CameraBelief:
    """What is known of the camera centre before any pair.

    Attributes:
        position_m: (3,) in the radar frame.
        sigma_m: per axis.
        measured: a tape measure said so, and the estimate leans on it; otherwise it only chooses between poses,
            and what it adds to the estimate fades with the distance.
    """

    position_m: Vector3
    sigma_m: float
    measured: bool

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_m", frozen_array(self.position_m, (3,)))

    def rows(self, camera_from_radar: RigidTransform) -> tuple[Vector3, Matrix33]:
        """Return the whitened residual (3,) and its Jacobian (3, 6) with respect to (dt, dtheta).

        The centre is c = -R^T t, so dc = -R^T dt - R^T [t]x dtheta.
        """
        rotation, translation_m = camera_from_radar.rotation, camera_from_radar.translation_m
        away_m = self.position_m + rotation.T @ translation_m
        sigma_m = self.sigma_m if self.measured else float(np.sqrt(self.sigma_m**2 + away_m @ away_m))
        jacobian = np.concatenate([-rotation.T, -rotation.T @ skew(translation_m)], axis=1)
        return away_m / sigma_m, jacobian / sigma_m

    def freed(self) -> "CameraBelief":
        """Return the same position as a guess only, a metre or more wide."""
        return replace(self, sigma_m=max(self.sigma_m, 1.0), measured=False)

    def cost(self, camera_from_radar: RigidTransform) -> float:
        """Return twice the negative log-probability of a pose's camera centre, up to a constant."""
        away_m = self.position_m + camera_from_radar.rotation.T @ camera_from_radar.translation_m
        return float(away_m @ away_m) / self.sigma_m**2


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """All pairs as columns; pair i owns the candidate rows first[i] to first[i + 1].

    Attributes:
        camera: the intrinsics.
        pixels_px: (n, 2) clicks.
        sigma_px: (n,) their standard deviation per axis.
        first: (n + 1,).
        polar: (m, 3) measured range [m], azimuth, elevation [rad] of the candidates.
        sigma_polar: (m, 3) their standard deviations.
        log_score: (m,) logarithm of each candidate's plausibility before any pose.
        belief: what is known of the camera centre.
    """

    camera: Camera
    pixels_px: Points2
    sigma_px: Values
    first: TimesNs
    polar: Points3
    sigma_polar: Points3
    log_score: Values
    belief: CameraBelief

    def __len__(self) -> int:
        return len(self.pixels_px)

    @property
    def owner(self) -> TimesNs:
        """The pair that owns each candidate row: (m,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    @property
    def one_to_one(self) -> bool:
        """Every pair has a single candidate: there is nothing to associate."""
        return len(self.polar) == len(self)

    def some(self, pairs: TimesNs) -> "Evidence":
        """Keep the pairs of the given indices, with their candidates."""
        rows = np.concatenate([np.arange(self.first[i], self.first[i + 1]) for i in pairs])
        return replace(
            self,
            pixels_px=self.pixels_px[pairs],
            sigma_px=self.sigma_px[pairs],
            first=np.concatenate([[0], np.cumsum(np.diff(self.first)[pairs])]),
            polar=self.polar[rows],
            sigma_polar=self.sigma_polar[rows],
            log_score=self.log_score[rows],
        )

    def candidates_apart(self) -> "Evidence":
        """Make every candidate a pair of its own, with its pair's click."""
        owner = self.owner
        first = np.arange(len(owner) + 1)
        return replace(self, pixels_px=self.pixels_px[owner], sigma_px=self.sigma_px[owner], first=first)

    def mirrored(self) -> "Evidence":
        """Return what the pairs would be if the radar's y axis pointed the other way."""
        left_right = np.array([1.0, -1.0, 1.0])
        belief = replace(self.belief, position_m=self.belief.position_m * left_right)
        return replace(self, polar=self.polar * left_right, belief=belief)

    def scaled(self, noise_scale: Sequence[float] | Values) -> "Evidence":
        """Multiply the assumed sigmas of (click, range, azimuth, elevation)."""
        scale = np.asarray(noise_scale, dtype=np.float64)
        return replace(self, sigma_px=self.sigma_px * scale[0], sigma_polar=self.sigma_polar * scale[1:])


def evidence_of(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions) -> Evidence:
    """Stack pairs into arrays; a missing click sigma becomes the assumed one."""
    candidates = [candidate for pair in pairs for candidate in pair.candidates]
    points = np.array([candidate.position_radar_m for candidate in candidates]).reshape(-1, 3)
    sigma_polar = np.array([candidate.sigma_polar for candidate in candidates]).reshape(-1, 3)
    if len(points) and not points[:, 2].any():
        sigma_polar[:, 2] = np.maximum(sigma_polar[:, 2], _FLAT_SIGMA_RAD)
    score = np.array([candidate.score for candidate in candidates])
    sigma_px = [options.noise.sigma_px if pair.sigma_px is None else pair.sigma_px for pair in pairs]
    return Evidence(
        camera=camera,
        pixels_px=np.array([pair.pixel_px for pair in pairs]).reshape(-1, 2),
        sigma_px=np.array(sigma_px, dtype=np.float64),
        first=np.concatenate([[0], np.cumsum([len(pair.candidates) for pair in pairs])]).astype(np.int64),
        polar=polar_from_cartesian(points),
        sigma_polar=sigma_polar,
        log_score=np.log(np.clip(score, 1e-6, 1.0)),
        belief=_belief(options),
    )


def _belief(options: CalibrationOptions) -> CameraBelief:
    measured = options.solving.camera_position
    if measured is None:
        return CameraBelief(np.zeros(3), options.solving.nominal_camera_distance_m, measured=False)
    return CameraBelief(np.array(measured.position_m), measured.sigma_m, measured=True)


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """Equation (2) at one pose, whitened by W with W S W^T = I, so that plain least squares is maximum likelihood.

    Attributes:
        residual: (n, 2) W e.
        pose_jacobian: (n, 2, 6) W d pixel / d (dt, dtheta).
        point_jacobian: (n, 2, 3) W d pixel / d polar.
        log_determinant: (n,) of S.
        whitening: (n, 2, 2) W.
    """

    residual: Points2
    pose_jacobian: np.ndarray
    point_jacobian: np.ndarray
    log_determinant: Values
    whitening: np.ndarray

    @property
    def squared(self) -> Values:
        """Squared Mahalanobis distance of each residual: (n,)."""
        return np.asarray(self.residual[:, 0] ** 2 + self.residual[:, 1] ** 2)


def linearise(
    camera_from_radar: RigidTransform,
    camera: Camera,
    *,
    pixels_px: Points2,
    sigma_px: Values,
    polar: Points3,
    sigma_polar: Points3,
    at_polar: Points3 | None = None,
) -> Linearised:
    """Linearise and whiten the projection of measured positions about a pose.

    Args:
        camera_from_radar: the pose.
        camera: the intrinsics.
        pixels_px: (n, 2) clicks.
        sigma_px: (n,).
        polar: (n, 3) measured range [m], azimuth, elevation [rad].
        sigma_polar: (n, 3).
        at_polar: (n, 3) the true positions mu to linearise at; None takes the measured ones.
    """
    mu = polar if at_polar is None else at_polar
    turned_m = cartesian_from_polar(mu) @ camera_from_radar.rotation.T
    projected_px, d_point = camera.project_with_jacobian(turned_m + camera_from_radar.translation_m)
    point_jacobian = d_point @ (camera_from_radar.rotation @ cartesian_jacobian(mu))
    residual_px = pixels_px - projected_px
    if at_polar is not None:
        residual_px = residual_px - (point_jacobian @ (polar - mu)[:, :, None])[:, :, 0]
    whitening, log_determinant = _whitening(point_jacobian, sigma_px, sigma_polar)
    residual = (whitening @ residual_px[:, :, None])[:, :, 0]
    pose_jacobian = with_respect_to_pose(d_point, turned_m)
    unseen = ~np.isfinite(residual).all(axis=1)
    return Linearised(
        residual=np.where(unseen[:, None], _FAR, residual),
        pose_jacobian=_cleared(whitening @ pose_jacobian, unseen),
        point_jacobian=_cleared(whitening @ point_jacobian, unseen),
        log_determinant=np.where(unseen, 0.0, log_determinant),
        whitening=_cleared(whitening, unseen),
    )


def with_respect_to_pose(d_point: np.ndarray, turned_m: Points3) -> np.ndarray:
    """Turn d pixel / d camera point (n, 2, 3) into d pixel / d (dt, dtheta) (n, 2, 6).

    With R = Exp(dtheta) R_hat, d (R p) / d theta = -[R p]x; a row j times -[q]x is the cross product q x j.

    Args:
        d_point: (n, 2, 3) [px/m].
        turned_m: (n, 3) R p, the points in camera axes before the translation.
    """
    x, y, z = turned_m[:, 0, None], turned_m[:, 1, None], turned_m[:, 2, None]
    a, b, c = d_point[:, :, 0], d_point[:, :, 1], d_point[:, :, 2]
    return np.stack([a, b, c, y * c - z * b, z * a - x * c, x * b - y * a], axis=2)


def _cleared(rows: np.ndarray, unseen: np.ndarray) -> np.ndarray:
    return np.where(unseen[:, None, None], 0.0, rows) if unseen.any() else rows


def _whitening(point_jacobian: np.ndarray, sigma_px: Values, sigma_polar: Points3) -> tuple[np.ndarray, Values]:
    """Return W with W S W^T = I for S = C + J V J^T by the Cholesky factor of the 2 x 2, and log det S."""
    noisy = point_jacobian * sigma_polar[:, None, :]
    click = sigma_px**2
    uu = (noisy[:, 0] ** 2).sum(axis=1) + click
    uv = (noisy[:, 0] * noisy[:, 1]).sum(axis=1)
    vv = (noisy[:, 1] ** 2).sum(axis=1) + click
    a = np.sqrt(uu)
    b = uv / a
    c = np.sqrt(vv - b * b)
    whitening = np.zeros((len(uu), 2, 2))
    whitening[:, 0, 0] = 1.0 / a
    whitening[:, 1, 0] = -b / (a * c)
    whitening[:, 1, 1] = 1.0 / c
    return whitening, 2.0 * (np.log(a) + np.log(c))
