"""Moving targets that the radar followed, and their returns with the boxes that they belong to."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3, TimesNs, frozen_array

__all__ = ["BoxedReturns", "TargetTrack"]


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


@dataclass(frozen=True, slots=True, eq=False)
class BoxedReturns:
    """The returns that Acc counts, each with the box of its target.

    Attributes:
        frames: (n,) which of BoxFigures.frames each belongs to, ascending.
        points_radar_m: (n, 3) as the radar reports them.
        pixels_px: (n, 2) where the calibration puts them; NaN behind the camera.
        boxes_px: (n, 4) left, top, right, bottom of its target's box; NaN if its target has none in the frame.
        inside: (n,) whether the pixel is in that box.
        targets: (n,) the target's id.
        labels: (n,) the class of its box; "" without one.
    """

    frames: Indices
    points_radar_m: Points3
    pixels_px: Points2
    boxes_px: np.ndarray
    inside: Flags
    targets: tuple[str, ...]
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        n = len(self.targets)
        object.__setattr__(self, "frames", frozen_array(self.frames, (n,), dtype=np.int64))
        object.__setattr__(self, "inside", frozen_array(self.inside, (n,), dtype=np.bool_))
        for name, width in (("points_radar_m", 3), ("pixels_px", 2), ("boxes_px", 4)):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (n, width)))
