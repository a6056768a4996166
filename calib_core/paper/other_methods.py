"""The paper's other methods, for its experiments: the mounting (PMM), the checkerboard (CCM), and exchanged translations.

PMM takes rotation and offset as designed or measured, and no data at all. CCM registers the radar positions of a reflector
on the corners of a checkerboard with those corners. An exchange combines the rotation of one calibration with the
translation of another, to see which of the two matters. None states an uncertainty.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Points2, Points3, frozen_array
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.estimation.measurement_model import linearize
from calib_core.estimation.plausibility import implausible_input
from calib_core.geometry import RigidTransform, mounting_rotation
from calib_core.measurements import Pair, Unpaired
from calib_core.options import CalibrationOptions
from calib_core.radar import polar_from_cartesian, sigma_polar_of
from calib_core.results import Calibration, DataWarning, PairResult
from calib_core.results.metrics import metrics_of

_EXPLAINED = 11.83  # chi2 of 2 degrees of freedom that noise exceeds in 0.27 % of the pairs


def calibrate_by_mounting(
    pairs: Sequence[Pair],
    camera: Camera,
    options: CalibrationOptions,
    *,
    excluded: frozenset[str] = frozenset(),
    unpaired: tuple[Unpaired, ...] = (),
) -> Calibration:
    """Return the pose of the mounting, judged on pairs that it does not depend on; there may be none.

    Args:
        pairs: in the order of the results.
        camera: the intrinsics.
        options: the mounting's angles, and the measured position of the camera.
        excluded: ids of pairs that are shown, but not judged on.
        unpaired: clicks without a radar position.

    Raises:
        InputError: the options state no measured position.
    """
    measured = options.solving.camera_position
    if measured is None:
        raise InputError(
            "the mounting (PMM) takes the camera's position from a tape measure, and none is given; measure from the radar's "
            "antennas to the lens: forward, left, up, in metres"
        )
    rotation = mounting_rotation(*astuple(options.mounting))
    pose = RigidTransform(rotation, -rotation @ np.array(measured.position_m))
    return judged(pose, pairs, unpaired, excluded, camera, options)


@dataclass(frozen=True, slots=True, eq=False)
class CheckerboardMatrix:
    """CCM's matrix: twelve numbers in the place of [R | t], of which nothing says that R is a rotation.

    Attributes:
        numbers: (3, 4).
        problem_condition: condition number of the least-squares problem.
    """

    numbers: np.ndarray
    problem_condition: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "numbers", frozen_array(self.numbers, (3, 4)))

    @property
    def condition(self) -> float:
        """The condition number of the three by three numbers in the place of R; 1 for a rotation."""
        return float(np.linalg.cond(self.numbers[:, :3]))

    def project(self, points_radar_m: Points3, camera: Camera) -> Points2:
        """Return the pixels (n, 2) of radar positions (n, 3): s p = K [R | t] P, with distortion (paper, equation 2)."""
        return camera.project(_homogeneous(points_radar_m) @ self.numbers.T)


def register_on_checkerboard(points_radar_m: Points3, corners_camera_m: Points3) -> CheckerboardMatrix:
    """Solve P_c = [R | t] P_r (paper, equation 1) for its twelve numbers by linear least squares (CCM).

    The corners lie in a plane, so the matrix maps every radar position into that plane: it is singular but for rounding.

    Args:
        points_radar_m: (n, 3) of the reflector.
        corners_camera_m: (n, 3) the corners that it was put on, in the camera frame.
    """
    rows = _homogeneous(points_radar_m)
    solution = np.linalg.lstsq(rows, corners_camera_m, rcond=None)[0]
    return CheckerboardMatrix(solution.T, float(np.linalg.cond(rows)))


def _homogeneous(points_m: Points3) -> np.ndarray:
    return np.hstack([points_m, np.ones((len(points_m), 1))])


def swapped(rotation_of: Calibration, translation_of: Calibration) -> Calibration:
    """Combine two calibrations of one rig, and judge the result on the pairs of the first; no uncertainty is stated.

    The translation is that of camera_from_radar, in camera axes, as the paper swaps it.

    Args:
        rotation_of: gives rotation, pairs, camera and options.
        translation_of: gives the translation.

    Raises:
        InputError: the two were made with different intrinsics, so they cannot be of one camera.
    """
    first, second = rotation_of.camera, translation_of.camera
    kinds = [(camera.model, camera.width_px, camera.height_px, camera.distortion.shape) for camera in (first, second)]
    one_lens, other_lens = (np.append(camera.matrix_px, camera.distortion) for camera in (first, second))
    if kinds[0] != kinds[1] or not np.allclose(one_lens, other_lens):
        raise InputError(
            "rotation and translation can be combined only for one camera: the two calibrations have different intrinsics; "
            "solve both with the same camera file"
        )
    pose = RigidTransform(rotation_of.camera_from_radar.rotation, translation_of.camera_from_radar.translation_m)
    note = DataWarning(
        "swapped-parts",
        "this pose has the rotation of one calibration and the translation of another",
        "use it to see which part causes an error, not as a calibration",
    )
    return judged_again(rotation_of, pose, [note])


def judged(
    camera_from_radar: RigidTransform,
    pairs: Sequence[Pair],
    unpaired: tuple[Unpaired, ...],
    excluded: frozenset[str],
    camera: Camera,
    options: CalibrationOptions,
    warnings: Sequence[DataWarning] = (),
) -> Calibration:
    """Make a calibration without stated uncertainty of a pose and the pairs that it is judged on.

    Of each pair the most plausible radar position counts, never the one that suits the pose.

    Args:
        camera_from_radar: the pose.
        pairs: in the order of the results; there may be none.
        unpaired: clicks without a radar position.
        excluded: ids of pairs that are shown, but not judged on.
        camera: the intrinsics.
        options: the assumed noise.
        warnings: of the method.
    """
    results = tuple(
        PairResult(
            id=pair.id,
            pixel_px=pair.pixel_px,
            projected_px=np.full(2, np.nan),
            point_radar_m=pair.candidates[0].position_radar_m,
            inlier=False,
            excluded=pair.id in excluded,
            image_time=pair.image_time,
            measured=pair,
        )
        for pair in pairs
    )
    unjudged = Calibration(
        camera_from_radar, np.full((6, 6), np.nan), camera, metrics_of(np.zeros(0)), results, unpaired, (), options
    )
    return judged_again(unjudged, camera_from_radar, warnings)


def judged_again(
    calibration: Calibration, camera_from_radar: RigidTransform, warnings: Sequence[DataWarning] = ()
) -> Calibration:
    """Judge another pose on the radar positions of a calibration; the result states no uncertainty.

    Its inliers are the pairs whose residual the assumed noise explains.

    Args:
        calibration: whose pairs, camera, options and radar errors are kept.
        camera_from_radar: the pose.
        warnings: of the method.
    """
    bare = Calibration(
        camera_from_radar=camera_from_radar,
        covariance=np.full((6, 6), np.nan),
        camera=calibration.camera,
        metrics=metrics_of(np.zeros(0)),
        pairs=calibration.pairs,
        unpaired=calibration.unpaired,
        warnings=(),
        options=calibration.options,
        radar_errors=calibration.radar_errors,
    )
    if not calibration.pairs:
        return replace(bare, warnings=tuple(warnings))
    projected_px = bare.reproject(np.array([pair.point_radar_m for pair in calibration.pairs]))
    results = tuple(
        replace(_bare(pair), projected_px=at_px, inlier=bool(fits))
        for pair, at_px, fits in zip(calibration.pairs, projected_px, _explained(bare), strict=True)
    )
    lengths_px = np.sort([result.distance_px for result in results if not result.excluded])
    found = replace(bare, pairs=results, metrics=metrics_of(lengths_px[np.isfinite(lengths_px)]))
    return replace(found, warnings=(*_of_input(found), *_outside(found), *warnings))


def _bare(pair: PairResult) -> PairResult:
    """Return a pair without what another method computed for it."""
    unknown = float("nan")
    return replace(
        pair,
        outlier_probability=unknown,
        influence=unknown,
        expected_covariance_px2=np.full((2, 2), unknown),
        held_out_px=unknown,
    )


def _explained(calibration: Calibration) -> Flags:
    """Return whether the noise that the options assume explains each residual: (n,)."""
    noise, pairs = calibration.options.noise, calibration.pairs
    points = calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]))
    sigma_polar = sigma_polar_of(noise)
    clicks = [pair.measured.sigma_px if pair.measured is not None else None for pair in pairs]
    model = linearize(
        calibration.camera_from_radar,
        calibration.camera,
        pixels_px=np.array([pair.pixel_px for pair in pairs]),
        sigma_px=np.array([noise.sigma_px if sigma is None else sigma for sigma in clicks]),
        polar=polar_from_cartesian(points),
        sigma_polar=np.tile(sigma_polar, (len(pairs), 1)),
    )
    return np.asarray(model.squared <= _EXPLAINED)


def _of_input(calibration: Calibration) -> tuple[DataWarning, ...]:
    used = [pair for pair in calibration.pairs if not pair.excluded]
    if not used:
        return ()
    points, pixels = np.array([pair.point_radar_m for pair in used]), np.array([pair.pixel_px for pair in used])
    return implausible_input([pair.id for pair in used], points, pixels, calibration.camera, calibration.options)


def _outside(calibration: Calibration) -> list[DataWarning]:
    """Warn if the pose puts most of the radar positions beside the picture that they were clicked in."""
    used = [pair for pair in calibration.pairs if not pair.excluded]
    shown = sum(calibration.camera.in_image(pair.projected_px[None])[0] for pair in used)
    if not used or 2 * shown >= len(used):
        return []
    count = "all" if not shown else f"{len(used) - shown} of"
    return [
        DataWarning(
            "outside-picture",
            f"this pose puts {count} {len(used)} clicked radar positions outside the picture",
            "do not use this pose; use the default method",
        )
    ]
