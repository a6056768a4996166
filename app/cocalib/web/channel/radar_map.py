"""Where the radar saw static returns during a whole recording, from above: what stays, what came and went, how strong it is."""

import numpy as np

from calib_core.arrays import Indices, Values
from calib_core.measurements import RadarScans
from calib_core.options import GatingOptions
from cocalib.web.messages import RadarMap

_CELLS_ACROSS = 600
_SMALLEST_CELL_M = 0.2
_MOST_CELLS = 6000
_LEAST_SCANS = 3
"""A cell with returns in fewer scans is left out: it is noise."""
_LOW_QUANTILE, _HIGH_QUANTILE = 0.05, 0.995
_DB_STEPS = np.arange(-100.0, 160.0, 0.5)


class RadarMapSum:
    """Counts static returns by square cells, a bounded number of scans at a time; memory does not grow with the recording."""

    def __init__(self, options: GatingOptions) -> None:
        self._cell_m = max(_SMALLEST_CELL_M, 2.0 * options.max_range_m / _CELLS_ACROSS)
        self._scans = 0
        self._shown = np.zeros(_CELLS_ACROSS**2, dtype=np.int64)
        self._returns = np.zeros(_CELLS_ACROSS**2)
        self._sum_z_m = np.zeros(_CELLS_ACROSS**2)
        self._measured = np.zeros(_CELLS_ACROSS**2)
        self._sum_db = np.zeros(_CELLS_ACROSS**2)
        self._histogram = np.zeros(len(_DB_STEPS) - 1, dtype=np.int64)

    def add(self, static: RadarScans) -> None:
        """Count the static returns of some scans; scans without any count too."""
        self._scans += len(static)
        places = np.floor(static.points_radar_m[:, :2] / self._cell_m) + _CELLS_ACROSS // 2
        inside = ((places >= 0) & (places < _CELLS_ACROSS)).all(axis=1)
        cell: Indices = (places[inside, 0] * _CELLS_ACROSS + places[inside, 1]).astype(np.int64)
        scan_and_cell = np.unique(static.scan_of_return()[inside] * _CELLS_ACROSS**2 + cell)
        self._shown += np.bincount(scan_and_cell % _CELLS_ACROSS**2, minlength=_CELLS_ACROSS**2)
        snr_db = static.snr_db[inside]
        known = np.isfinite(snr_db)
        self._returns += np.bincount(cell, minlength=_CELLS_ACROSS**2)
        self._sum_z_m += np.bincount(cell, weights=static.points_radar_m[inside, 2], minlength=_CELLS_ACROSS**2)
        self._measured += np.bincount(cell[known], minlength=_CELLS_ACROSS**2)
        self._sum_db += np.bincount(cell[known], weights=snr_db[known], minlength=_CELLS_ACROSS**2)
        self._histogram += np.histogram(snr_db[known], _DB_STEPS)[0]

    def total(self) -> RadarMap:
        """Return the cells that were seen most often."""
        seen = np.flatnonzero(self._shown >= _LEAST_SCANS)
        kept = np.sort(seen[np.argsort(-self._shown[seen], kind="stable")][:_MOST_CELLS])
        low_db, high_db = (self._quantile_db(share) for share in (_LOW_QUANTILE, _HIGH_QUANTILE))
        has_db = low_db < high_db  # equal amplitudes say nothing
        middle = (np.stack(np.divmod(kept, _CELLS_ACROSS)) - _CELLS_ACROSS // 2 + 0.5) * self._cell_m
        mean_db = self._sum_db[kept] / np.maximum(self._measured[kept], 1.0)
        return RadarMap(
            cell_m=self._cell_m,
            x_m=_numbers(middle[0], 3),
            y_m=_numbers(middle[1], 3),
            z_m=_numbers(self._sum_z_m[kept] / self._returns[kept], 3),
            share=_numbers(self._shown[kept] / max(self._scans, 1), 4),
            snr_db=_numbers(mean_db, 1) if has_db else (),
            low_db=low_db if has_db else None,
            high_db=high_db if has_db else None,
        )

    def _quantile_db(self, share: float) -> float:
        """Return the amplitude that this share of the returns is below; the lowest one without any."""
        summed = np.cumsum(self._histogram)
        return float(_DB_STEPS[int(np.searchsorted(summed, share * summed[-1]))])


def _numbers(values: Values, decimals: int) -> tuple[float, ...]:
    return tuple(np.round(values, decimals).tolist())
