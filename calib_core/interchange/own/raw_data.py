"""Radar data as reported: what a pose is off by if nobody takes out what the radar gets wrong, and the pose for such data."""

from dataclasses import replace

import numpy as np

from calib_core.calibration import solve_again
from calib_core.errors import InputError
from calib_core.estimation.pair_results import averaged_distances_px
from calib_core.interchange.calibration_file import CalibrationFile, choose_check_point
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.measurements import Unsolvable
from calib_core.radar import RadarErrors
from calib_core.words.outcomes import said_of


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

    Its pairs are solved again as if the radar had no errors; the warnings stay those of the calibration.

    Raises:
        InputError: it contains no pairs, or they determine no such pose.
    """
    known = file.calibration
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
    unknown = np.full(
        (6, 6), np.nan
    )  # what the radar gets wrong is in the pose, and nobody knows how wrong it is elsewhere
    raw = replace(solved, warnings=known.warnings, covariance=unknown, angle_map=None, next_placement=None)
    check_point = choose_check_point(raw)
    return replace(
        file,
        calibration=raw,
        check_point=check_point,
        corrected=known,
        kept=(),
        made_from_sha256=calibration_sha256(file),
    )
