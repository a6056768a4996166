"""What the fleet needs of one calibration: whose it is, its pose, and which part of its uncertainty does not average out."""

from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Matrix66, Vector3, frozen_array
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.measurements import TimeNs
from calib_core.options import CameraPositionPrior
from calib_core.results import Calibration
from calib_core.results.calibration import CovarianceParts
from calib_core.results.verdict import degrees_of_freedom

CHI2_95 = 12.591587243743977
"""The 95 % quantile of chi2 with 6 degrees of freedom: the quantile of a covariance whose noise level is known."""

_ROUNDING, _EXCESS = 1e-12, 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class SessionPose:
    """One calibration of one vehicle, as the fleet sees it.

    Attributes:
        vehicle: its name.
        session: name of the session, or of its file.
        camera_from_radar: the pose.
        covariance: (6, 6) of the error (dt, dtheta) [m, rad], as `Calibration.covariance`.
        systematic: (6, 6) the part of the covariance that further sessions with the same sensors do not average out; the
            whole covariance if nothing was stated.
        of_tape: (6, 6) the part that the stated sigma of the measured camera position makes up; zeros without one.
        quantile: the factor on covariance that gives its 95 % ellipsoid.
        time_ns: of the session; None if unknown.
        radar_serial: of the radar; None if unknown.
        camera_serial: of the camera; None if unknown.
        camera: its intrinsics, for figures in the picture; None if unknown.
        reference_radar_m: (3,) the position in the radar frame where these are stated; None if unknown.
        measured: the camera position in the radar frame that was measured with a tape, and its standard deviation; None without.

    Raises:
        InputError: pose and covariance cannot be used: a number is not finite, or the covariance is singular.
    """

    vehicle: str
    session: str
    camera_from_radar: RigidTransform
    covariance: Matrix66
    systematic: Matrix66 = None  # type: ignore[assignment]
    quantile: float = CHI2_95
    time_ns: TimeNs | None = None
    radar_serial: str | None = None
    camera_serial: str | None = None
    camera: Camera | None = None
    reference_radar_m: Vector3 | None = None
    measured: CameraPositionPrior | None = None
    of_tape: Matrix66 = field(default_factory=lambda: np.zeros((6, 6)))

    def __post_init__(self) -> None:
        systematic = self.covariance if self.systematic is None else self.systematic
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))
        object.__setattr__(self, "systematic", frozen_array(systematic, (6, 6)))
        object.__setattr__(self, "of_tape", frozen_array(self.of_tape, (6, 6)))
        if self.reference_radar_m is not None:
            object.__setattr__(self, "reference_radar_m", frozen_array(self.reference_radar_m, (3,)))
        _check(self)

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the estimated noise level that the quantile states; very many if it was known."""
        return degrees_of_freedom(self.quantile)

    @property
    def sensors(self) -> tuple[str | None, str | None]:
        """The serials of radar and camera."""
        return self.radar_serial, self.camera_serial


def _check(pose: SessionPose) -> None:
    where = f"vehicle {pose.vehicle!r}, session {pose.session!r}"
    stated = pose.systematic + pose.of_tape
    if not (np.isfinite(pose.covariance).all() and np.isfinite(stated).all()):
        raise InputError(
            f"{where}: the calibration states no uncertainty, so it cannot be weighed; solve it with the default method"
        )
    scale = np.sqrt(np.maximum(np.diag(pose.covariance), 1e-300))
    if np.linalg.eigvalsh(pose.covariance / np.outer(scale, scale))[0] <= _ROUNDING:
        raise InputError(f"{where}: the covariance is singular; export the calibration again with all digits")
    if np.linalg.eigvalsh((pose.covariance - stated) / np.outer(scale, scale))[0] < -_EXCESS:
        raise InputError(
            f"{where}: the parts of the covariance that rest on stated sigmas exceed it; solve the session again"
        )


def session_pose(
    calibration: Calibration,
    *,
    vehicle: str,
    session: str,
    time_ns: TimeNs | None = None,
    radar_serial: str | None = None,
    camera_serial: str | None = None,
) -> SessionPose:
    """Take from a calibration what the fleet needs.

    Errors that all pairs share (the radar's scales and range, the lens, clicks and reflector) are the same ones in the next
    session with these sensors, so further sessions do not average them out; `Calibration.covariance_parts` says what they come
    to. Where a file does not state that, all of its covariance is taken.

    Args:
        calibration: with a covariance.
        vehicle: its name.
        session: name of the session, or of its file.
        time_ns: of the session.
        radar_serial: of the radar.
        camera_serial: of the camera.

    Raises:
        InputError: the calibration states no uncertainty, or a singular one; or a fleet's prior, which hides scatter and
            remounts, drew its pose to the others'.
    """
    if any(warning.code == "rests-on-fleet-prior" for warning in calibration.warnings):
        raise InputError(
            f"vehicle {vehicle!r}, session {session!r}: an older version drew its pose to a fleet's prior; solve it again"
        )
    parts = calibration.covariance_parts or CovarianceParts(calibration.covariance, np.zeros((6, 6)))
    places_m = [pair.point_radar_m for pair in calibration.pairs if pair.inlier]
    return SessionPose(
        vehicle=vehicle,
        session=session,
        camera_from_radar=calibration.camera_from_radar,
        covariance=calibration.covariance,
        systematic=parts.systematic,
        quantile=calibration.covariance_quantile,
        time_ns=time_ns,
        radar_serial=radar_serial,
        camera_serial=camera_serial,
        camera=calibration.camera,
        reference_radar_m=np.median(places_m, axis=0) if places_m else None,
        measured=calibration.options.solving.camera_position,
        of_tape=parts.camera_position,
    )
