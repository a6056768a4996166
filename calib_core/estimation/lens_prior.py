"""Lens prior: how the intrinsics may be wrong together, as independent errors along the axes of their joint covariance.

With C the covariance of the lens errors l and A A^T = C, l = A u with u ~ N(0, I). The estimate knows only u, one independent
error of standard deviation 1 each, so that correlated intrinsics need no more than independent ones, and a covariance
without full rank (both focal lengths tied to one another) is no special case. What is reported is l, by name.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values, frozen_array
from calib_core.camera import Camera, CameraCovariance
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions

PRIOR_WIDTH_PX = 1920.0
"""Width of the picture that the priors of the principal point are stated for."""

_EXACT = 1e-10  # variance along an axis, of the largest, up to which the covariance has no such axis
_LEAST_FOCAL_SHARE = 0.1  # of the given focal length, whatever the pairs say
_UNKNOWN_FOCAL_SHARE = 0.5  # of the focal length: a covariance that allows more is of something else
_UNKNOWN_CENTRE_SHARE = 0.5  # of the picture's width or height: the same of the principal point
_FOCAL = 2  # the first parameters of a camera are its focal lengths


@dataclass(frozen=True, slots=True, eq=False)
class LensPrior:
    """The q errors of the intrinsics.

    Attributes:
        camera: the given intrinsics.
        names: (q,) of the errors, as in files.
        moves: (p, q) change of the p `Camera.parameters` with each error.
        axes: (q, r) A, with A A^T the covariance of the errors.
    """

    camera: Camera
    names: tuple[str, ...]
    moves: np.ndarray
    axes: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "moves", frozen_array(self.moves, (None, len(self.names))))
        object.__setattr__(self, "axes", frozen_array(self.axes, (len(self.names), None)))

    def __len__(self) -> int:
        return self.axes.shape[1]

    @property
    def sigma(self) -> Values:
        """Standard deviations of the errors before any pair: (q,)."""
        return np.asarray(np.sqrt((self.axes**2).sum(axis=1)))

    @property
    def along_axes(self) -> np.ndarray:
        """Change of the camera's parameters along each axis: (p, r)."""
        return np.asarray(self.moves @ self.axes)

    def camera_at(self, values: Values, covariance: np.ndarray | None = None) -> Camera:
        """Return the intrinsics with errors of these values (r,) along the axes taken out.

        Args:
            values: along the axes.
            covariance: (r, r) of these values; None leaves the camera without one.
        """
        parameters = self.camera.parameters + self.along_axes @ values
        least = _LEAST_FOCAL_SHARE * self.camera.parameters[:_FOCAL]
        parameters[:_FOCAL] = np.maximum(parameters[:_FOCAL], least)
        return self.camera.with_parameters(parameters, None if covariance is None else self._known(covariance))

    def _known(self, covariance: np.ndarray) -> CameraCovariance:
        """Return the covariance of the camera's parameters that any error moves."""
        moved = self.moves.any(axis=1)
        along = self.along_axes[moved]
        names = tuple(self.camera.parameter_names[row] for row in np.flatnonzero(moved).tolist())
        matrix = along @ covariance @ along.T
        return CameraCovariance(names, (matrix + matrix.T) / 2.0)


def lens_prior(options: CalibrationOptions, camera: Camera) -> LensPrior | None:
    """Return the prior of the intrinsics: their own covariance, or the one to refine them with; None if there is neither.

    Args:
        options: which say whether the intrinsics are refined, and how far off they are if nobody said.
        camera: the given intrinsics.
    """
    if camera.covariance is not None:
        known = camera.covariance
        rows = [camera.parameter_names.index(name) for name in known.order]
        names = tuple(f"lens_{name}" for name in known.order)
        return LensPrior(camera, names, np.eye(len(camera.parameters))[:, rows], _root(known.matrix))
    if not options.refining.intrinsics:
        return None
    refining, count = options.refining, len(camera.parameters)
    principal_point_px = refining.principal_point_sigma_px * camera.width_px / PRIOR_WIDTH_PX
    sigma = [refining.focal_length_sigma, principal_point_px, principal_point_px, refining.distortion_sigma]
    names = ("focal_length", "principal_right_px", "principal_down_px", "distortion")
    moves = np.zeros((count, 4))
    moves[:_FOCAL, 0] = camera.parameters[:_FOCAL]
    moves[2, 1] = moves[3, 2] = 1.0
    moves[4:5, 3] = 1.0
    kept = [k for k in range(4) if moves[:, k].any()]  # a pinhole has no coefficient
    return LensPrior(
        camera, tuple(names[k] for k in kept), moves[:, kept], _root(np.diag(np.square(sigma))[kept][:, kept])
    )


def useless_covariance(camera: Camera, *, refining: bool) -> Unsolvable | None:
    """A covariance of the intrinsics that knows nothing of the lens, or leaves nothing to refine; None if neither."""
    known = camera.covariance
    if known is None:
        return None
    size_px = np.array([camera.width_px, camera.height_px])
    limits_px = [*(_UNKNOWN_FOCAL_SHARE * camera.parameters[:_FOCAL]), *(_UNKNOWN_CENTRE_SHARE * size_px)]
    for name, value_px, limit_px in zip(camera.parameter_names, camera.parameters, limits_px, strict=False):
        if (sigma_px := known.sigma(name)) > limit_px:
            return Unsolvable(
                "useless-lens-covariance",
                f"the camera's covariance says that {name}, {value_px:.0f} px, is known to ± {sigma_px:.0f} px, as if the lens "
                "had not been calibrated",
                "check the covariance's order and units (variances in px²), remove it, or calibrate the lens with a board",
            )
    if refining and not known.matrix.diagonal().any():
        return Unsolvable(
            "useless-lens-covariance",
            "the intrinsics are to be refined, but the camera's covariance says that they are exact",
            "turn refining off, or remove the covariance, to refine them with the sigmas of the refining options",
        )
    return None


def _root(covariance: np.ndarray) -> np.ndarray:
    """Return A (q, r) with A A^T the covariance (q, q) of rank r."""
    sigma = np.sqrt(np.diag(covariance))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > _EXACT * values.max(initial=0.0)
    return np.asarray(scale[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


def shared_out(mixed: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Divide what correlated errors do to a pose among them: (6, q), not negative, adding up to what all of them do.

    Of the errors made uncorrelated by the symmetric root of their correlation, each is nearest to the one it stands for.

    Args:
        mixed: (6, q) covariance of pose and errors.
        covariance: (q, q) of the errors, which need not have full rank.
    """
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > _EXACT * values.max(initial=0.0)
    whitened = (vectors[:, kept] / np.sqrt(values[kept])) @ vectors[:, kept].T
    return np.asarray((mixed / scale @ whitened) ** 2)
