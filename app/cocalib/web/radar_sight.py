"""What the radar saw at the time of a frame, and where the calibrated camera should see it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3, Values
from calib_core.association.gating import static_returns
from calib_core.association.pairing import RadarSource
from calib_core.association.placements import Placement
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.options import CalibrationOptions, GatingOptions
from calib_core.radar import RadarErrors, polar_from_cartesian
from calib_core.results import Calibration
from cocalib.session.state import Session
from cocalib.view.reference import Reference, shown_calibration
from cocalib.web.messages.outgoing import Overlay, OverlayGuess
from cocalib.web.messages.space_messages import RadarFrame, RadarReturn

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


@dataclass(frozen=True, slots=True, eq=False)
class Returns:
    """Returns as columns.

    Attributes:
        points_m: (n, 3) where they are drawn: estimated errors of the radar are taken out.
        polar: (n, 3) range [m], azimuth and elevation [rad], as the radar reports them.
        doppler_mps: (n,) NaN if the radar has none.
        snr_db: (n,) NaN if the radar has none.
        age_s: (n,) how long before the shown moment.
        still: (n,) slow enough to be the reflector.
    """

    points_m: Points3
    polar: Points3
    doppler_mps: Values
    snr_db: Values
    age_s: Values
    still: Flags

    def __len__(self) -> int:
        return len(self.points_m)

    def rows(self, rows: Indices) -> "Returns":
        """Return some of them."""
        columns = (self.points_m, self.polar, self.doppler_mps, self.snr_db, self.age_s, self.still)
        return Returns(*(column[rows] for column in columns))

    def thinned(self, most: int) -> "Returns":
        """Return at most so many of them, evenly spaced."""
        step = -(-len(self) // most)
        return self.rows(np.arange(0, len(self), step)) if step > 1 else self

    def messages(self, pixels_px: Points2) -> tuple[RadarReturn, ...]:
        """Return them as they are sent to a page.

        Args:
            pixels_px: (n, 2) where they are in the image; NaN if they are not in it.
        """
        range_m, angles_deg = self.polar[:, :1], np.rad2deg(self.polar[:, 1:])
        before = np.column_stack([pixels_px, range_m, self.doppler_mps, self.snr_db]).round(3).tolist()
        after = np.column_stack([self.points_m, self.age_s, angles_deg]).round(3).tolist()
        rows = zip(before, self.still.tolist(), after, strict=True)
        return tuple(RadarReturn(*(*first, still, *last)) for first, still, last in rows)

    @classmethod
    def of(
        cls, scans: RadarScans, time: TimeNs, gating: GatingOptions, corrected: Callable[[Points3], Points3]
    ) -> "Returns":
        """Collect the returns of some scans that have a position.

        Args:
            scans: to show.
            time: the shown moment.
            gating: which returns can be the reflector.
            corrected: takes estimated errors of the radar out of positions (n, 3).
        """
        known = np.flatnonzero(np.isfinite(scans.points_radar_m).all(axis=1))
        points, doppler = scans.points_radar_m[known], scans.doppler_mps[known]
        ages_s = (time - scans.times_ns[scans.scan_of_return()[known]]) / NS_PER_S
        return cls(
            corrected(points),
            polar_from_cartesian(points),
            doppler,
            scans.snr_db[known],
            np.maximum(ages_s, 0.0),
            ~(np.abs(doppler) > gating.max_speed_mps),
        )

    @classmethod
    def of_scan(
        cls, scan: RadarScan | None, gating: GatingOptions, corrected: Callable[[Points3], Points3]
    ) -> "Returns":
        """Collect the returns of one scan; none without one."""
        if scan is None:
            return cls.of(RadarScans(), TimeNs(0), gating, corrected)
        return cls.of(RadarScans.from_scans([scan]), scan.time, gating, corrected)


def pixels_of(calibration: Calibration | None, points_m: Points3) -> Points2:
    """Return where points (n, 3), without errors of the radar, are in the image (n, 2); NaN if they are not in it."""
    pixels = np.full((len(points_m), 2), np.nan)
    if calibration is not None and len(points_m):
        points_camera = calibration.camera_from_radar @ points_m
        seen = calibration.camera.sees(points_camera)
        pixels[seen] = calibration.camera.project(points_camera[seen])
    return pixels


def look_of(index: int, time: TimeNs, trail: RadarScans, options: GatingOptions) -> RadarFrame:
    """Return the returns of the last seconds, seen from above.

    Args:
        index: of the scan that is shown.
        time: its stamp.
        trail: the scans of these seconds.
        options: which returns can be the reflector.
    """
    returns = Returns.of(trail, time, options, RadarErrors().corrected).thinned(_MOST_RETURNS)
    return RadarFrame(index, returns.messages(pixels_of(None, returns.points_m)))


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


def _returns(calibration: Calibration, scan: RadarScan, options: GatingOptions) -> tuple[RadarReturn, ...]:
    """Return the returns of a scan that are in the image."""
    returns = Returns.of_scan(scan, options, calibration.radar_errors.corrected)
    pixels = pixels_of(calibration, returns.points_m)
    seen = np.flatnonzero(np.isfinite(pixels).all(axis=1))
    return returns.rows(seen).messages(pixels[seen])


_MOST_UNSURE = 1 / 12
"""Nothing is expected where its standard deviation is above this part of the image's width: the page zooms in there."""


def _guesses(calibration: Calibration, placements: Sequence[Placement]) -> tuple[OverlayGuess, ...]:
    if not placements:
        return ()
    positions = np.stack([placement.position_radar_m for placement in placements])
    pixels = calibration.reproject(positions)
    ranges_m = np.linalg.norm(positions, axis=1)
    unsure = calibration.pixel_sigma(positions).max(axis=1) > _MOST_UNSURE * calibration.camera.width_px
    inside = calibration.camera.in_image(pixels) & ~unsure
    return tuple(
        OverlayGuess((float(u), float(v)), float(range_m))
        for (u, v), range_m in zip(pixels[inside], ranges_m[inside], strict=True)
    )


def _finite(scan: RadarScan) -> RadarScan:
    kept = np.all(np.isfinite(scan.points_radar_m), axis=1)
    return RadarScan(
        scan.time, scan.points_radar_m[kept], scan.doppler_mps[kept], scan.snr_db[kept], scan.sigma_polar[kept]
    )
