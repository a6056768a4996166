"""What the radar saw at the time of a frame, and where the calibrated camera should see it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices
from calib_core.association.gating import static_returns
from calib_core.association.pairing import RadarSource
from calib_core.association.placements import Placement
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.options import CalibrationOptions, GatingOptions
from calib_core.results import Calibration
from cocalib.session import Session
from cocalib.view import Reference, shown_calibration
from cocalib.web.messages import Overlay, OverlayGuess, OverlayReturn, RadarLook, RadarReturn

_NEAREST_WITHIN_S = 0.3
_MOST_RETURNS = 4000
"""So many returns are shown from above at most; of more, every other or every tenth and so on."""
_MARGIN_S = 1e-3


@dataclass(frozen=True, slots=True)
class RadarSight:
    """Reads the radar around single times."""

    recording: RadarSource

    def scan_at(self, time: TimeNs) -> RadarScan | None:
        """Return the scan nearest to a time, without returns that lack a position; None if none is near."""
        scans = self.recording.radar_scans_around([time], _NEAREST_WITHIN_S)
        return _finite(scans.scan(scans.nearest(time))) if len(scans) else None

    def trail(self, time: TimeNs, length_s: float) -> RadarScans:
        """Return the scans of the last seconds before a time, the scan at that time included."""
        half_s = length_s / 2.0
        middle = TimeNs(time - round(half_s * NS_PER_S))
        around = self.recording.radar_scans_around([middle], half_s + _MARGIN_S)
        return around.between(TimeNs(time - round(length_s * NS_PER_S)), time)

    def window(self, time: TimeNs, options: CalibrationOptions) -> RadarScans:
        """Return the static returns of the window around a click."""
        scans = self.recording.radar_scans_around([time], options.locating.window_s / 2)
        return static_returns(scans, options.gating)


def still_returns(scan: RadarScan, options: GatingOptions) -> Flags:
    """Return which returns are slow enough to be the reflector; without Doppler, all of them are."""
    return ~(np.abs(scan.doppler_mps) > options.max_speed_mps)


def shown_rows(scans: RadarScans, most: int) -> Indices:
    """Return the rows of the returns that have a position; evenly spaced ones if there are too many."""
    rows = np.flatnonzero(np.isfinite(scans.points_radar_m).all(axis=1))
    return rows[:: -(-len(rows) // most)] if len(rows) > most else rows


def look_of(index: int, time: TimeNs, trail: RadarScans, options: GatingOptions) -> RadarLook:
    """Return the returns of the last seconds, seen from above.

    Args:
        index: of the scan that is shown.
        time: its stamp.
        trail: the scans of these seconds.
        options: which returns can be the reflector.
    """
    ages_s = (time - trail.times_ns[trail.scan_of_return()]) / NS_PER_S
    rows = shown_rows(trail, _MOST_RETURNS)
    still = ~(np.abs(trail.doppler_mps) > options.max_speed_mps)
    return RadarLook(
        index,
        tuple(
            RadarReturn(
                x_m=round(float(trail.points_radar_m[row, 0]), 3),
                y_m=round(float(trail.points_radar_m[row, 1]), 3),
                z_m=round(float(trail.points_radar_m[row, 2]), 3),
                doppler_mps=_number(trail.doppler_mps[row]),
                snr_db=_number(trail.snr_db[row]),
                static=bool(still[row]),
                age_s=round(float(ages_s[row]), 3),
            )
            for row in rows
        ),
    )


def overlay_of(
    index: int,
    session: Session,
    scan: RadarScan | None,
    placements: Sequence[Placement],
    reference: Reference | None = None,
) -> Overlay:
    """Project the returns of a scan, and the placements at that time, into a frame.

    Args:
        index: of the frame.
        session: its newest calibration is used.
        scan: the nearest one; None if there is none.
        placements: those that include the frame.
        reference: used as long as the session has no calibration of its own.
    """
    calibration = shown_calibration(session, reference)
    if calibration is None:
        return Overlay(index, session.revision, None, ())
    returns = () if scan is None else _returns(calibration, scan, session.options.gating)
    return Overlay(index, session.revision, returns, _guesses(calibration, placements))


def _returns(calibration: Calibration, scan: RadarScan, options: GatingOptions) -> tuple[OverlayReturn, ...]:
    points_camera = calibration.camera_from_radar @ calibration.radar_errors.corrected(scan.points_radar_m)
    seen = calibration.camera.sees(points_camera)
    pixels = calibration.camera.project(points_camera[seen])
    ranges = np.linalg.norm(scan.points_radar_m[seen], axis=1)
    columns = (pixels, ranges, scan.doppler_mps[seen], scan.snr_db[seen], still_returns(scan, options)[seen])
    return tuple(
        OverlayReturn(
            u_px=round(float(pixel[0]), 2),
            v_px=round(float(pixel[1]), 2),
            range_m=round(float(range_m), 3),
            doppler_mps=_number(doppler),
            snr_db=_number(snr),
            static=bool(still),
        )
        for pixel, range_m, doppler, snr, still in zip(*columns, strict=True)
    )


def _guesses(calibration: Calibration, placements: Sequence[Placement]) -> tuple[OverlayGuess, ...]:
    if not placements:
        return ()
    positions = np.stack([placement.position_radar_m for placement in placements])
    pixels = calibration.reproject(positions)
    ranges_m = np.linalg.norm(positions, axis=1)
    inside = calibration.camera.in_image(pixels)
    return tuple(
        OverlayGuess(float(u), float(v), float(range_m))
        for (u, v), range_m in zip(pixels[inside], ranges_m[inside], strict=True)
    )


def _number(value: float) -> float | None:
    return None if np.isnan(value) else round(float(value), 3)


def _finite(scan: RadarScan) -> RadarScan:
    kept = np.all(np.isfinite(scan.points_radar_m), axis=1)
    return RadarScan(
        scan.time, scan.points_radar_m[kept], scan.doppler_mps[kept], scan.snr_db[kept], scan.sigma_polar[kept]
    )
