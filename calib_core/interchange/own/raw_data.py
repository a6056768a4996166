"""Radar data as reported: what a pose is off by if nobody takes out what the radar gets wrong, and the pose for such data."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.calibration import solve_again
from calib_core.errors import InputError
from calib_core.estimation.pair_results import averaged_distances_px
from calib_core.geometry import pose_difference, skew
from calib_core.interchange.calibration_file import CalibrationFile, choose_check_point
from calib_core.interchange.format import PoseFor
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.measurements import Unsolvable
from calib_core.radar import RadarErrors
from calib_core.results import Calibration
from calib_core.words.outcomes import said_of

_SAME_SIGMAS = 0.5
"""Poses that differ by less, in standard deviations of the pose, are not told apart."""


@dataclass(frozen=True, slots=True)
class OtherPose:
    """The pose that a file could hold instead, for the other kind of radar data.

    Attributes:
        is_for: the radar data that it is for.
        moved_cm: between the camera's positions of both poses [cm].
        aed_px: of such data under the pose of the file, and under the other one.
    """

    is_for: PoseFor
    moved_cm: float
    aed_px: tuple[float, float]

    @property
    def gain(self) -> str:
        """How far the camera is from there, and what the mean reprojection error becomes."""
        before, after = (f"{aed_px:#.3g}".rstrip(".") for aed_px in self.aed_px)
        return f"the camera moves {f'{self.moved_cm:#.2g}'.rstrip('.')} cm, AED {before} -> {after} px"

    @property
    def note(self) -> str:
        """How to write it."""
        returns = "returns as reported" if self.is_for == "raw" else "corrected returns"
        return f"for {returns}: --for {self.is_for} ({self.gain})"


def other_pose(file: CalibrationFile) -> OtherPose | None:
    """Return the pose for the other kind of radar data; None without corrections or pairs, or if the two hardly differ."""
    corrected = file.corrected or file.calibration
    if corrected.radar_errors == RadarErrors():
        return None
    try:
        raw = _solved_as_reported(corrected)
    except InputError:
        return None
    apart = pose_difference(corrected.camera_from_radar, raw.camera_from_radar, corrected.covariance)
    if apart.squared < _SAME_SIGMAS**2:
        return None
    raw_px = raw.metrics.aed_px
    if file.corrected is not None:
        return OtherPose("corrected", apart.position_cm, (raw_px, corrected.metrics.aed_px))
    with_errors_px = averaged_distances_px(replace(corrected, radar_errors=RadarErrors()))
    before_px = float(with_errors_px.mean()) if len(with_errors_px) else math.nan
    return OtherPose("raw", apart.position_cm, (before_px, raw_px))


def aed_either_way(file: CalibrationFile) -> tuple[float, float] | None:
    """Return the AED [px] of a file's pose as it is meant, and the other way, with or without the radar's corrections.

    None if there are no corrections, or nothing to average.
    """
    calibration = file.calibration
    if file.aed_either_way_px is not None:
        return file.aed_either_way_px
    if file.corrected is not None:
        return calibration.metrics.aed_px, file.corrected.metrics.aed_px
    if calibration.radar_errors == RadarErrors() or not np.isfinite(calibration.metrics.aed_px):
        return None
    raw_px = averaged_distances_px(replace(calibration, radar_errors=RadarErrors()))
    return (calibration.metrics.aed_px, float(raw_px.mean())) if len(raw_px) else None


def for_raw(file: CalibrationFile) -> CalibrationFile:
    """Return a calibration with the pose for radar data as reported, for users who cannot take out what the radar gets wrong.

    Its pairs are solved again as if the radar had no errors; the warnings stay those of the calibration. Without corrections
    it is the calibration itself.

    Raises:
        InputError: it contains no pairs, or they determine no such pose.
    """
    known = file.calibration
    if file.corrected is not None or known.radar_errors == RadarErrors():
        return file
    raw = _solved_as_reported(known)
    return replace(
        file,
        calibration=raw,
        check_point=choose_check_point(raw),
        corrected=known,
        kept=(),
        made_from_sha256=calibration_sha256(file),
    )


@lru_cache(maxsize=4)
def _solved_as_reported(known: Calibration) -> Calibration:
    exact = replace(
        known.options.radar,
        azimuth_scale_sigma=0.0,
        elevation_scale_sigma=0.0,
        range_bias_sigma_m=0.0,
        height_sigma_m=0.0,
    )
    try:
        solved = solve_again(known, replace(known.options, radar=exact))
    except InputError as error:
        raise InputError(
            f"the pose for radar data as reported is solved from the pairs: the calibration {error}"
        ) from None
    if isinstance(solved, Unsolvable):
        raise InputError(f"there is no pose for radar data as reported: {said_of(solved)}")
    covariance = known.covariance + _spread_of_corrections(known, solved)
    return replace(solved, warnings=known.warnings, covariance=covariance, angle_map=None, next_placement=None)


def _spread_of_corrections(corrected: Calibration, raw: Calibration) -> Matrix66:
    """Return what the covariance of a pose grows by because no pose replaces the corrections at every pair.

    For each pair, the least change of the pose, in the metric of its covariance, that takes the reported position to where
    the corrected one is seen: the mean of their squares. It does not shrink with the number of pairs.
    """
    reported = np.array([pair.point_radar_m for pair in corrected.pairs if pair.inlier]).reshape(-1, 3)
    seen = corrected.camera_from_radar @ corrected.radar_errors.corrected(reported)
    spread = np.zeros((6, 6))
    for point, moved in zip(seen, raw.camera_from_radar @ reported, strict=True):
        across = np.linalg.svd(point[None])[2][1:]  # the two directions of the image at this point
        by_pose = across @ np.hstack([np.eye(3), -skew(point - corrected.camera_from_radar.translation_m)])
        gain = corrected.covariance @ by_pose.T @ np.linalg.pinv(by_pose @ corrected.covariance @ by_pose.T)
        change = gain @ across @ (point - moved)
        spread += np.outer(change, change) / len(seen)
    return spread
