"""A moving target that the radar followed."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, Points3, TimesNs, frozen_array


@dataclass(frozen=True, slots=True, eq=False)
class TargetTrack:
    """A moving target that the radar followed: found from the returns alone, without any calibration.

    Attributes:
        id: unique within a recording, such as "target-3".
        times_ns: (k,) stamps of the scans that saw it, ascending.
        scans: (k,) their indices.
        positions_m: (k, 3) mean of its returns in each.
        rows: (n,) its returns, as rows of the recording's RadarScans, ascending.
        scan_of_row: (n,) index of the scan of each.
        points_radar_m: (n, 3) of its returns, as the radar reports them.
    """

    id: str
    times_ns: TimesNs
    scans: Indices
    positions_m: Points3
    rows: Indices
    scan_of_row: Indices
    points_radar_m: Points3

    def __post_init__(self) -> None:
        sightings, returns = len(self.scans), len(self.rows)
        for name, count in (("times_ns", sightings), ("scans", sightings), ("rows", returns), ("scan_of_row", returns)):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (count,), dtype=np.int64))
        object.__setattr__(self, "positions_m", frozen_array(self.positions_m, (sightings, 3)))
        object.__setattr__(self, "points_radar_m", frozen_array(self.points_radar_m, (returns, 3)))
