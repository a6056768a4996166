"""Colours of values, the same in the 3D view, overlay videos and Rerun: returns by range or speed, residuals by length."""

from typing import TypeAlias

import numpy as np

from calib_core.arrays import Values

Colour: TypeAlias = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

STAYING: dict[bool, Colour] = {False: (128, 146, 164), True: (96, 110, 126)}
"""What has no value, on a dark background (False) and on a light one (True)."""
RETURN_RAMPS: dict[tuple[str, bool], tuple[Colour, ...]] = {
    ("rising", False): ((78, 66, 190), (150, 60, 180), (214, 82, 120), (246, 150, 70), (250, 226, 92)),
    ("rising", True): ((240, 190, 110), (226, 120, 86), (180, 56, 120), (112, 36, 140), (44, 12, 92)),
    ("signed", False): ((96, 176, 255), (96, 132, 170), (132, 140, 148), (190, 132, 92), (255, 150, 70)),
    ("signed", True): ((10, 96, 190), (70, 110, 150), (112, 120, 128), (160, 100, 50), (200, 76, 0)),
}
"""Evenly spaced colours, by what they show and by whether the background is light."""

_GREY = (120, 132, 145)
_RESIDUALS_AT = np.array([0.0, 0.35, 0.6, 0.8, 1.0])
_RESIDUALS = np.array([[74, 170, 235], [143, 200, 226], [236, 214, 150], [240, 158, 66], [226, 82, 44]], dtype=float)


def ramp_colours(values: Values, low: float, high: float, *, light: bool, signed: bool = False) -> np.ndarray:
    """Return the colour (n, 3) of values between two ends; grey where one is not known."""
    ramp = np.array(RETURN_RAMPS["signed" if signed else "rising", light], dtype=np.float64)
    share = np.clip((values - low) / max(high - low, 1e-9), 0.0, 1.0)
    colours = np.stack([np.interp(share, np.linspace(0, 1, len(ramp)), channel) for channel in ramp.T], axis=1)
    colours[np.isnan(values)] = STAYING[light]
    return colours


def residual_colours(residuals_px: Values, limit_px: float) -> np.ndarray:
    """Return (n, 3) colours of residuals: blue for small ones, sand near the limit, red for large ones, grey for NaN."""
    share = np.clip(residuals_px / max(limit_px, 1e-9), 0.0, 1.0)
    colours = np.stack([np.interp(share, _RESIDUALS_AT, channel) for channel in _RESIDUALS.T], axis=1)
    colours[np.isnan(residuals_px)] = _GREY
    return np.rint(colours).astype(np.uint8)
