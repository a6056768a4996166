"""Measurement model: the measured pairs and the camera prior as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Matrix33, Points2, Points3, Values, Vector3, frozen_array
from calib_core.camera import Camera
from calib_core.estimation.linearization import MeasurementPlanes
from calib_core.geometry import RigidTransform, skew
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions
from calib_core.radar import polar_from_cartesian

__all__ = ["CameraPrior", "PairMeasurements", "pair_measurements"]

_FLAT_SIGMA_RAD = np.deg2rad(10.0)  # elevation of a radar that always reports 0: unknown, not zero


@dataclass(frozen=True, slots=True, eq=False)
class CameraPrior:
    """The prior of the camera centre, known before any pair.

    Attributes:
        position_m: (3,) in the radar frame.
        sigma_m: per axis.
        measured: whether it was measured with a tape and is fully used by the estimate; otherwise it only selects between
            poses, and its weight in the estimate decreases with the distance.
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

    def information(self, rotations: np.ndarray, translations_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return J^T J (..., 6, 6) and J^T residual (..., 6) of `rows` at poses (..., 3, 3) and (..., 3).

        In camera axes the residual is -(R c0 + t) and its Jacobian (I, [t]x): the same up to a rotation, which cancels.
        """
        missed = -(rotations @ self.position_m + translations_m)
        variance = self.sigma_m**2
        if not self.measured:
            variance = variance + (missed**2).sum(axis=-1)[..., None]
        x, y, z = translations_m[..., 0], translations_m[..., 1], translations_m[..., 2]
        jacobian = np.zeros((*translations_m.shape, 6))
        jacobian[..., 0, 0] = jacobian[..., 1, 1] = jacobian[..., 2, 2] = 1.0
        jacobian[..., 0, 4], jacobian[..., 0, 5], jacobian[..., 1, 5] = -z, y, -x
        jacobian[..., 1, 3], jacobian[..., 2, 3], jacobian[..., 2, 4] = z, -y, x
        turned = np.swapaxes(jacobian, -1, -2)
        gradient = (turned @ missed[..., None])[..., 0] / variance
        return (turned @ jacobian) / np.asarray(variance)[..., None], gradient

    def weakened(self) -> "CameraPrior":
        """Return the same position as a weak prior, with a sigma of at least 1 m."""
        return replace(self, sigma_m=max(self.sigma_m, 1.0), measured=False)

    def costs(self, rotations: np.ndarray, translations_m: np.ndarray) -> Values:
        """Return twice the negative log-probability of each pose's camera centre (s,), up to a constant."""
        return np.asarray(((rotations @ self.position_m + translations_m) ** 2).sum(axis=-1) / self.sigma_m**2)


@dataclass(frozen=True, slots=True, eq=False)
class PairMeasurements:
    """All pairs as columns; pair i owns the candidate rows first[i] to first[i + 1].

    Attributes:
        camera: the intrinsics.
        pixels_px: (n, 2) clicks.
        sigma_px: (n,) their standard deviation per axis.
        rays: (n, 3) unit directions of the clicks in the camera frame; NaN where the lens model has none.
        first: (n + 1,).
        polar: (m, 3) measured range [m], azimuth, elevation [rad] of the candidates.
        sigma_polar: (m, 3) their standard deviations.
        log_score: (m,) logarithm of each candidate's plausibility before any pose.
        prior: of the camera centre.
    """

    camera: Camera
    pixels_px: Points2
    sigma_px: Values
    rays: Points3
    first: Indices
    polar: Points3
    sigma_polar: Points3
    log_score: Values
    prior: CameraPrior

    def __len__(self) -> int:
        return len(self.pixels_px)

    @property
    def owner(self) -> Indices:
        """The pair that owns each candidate row: (m,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    @property
    def one_to_one(self) -> bool:
        """Whether every pair has a single candidate, so that there is nothing to associate."""
        return len(self.polar) == len(self)

    def some(self, pairs: Indices) -> "PairMeasurements":
        """Keep the pairs of the given indices, with their candidates."""
        rows = pairs if self.one_to_one else np.concatenate([np.arange(*self.first[i : i + 2]) for i in pairs])
        return replace(
            self,
            pixels_px=self.pixels_px[pairs],
            sigma_px=self.sigma_px[pairs],
            rays=self.rays[pairs],
            first=np.concatenate([[0], np.cumsum(np.diff(self.first)[pairs])]),
            polar=self.polar[rows],
            sigma_polar=self.sigma_polar[rows],
            log_score=self.log_score[rows],
        )

    def measured(self, rows: Indices) -> MeasurementPlanes:
        """Take one candidate row per pair (n,), as planes."""
        return MeasurementPlanes(
            self.pixels_px.T.copy(), self.sigma_px, self.polar[rows].T.copy(), self.sigma_polar[rows].T.copy()
        )

    def candidates_apart(self) -> "PairMeasurements":
        """Make every candidate a pair of its own, with its pair's click."""
        owner = self.owner
        return replace(
            self,
            pixels_px=self.pixels_px[owner],
            sigma_px=self.sigma_px[owner],
            rays=self.rays[owner],
            first=np.arange(len(owner) + 1),
        )

    def mirrored(self) -> "PairMeasurements":
        """Return the pairs with the radar's y axis mirrored."""
        left_right = np.array([1.0, -1.0, 1.0])
        prior = replace(self.prior, position_m=self.prior.position_m * left_right)
        return replace(self, polar=self.polar * left_right, prior=prior)

    def scaled(self, noise_scale: Sequence[float] | Values) -> "PairMeasurements":
        """Multiply the assumed sigmas of (click, range, azimuth, elevation)."""
        scale = np.asarray(noise_scale, dtype=np.float64)
        return replace(self, sigma_px=self.sigma_px * scale[0], sigma_polar=self.sigma_polar * scale[1:])


def pair_measurements(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions) -> PairMeasurements:
    """Stack pairs into arrays; a missing click sigma is replaced by the assumed one."""
    candidates = [candidate for pair in pairs for candidate in pair.candidates]
    points = np.array([candidate.position_radar_m for candidate in candidates]).reshape(-1, 3)
    sigma_polar = np.array([candidate.sigma_polar for candidate in candidates]).reshape(-1, 3)
    if len(points) and not points[:, 2].any():
        sigma_polar[:, 2] = np.maximum(sigma_polar[:, 2], _FLAT_SIGMA_RAD)
    score = np.array([candidate.score for candidate in candidates])
    sigma_px = [options.noise.sigma_px if pair.sigma_px is None else pair.sigma_px for pair in pairs]
    pixels_px = np.array([pair.pixel_px for pair in pairs]).reshape(-1, 2)
    return PairMeasurements(
        camera=camera,
        pixels_px=pixels_px,
        sigma_px=np.array(sigma_px, dtype=np.float64),
        rays=camera.rays(pixels_px),
        first=np.concatenate([[0], np.cumsum([len(pair.candidates) for pair in pairs])]).astype(np.int64),
        polar=polar_from_cartesian(points),
        sigma_polar=sigma_polar,
        log_score=np.log(np.clip(score, 1e-6, 1.0)),
        prior=_prior(options),
    )


def _prior(options: CalibrationOptions) -> CameraPrior:
    measured = options.solving.camera_position
    if measured is None:
        return CameraPrior(np.zeros(3), options.solving.nominal_camera_distance_m, measured=False)
    return CameraPrior(np.array(measured.position_m), measured.sigma_m, measured=True)
