"""Where placements are missing, judged by the radar alone: before any click there is no pose whose uncertainty could guide.

The field is divided into three bearings and three ranges. What determines a pose is spread: both edges of the picture, near and
far, and two heights.
"""

from collections import Counter
from dataclasses import dataclass
from itertools import product

import numpy as np

from calib_core.arrays import Points3
from calib_core.radar import polar_from_cartesian

ENOUGH_PLACEMENTS = 20
"""The number of placements that docs/tour.md advises to record."""

_RANGES_M = ((2.0, 5.0), (5.0, 10.0), (10.0, 15.0))
_SIDES = ("left", "ahead", "right")
_EDGE_SHARE = 1.0 / 3.0
_SAME_PLACE_M = 0.5
_TWO_HEIGHTS_M = 0.3


@dataclass(frozen=True, slots=True)
class Place:
    """A part of the field.

    Attributes:
        side: "left", "ahead" or "right".
        near_m: nearest range [m].
        far_m: farthest range [m].
    """

    side: str
    near_m: float
    far_m: float


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the placements so far cover.

    Attributes:
        placements: number of different ones.
        next: where the next one should be; None once there are enough and no part of the field is empty.
        one_height: all of them are at one height, of those a radar with elevation has measured.
    """

    placements: int
    next: Place | None
    one_height: bool

    @property
    def is_enough(self) -> bool:
        """Whether there are enough placements, spread over the field."""
        return self.placements >= ENOUGH_PLACEMENTS and self.next is None


def placement_coverage(positions_radar_m: Points3, *, half_view_rad: float) -> Coverage:
    """Say what placements cover and where the next one should be.

    Args:
        positions_radar_m: (n, 3) of the placements.
        half_view_rad: largest bearing to either side that the camera sees [rad].
    """
    places = _different(np.asarray(positions_radar_m, dtype=np.float64).reshape(-1, 3))
    polar = polar_from_cartesian(places)
    counts = Counter(map(_place, polar[:, 0], polar[:, 1] / half_view_rad))
    every = [Place(side, *limits) for limits, side in product(_RANGES_M, _SIDES)]
    emptiest = min(every, key=lambda place: (counts[place], _from_the_others(place, counts)))
    heights_m = places[:, 2]
    flat = len(places) > 1 and float(np.ptp(heights_m)) < _TWO_HEIGHTS_M and bool(np.ptp(heights_m) > 0)
    needed = len(places) < ENOUGH_PLACEMENTS or counts[emptiest] == 0
    return Coverage(len(places), emptiest if needed else None, flat)


def _different(places: Points3) -> Points3:
    """Return the places without those next to an earlier one."""
    kept: list[np.ndarray] = []
    for place in places:
        if all(np.linalg.norm(place - other) >= _SAME_PLACE_M for other in kept):
            kept.append(place)
    return np.array(kept).reshape(-1, 3)


def _place(range_m: float, share: float) -> Place:
    """Return the part of the field at a range and a share of the half view, positive to the left."""
    side = "left" if share > _EDGE_SHARE else "right" if share < -_EDGE_SHARE else "ahead"
    limits = next((limits for limits in _RANGES_M if range_m < limits[1]), _RANGES_M[-1])
    return Place(side, *limits)


def _from_the_others(place: Place, counts: "Counter[Place]") -> int:
    """Rank parts of the field with equally many placements: those whose side and whose range have the fewest come first."""
    return sum(count for other, count in counts.items() if other.side == place.side or other.near_m == place.near_m)
