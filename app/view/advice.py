"""Where to put the reflector next, as text and as a position in the frame."""

import numpy as np

from app.view.model import Advice
from calib_core.results import Calibration

__all__ = ["advice_for"]

_NOTICEABLE = 0.05


def advice_for(calibration: Calibration) -> Advice | None:
    """Return where the next placement would help most; None where that is unknown, as with the paper's method."""
    best = calibration.next_placement
    if best is None:
        return None
    u_px, v_px = (round(float(value), 1) for value in best.pixel_px)
    range_m = float(np.linalg.norm(best.position_radar_m))
    if best.may_stop:
        words = "No further placement is needed: none would reduce the pose uncertainty noticeably."
    else:
        x, y, _ = best.position_radar_m
        side = "straight ahead" if abs(y) < 0.1 * abs(x) else f"{abs(y):.1f} m to the {'left' if y > 0 else 'right'}"
        amount = f"by {100 * (1 - 1 / best.gain):.0f} %" if best.gain > 1 + _NOTICEABLE else "slightly"
        words = f"Best next placement: {x:.1f} m ahead, {side}. It would reduce the pose uncertainty {amount}."
    return Advice(u_px, v_px, range_m, best.gain, best.may_stop, tuple(best.position_radar_m.tolist()), words)
