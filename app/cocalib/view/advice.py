"""Where to put the reflector next, as text and as a position in the frame."""

import numpy as np

from calib_core.results import Calibration, NextPlacement
from calib_core.verdict import Verdict, placement_words
from cocalib.view.model import Advice
from cocalib.view.wording import sentence

_NOTICEABLE = 0.05


def advice_for(calibration: Calibration, verdict: Verdict) -> Advice | None:
    """Return where the next placement would help most; None where that is unknown, as with the paper's method.

    Args:
        calibration: the latest outcome.
        verdict: on it; its action comes first, so that the advice does not contradict it.
    """
    best = calibration.next_placement
    if best is None:
        return None
    u_px, v_px = (round(float(value), 1) for value in best.pixel_px)
    range_m = float(np.linalg.norm(best.position_radar_m))
    position = tuple(best.position_radar_m.tolist())
    return Advice(u_px, v_px, range_m, best.gain, best.may_stop, position, _words(best, verdict))


def _words(best: NextPlacement, verdict: Verdict) -> str:
    """Return the verdict's action, and where a placement would help most if it is another one."""
    where = placement_words(best)
    if where in verdict.action:
        return sentence(verdict.action)
    if best.may_stop:
        return f"{sentence(verdict.action)} No further placement would reduce the pose uncertainty noticeably."
    amount = f"by {100 * (1 - 1 / best.gain):.0f} %" if best.gain > 1 + _NOTICEABLE else "slightly"
    return f"{sentence(verdict.action)} A placement {where}, would reduce the pose uncertainty {amount}."
