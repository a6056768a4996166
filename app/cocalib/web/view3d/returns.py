"""Radar returns of the 3D view: one scan or the last seconds, drawn in clouds by size, since a cloud of viser has one size."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, Values
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, TimeNs
from calib_core.options import GatingOptions
from calib_core.radar import polar_from_cartesian
from cocalib.web.view3d.nodes import add_cloud, fill_cloud

if TYPE_CHECKING:
    import viser

SIZES = (0.55, 0.75, 1.0, 1.35, 1.8)
"""Sizes of returns from weak to strong, relative to the middle one."""
_MIDDLE = len(SIZES) // 2


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


def size_classes(snr_db: Values, ends_db: tuple[float, float] | None) -> Indices:
    """Return the size class (n,) of each return, equal steps of amplitude; the middle one where it is not known.

    Args:
        snr_db: (n,).
        ends_db: amplitudes of the smallest and the largest; None if the radar has none.
    """
    if ends_db is None:
        return np.full(len(snr_db), _MIDDLE, dtype=np.int64)
    share = (snr_db - ends_db[0]) / max(ends_db[1] - ends_db[0], 1e-9)
    return np.where(np.isnan(share), _MIDDLE, np.clip(np.nan_to_num(share) * len(SIZES), 0, len(SIZES) - 1)).astype(
        np.int64
    )


class SizedClouds:
    """The nodes of viser that show returns: a cloud for each size class."""

    def __init__(self, scene: "viser.SceneApi", name: str) -> None:
        self._clouds = [add_cloud(scene, f"{name}_{number}", 0.12 * size) for number, size in enumerate(SIZES)]

    def fill(self, points_m: Points3, colours: np.ndarray, classes: Indices, size_m: float) -> None:
        """Draw returns.

        Args:
            points_m: (n, 3).
            colours: (n, 3).
            classes: (n,) of their sizes.
            size_m: of the middle class.
        """
        for number, cloud in enumerate(self._clouds):
            rows = classes == number
            cloud.point_size = size_m * SIZES[number]
            fill_cloud(cloud, points_m[rows], colours[rows])
