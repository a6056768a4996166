"""Which scan shows what a frame shows: the nearest by the recorded stamps, if it is near enough."""

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.measurements import NS_PER_S

_USUAL_GAP_S = 0.05  # of a single scan


def longest_gap_s(radar_times: TimesNs) -> float:
    """Return half the median period of the scans [s]: a frame farther than this from every scan has none."""
    periods = np.diff(radar_times)
    periods = periods[periods > 0]
    return float(np.median(periods)) / 2.0 / NS_PER_S if len(periods) else _USUAL_GAP_S


def frame_scans(image_times: TimesNs, radar_times: TimesNs, *, max_gap_s: float | None = None) -> Indices:
    """Return the index of the scan that is nearest to each frame (n,), of two equally near the earlier one; -1 for none.

    Args:
        image_times: (n,) stamps of the frames.
        radar_times: (m,) stamps of the scans, ascending.
        max_gap_s: longest time between a frame and its scan; None takes half the period of the scans.
    """
    if not len(radar_times):
        return np.full(len(image_times), -1, dtype=np.int64)
    limit_ns = round((longest_gap_s(radar_times) if max_gap_s is None else max_gap_s) * NS_PER_S)
    after = np.searchsorted(radar_times, image_times)
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, len(radar_times) - 1)
    to_before, to_after = np.abs(image_times - radar_times[before]), np.abs(radar_times[after] - image_times)
    nearest = np.where(to_before <= to_after, before, after)
    return np.asarray(np.where(np.minimum(to_before, to_after) <= limit_ns, nearest, -1))
