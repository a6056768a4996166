"""The ends of a dwell: without the moments at which somebody holds the reflector, whose echo is then much weaker."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Values

_WEAKER_DB = 6.0
_WEAKER_SCATTERS = 4.0
"""How far below the dwell's median an echo is weak: in decibels at least, and in standard deviations of its echoes."""
_LONGEST_END_S = 1.2
"""What is weak for longer is a dwell whose echo changes, not an end."""
_AT_END_S = 0.45
_STRONG_SHARE = 0.5
"""How many scans in the last moments are strong, relative to the whole dwell."""
_FEW = 5


@dataclass(frozen=True, slots=True)
class FirmSpan:
    """The first and last scan in which the reflector stood alone, counted from the first scan given."""

    first: int
    last: int


def firm_span(times_s: Values, snr_db: Values) -> FirmSpan:
    """Leave out weak echoes at both ends of a dwell; nothing is left out where the radar reports no strength.

    Args:
        times_s: (m,) of all scans from the first that shows the dwell to the last, ascending.
        snr_db: (m,) of its strongest return in each; NaN where there is none, or unknown.
    """
    known = snr_db[np.isfinite(snr_db)]
    last = len(times_s) - 1
    if len(known) < _FEW:
        return FirmSpan(0, last)
    median_db = float(np.median(known))
    scatter_db = 1.48 * float(np.median(np.abs(known - median_db)))
    strong = np.nan_to_num(snr_db, nan=-np.inf) >= median_db - max(_WEAKER_DB, _WEAKER_SCATTERS * scatter_db)
    first = _first_firm(times_s - times_s[0], strong)
    return FirmSpan(first, last - _first_firm((times_s[-1] - times_s)[::-1], strong[::-1]))


def _first_firm(since_s: Values, strong: Flags) -> int:
    """Return the first strong scan after which as many are strong as usual; 0 if there is none near the end."""
    for row in np.flatnonzero(strong & (since_s <= _LONGEST_END_S)).tolist():
        after = (since_s >= since_s[row]) & (since_s <= since_s[row] + _AT_END_S)
        if strong[after].mean() >= _STRONG_SHARE * strong.mean():
            return int(row)
    return 0
