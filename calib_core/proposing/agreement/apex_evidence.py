"""Apex evidence: whether what stood at the placements shows the apex of a reflector, or is somebody who stood still.

A person who goes from place to place is seen by the radar and in the pictures alike, so both agree on the right mounting. But
where a reflector is large enough in the picture its three sheets meet in a point, and a person's clothes rarely do.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.proposing.agreement.pose_agreement import PoseAgreement
from calib_core.proposing.dwell_views import DwellView

_WIDE_ENOUGH_PX = 16.0
"""Width of a reflector whose apex can be seen."""
_OF_REFLECTOR, _OF_OTHERS = 0.85, 0.25
"""Share of the places with an apex: of reflectors of that width 0.92 in simulated recordings, of people 0.1 to 0.4."""
_BEFORE = 1.0
"""Log-odds before any picture: most recordings contain a reflector."""
_LEAST_SEEN = 3
"""Fewer places of that width say nothing."""
_PRESENT = 0.5


def apex_log_odds(views: Sequence[DwellView], agreement: PoseAgreement) -> float:
    """Return the log-odds that what stood there is a reflector; infinite where too little is large enough to tell.

    Args:
        views: as the agreement was found for, without confirmed clicks.
        agreement: its most probable candidates are looked at.
    """
    log_odds, count = _BEFORE, 0
    for i, view in enumerate(views):
        row = int(agreement.likeliest[i])
        if agreement.probability[i, row] < _PRESENT or not view.width_px >= _WIDE_ENOUGH_PX:
            continue
        shares = np.array([_OF_REFLECTOR, _OF_OTHERS])
        seen = shares if view.candidates[row].has_apex else 1.0 - shares
        log_odds += float(np.log(seen[0] / seen[1]))
        count += 1
    return log_odds if count >= _LEAST_SEEN else float("inf")
